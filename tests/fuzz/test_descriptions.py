"""Descriptions and parameters that users write: YAML, JSON, command lines."""
import json

import numpy as np
import pytest
import yaml
from hypothesis import example, given
from hypothesis import strategies as st

from fuzzing import JUNK, TEXTS, mutated, spoiled, survives, written
from openpose_ros_pkg.calibration import calibration_text, pinhole_calibration, read_calibration
from openpose_ros_pkg.errors import BadInputError, ModelError, ParameterError
from openpose_ros_pkg.networks.model_description import read_description
from openpose_ros_pkg.params.flags import read_flags
from openpose_ros_pkg.params.nodes import ServiceSettings
from openpose_ros_pkg.params.parameters import build, flat_values, parameter_fields
from openpose_ros_tools.calibration.known_cameras import read_known_cameras
from openpose_ros_tools.mocap.marker_map import place, read_marker_map, shipped_maps
from openpose_ros_web.protocol import WIDTHS, read_want
from skeleton_extract_3d.node_params import PeopleSettings
from skeleton_extract_3d.points import rgbd_folder
from skeleton_extract_3d.points.camera import calibrated_camera

CALIBRATION = calibration_text(pinhole_calibration(640, 480, (500, 500), (320, 240), (0.1, -0.2, 0, 0, 0)))
CAMERA_INFO = {'header': {'seq': 0, 'frame_id': 'camera'}, 'height': 480, 'width': 640,
               'distortion_model': 'plumb_bob', 'D': [0.1, -0.2, 0.0, 0.0, 0.0],
               'K': [500.0, 0, 320, 0, 500, 240, 0, 0, 1], 'R': np.eye(3).ravel().tolist(),
               'P': [500.0, 0, 320, 0, 0, 500, 240, 0, 0, 0, 1, 0], 'binning_x': 0, 'binning_y': 0,
               'roi': {'x_offset': 0, 'y_offset': 0, 'height': 0, 'width': 0, 'do_rectify': False}}
OPEN3D = {'width': 640, 'height': 480, 'intrinsic_matrix': [500, 0, 0, 0, 500, 0, 320, 240, 1]}
SEQUENCE = {'fps': 15, 'frame_id': 'camera', 'T_world_camera': np.eye(4).tolist(), 'depth_scale': 1000}
MODEL = {'skeleton': {'joints': ['nose', 'neck', 'chest'], 'limbs': [
    {'start': 'nose', 'end': 'neck', 'paf': [0, 1]}, {'start': 'neck', 'end': 'chest', 'paf': [2, 3]}],
    'drawn_limbs': [['nose', 'neck']]}, 'files': [{'name': 'net.onnx', 'size': 10}], 'decoder': 'paf', 'stride': 8,
    'outputs': ['fields'], 'input': {'channels': 'RGB', 'mean': 127.5, 'scale': 0.01, 'fixed_size': [64, 64]}}
MARKERS = {'joints': {'nose': {'markers': ['F1', 'F2']}, 'left_wrist': ['LWRA', 'LWRB'],
                      'left_hip': {'hip_centre': 'left', 'asis': ['L', 'R'], 'psis': ['S']},
                      'neck': {'joints': ['nose']},
                      'left_ankle': {'markers': ['A'], 'shift': {'metres': 0.04, 'from': ['L'], 'to': ['R']}},
                      'head_top': {'first_of': ['HTOP', ['LFHD', 'RFHD']]}}}
CALIB_TOML = (b'[a]\nsize = [640.0, 480.0]\nmatrix = [[500.0, 0.0, 320.0], [0.0, 500.0, 240.0], [0.0, 0.0, 1.0]]\n'
              b'distortions = [0.1, 0.0, 0.0, 0.0]\nrotation = [1.0, 0.0, 0.0]\ntranslation = [0.0, 0.0, 1.0]\n')
QUALISYS = (b'<?xml version="1.0"?><calibration><cameras><camera serial="1" model="Video"><fov_video left="0" top="0" '
            b'right="639" bottom="479"/><transform x="1" y="2" z="3" r11="1" r12="0" r13="0" r21="0" r22="1" r23="0" '
            b'r31="0" r32="0" r33="1"/><intrinsic focalLengthU="32000" focalLengthV="32000" centerPointU="20480" '
            b'centerPointV="15360" skew="0" radialDistortion1="0" radialDistortion2="0" radialDistortion3="0" '
            b'tangentalDistortion1="0" tangentalDistortion2="0"/></camera></cameras></calibration>')
KALIBR = {f'cam{number}': {
    'camera_model': 'pinhole', 'distortion_model': 'radtan', 'distortion_coeffs': [0.1, 0.0, 0.0, 0.0],
    'resolution': [640, 480], 'intrinsics': [500.0, 500.0, 320.0, 240.0], 'T_cn_cnm1': np.eye(4).tolist(),
    'timeshift_cam_imu': 0.01} for number in range(2)}
OWN_FILE = {**yaml.safe_load(CALIBRATION), 'R': np.eye(3).tolist(), 'T': [0.0, 0.0, 1.0]}
DEEP = b'a: ' + b'[' * 5000
BOMB = b'a0: &a0 [x]\n' + b''.join(b'a%d: &a%d [%s]\n' % (i, i, b', '.join([b'*a%d' % (i - 1)] * 10))
                                  for i in range(1, 10))


def texts(*values):
    """Yield spoiled texts of values, spoiled values as YAML, and texts that once were a problem."""
    return st.one_of(mutated(*map(_dumped, values)), *(spoiled(value).map(_dumped) for value in values),
                     st.sampled_from((DEEP, BOMB)))


def _dumped(value):
    return yaml.safe_dump(value, allow_unicode=True, sort_keys=False).encode('utf-8', errors='surrogatepass')


def camera_of(path):
    """Read a calibration, then its camera."""
    return calibrated_camera(read_calibration(path))


@given(st.one_of(texts(yaml.safe_load(CALIBRATION), CAMERA_INFO), mutated(CALIBRATION.encode()),
                 mutated(json.dumps(OPEN3D).encode(), json.dumps(CAMERA_INFO).encode()),
                 spoiled(OPEN3D).map(lambda value: json.dumps(value).encode())))
@example(json.dumps({**OPEN3D, 'intrinsic_matrix': [10 ** 400, 0, 0, 0, 500, 0, 320, 240, 1]}).encode())
def test_calibration(tmp_path_factory, content):
    camera = survives(camera_of, written(tmp_path_factory, 'camera.yaml', content), size=len(content))
    if camera is not None:
        assert np.isfinite(camera.matrix).all() and camera.matrix[0, 0] > 0 and np.isfinite(camera.distortion).all()


@pytest.mark.parametrize('name, contents', [
    ('a.toml', st.one_of(mutated(CALIB_TOML), st.just(b'a = ' + b'[' * 5000))),
    ('a.qca.txt', st.one_of(mutated(QUALISYS), st.just(b'<a>' * 50000))),
    ('a.yaml', texts(KALIBR, OWN_FILE))])
@given(data=st.data())
def test_calibrations_of_other_programs(tmp_path_factory, name, contents, data):
    content = data.draw(contents)
    known = survives(read_known_cameras, [written(tmp_path_factory, name, content)], size=len(content))
    for camera in known.cameras if known is not None else ():
        np.testing.assert_allclose(camera.rotation @ camera.rotation.T, np.eye(3), atol=1e-9)
        assert np.isfinite(camera.translation).all() and calibrated_camera(camera.calibration).matrix[0, 0] > 0


@given(texts(SEQUENCE))
@example(_dumped({**SEQUENCE, 'T_world_camera': [[1, 0, 0, np.inf], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}))
@example(_dumped({None: 15, 'camera': 1}))
def test_sequence(tmp_path_factory, content):
    folder = written(tmp_path_factory, 'sequence.yaml', content).parent
    values, _ = survives(rgbd_folder.read_description, folder, size=len(content)) or ({'T_world_camera': None}, None)
    assert values['T_world_camera'] is None or np.isfinite(values['T_world_camera']).all()


@given(texts(MODEL))
@example(_dumped({**MODEL, 'skeleton': []}))
def test_model_description(tmp_path_factory, content):
    model = survives(read_description, written(tmp_path_factory, 'own.yaml', content), size=len(content),
                     errors=(ModelError,))
    assert model is None or (model.channels > 0 and model.files)


@given(texts(MARKERS))
@example(_dumped({'joints': {'nose': {'markers': ['F1'], 'weights': [2 ** 64]}}}))
def test_marker_map(tmp_path_factory, content):
    read = survives(read_marker_map, written(tmp_path_factory, 'markers.yaml', content), size=len(content))
    if read is not None:
        points = {name: np.ones((3, 3)) for name in read.markers}
        joints = {}
        for joint, rule in read.rules.items():
            joints[joint] = place(rule, points, joints)
            assert joints[joint] is None or joints[joint].shape == (3, 3)


def test_examples_are_right(tmp_path):
    """Else only the first check would be tried."""
    for name, read, value in (('sequence.yaml', lambda path: rgbd_folder.read_description(path.parent), SEQUENCE),
                              ('own.yaml', read_description, MODEL), ('markers.yaml', read_marker_map, MARKERS),
                              ('camera.yaml', camera_of, CAMERA_INFO), ('open3d.yaml', camera_of, OPEN3D),
                              *(('room.yaml', lambda path: read_known_cameras([path]), value)
                                for value in (KALIBR, OWN_FILE))):
        (tmp_path / name).write_bytes(_dumped(value))
        assert read(tmp_path / name) is not None
    for name, content in (('a.toml', CALIB_TOML), ('a.qca.txt', QUALISYS)):
        (tmp_path / name).write_bytes(content)
        assert read_known_cameras([tmp_path / name]).cameras
    assert shipped_maps()


@pytest.mark.parametrize('kind', [ServiceSettings, PeopleSettings])
@given(data=st.data())
def test_parameters(kind, data):
    names = [field.name for field in parameter_fields(kind)]
    values = data.draw(st.dictionaries(st.one_of(st.sampled_from(names), TEXTS), JUNK, max_size=3))
    settings = survives(build, kind, values, size=1000, errors=(ParameterError,))
    if settings is not None:
        assert all(flat_values(settings)[name] == value for name, value in values.items()
                   if isinstance(value, (int, str)) and not isinstance(value, bool))


@given(st.lists(st.one_of(TEXTS, st.tuples(
    st.sampled_from(('--', '-', '--no', '')),
    st.sampled_from(['threads', 'mode', 'tracking', 'alpha_pose', 'scale_gap']),
    st.sampled_from(('', '=')), TEXTS).map(''.join)), max_size=5))
@example(['--threads=' + '9' * 5000])
def test_flags(arguments):
    read = survives(read_flags, ServiceSettings, arguments, size=10000, errors=(ParameterError,))
    if read is not None:
        survives(build, ServiceSettings, read[0], size=10000, errors=(ParameterError, BadInputError))


WANT = json.dumps({'want': {'image': {'camera': 1, 'width': 640, 'rate': 10.0}, 'cloud': True}}).encode()


@given(st.one_of(mutated(WANT), mutated(WANT).map(lambda data: data.decode(errors='replace'))))
@example(b'[' * 4000)
def test_what_a_page_wants(content):
    want = survives(read_want, content, 2, size=len(content), errors=(BadInputError,))
    assert want is None or (want.camera in (0, 1) and want.width in (0, *WIDTHS) and 0 < want.rate <= 15.0)

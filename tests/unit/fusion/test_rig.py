"""Files of rigs: what is written is read again, and what is wrong is named."""
import numpy as np
import pytest

from openpose_ros_fusion.rig import Rig, RigCamera, read_rig, rig_camera, rig_text, write_rig
from openpose_ros_pkg.errors import BadInputError

# x forward of the room is z of the camera, its left is -x, up is -y
LEVEL = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])


def rig():
    return Rig('world', (rig_camera('left', 'left_optical', (LEVEL, np.array([0.0, 1.0, 1.5]))),
                         rig_camera('right', 'right_optical', (LEVEL, np.array([0.25, -1.0, 1.5])), 0.07)))


def test_a_rig_is_read_as_it_was_written(tmp_path):
    write_rig(tmp_path / 'rig.yaml', rig())
    read = read_rig(tmp_path / 'rig.yaml')
    assert read.fixed_frame == 'world' and [camera.name for camera in read.cameras] == ['left', 'right']
    assert rig_text(read) == rig_text(rig())
    with pytest.raises(BadInputError, match="no camera 'top', but left, right"):
        read.camera('top')
    assert read.camera('right').clock_offset == 0.07 and read.camera('left').frame_id == 'left_optical'
    rotation, centre = read.camera('right').pose
    np.testing.assert_allclose(rotation, LEVEL, atol=1e-12)
    np.testing.assert_allclose(rotation @ [0, 0, 2.0] + centre, [2.25, -1, 1.5], atol=1e-12)


@pytest.mark.parametrize('text, told', [
    ('', 'expected fixed_frame: TEXT, cameras: a list'),
    ('fixed_frame: world', 'expected fixed_frame: TEXT'),
    ('{fixed_frame: world, cameras: []}', 'it has no cameras'),
    ('{fixed_frame: world, cameras: 3}', 'cameras: a list'),
    ('{fixed_frame: 3, cameras: [CAMERA]}', 'fixed_frame is 3, expected a text'),
    ('{fixed_frame: world, cameras: [CAMERA], speed: 1}', 'no other key'),
    ('{fixed_frame: world, cameras: [CAMERA, CAMERA]}', "two cameras of the name 'a'"),
    ('{fixed_frame: world, cameras: [{name: a}]}', "'frame_id'"),
    ('{fixed_frame: world, cameras: [CAMERA', 'rig.yaml'),
])
def test_what_is_wrong_is_named(tmp_path, text, told):
    camera = '{name: a, frame_id: a, rotation: [0, 0, 0, 1], translation: [0, 0, 0]}'
    (tmp_path / 'rig.yaml').write_text(text.replace('CAMERA', camera))
    with pytest.raises(BadInputError, match=r'rig\.yaml') as error:
        read_rig(tmp_path / 'rig.yaml')
    assert told in str(error.value)


@pytest.mark.parametrize('wrong', [
    {'name': ''}, {'frame_id': 4}, {'rotation': [0, 0, 0, 2]}, {'rotation': [0, 0, 1]}, {'translation': [0, 0, 'x']},
    {'translation': [0, 0, np.nan]}, {'clock_offset': np.inf}, {'clock_offset': [0.1]}])
def test_wrong_values_of_a_camera(wrong):
    values = {'name': 'a', 'frame_id': 'a', 'rotation': [0, 0, 0, 1], 'translation': [0, 0, 0]}
    RigCamera(**values)
    with pytest.raises(ValueError, match='is no camera of a rig; expected name and frame_id'):
        RigCamera(**{**values, **wrong})

"""Drawings of stages: fields lie over what they are about; the programs write what they say."""
from pathlib import Path

import cv2
import numpy as np
import pytest

from openpose_ros_pkg import show_stages
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN, MOVENET_MULTIPOSE
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from optional_weights import need_weights
from skeleton_extract_3d import show_stages as show_stages_3d
from skeleton_extract_3d.points.camera import CameraModel

SHIPPED = Path(__file__).resolve().parents[3] / 'skeleton_extract_3d' / 'demo' / 'cross'
BLACK = np.zeros((120, 200, 3), np.uint8)


@pytest.fixture()
def standing():
    """A person 3 m before a camera of f = 100 px, from whose depth image the left half is cut away."""
    keypoints = np.full((1, 18, 3), (np.nan, np.nan, 0), np.float32)
    for joint, x, y in (('neck', 100, 40), ('right_shoulder', 94, 40), ('left_shoulder', 106, 40),
                        ('right_hip', 96, 58), ('left_hip', 104, 58), ('right_knee', 96, 72), ('left_knee', 104, 72)):
        keypoints[0, COCO_18.index[joint]] = x, y, 0.9
    depth = np.full((120, 200), 6000, np.uint16)
    depth[30:90, 90:111] = 3000
    depth[:, :99] = 0
    return People2D(COCO_18, keypoints, [0.9], [-1]), depth, CameraModel(200, 120, [100, 0, 100, 0, 100, 60, 0, 0, 1])


def test_stages_in_space(standing):
    people, depth, camera = standing
    titles, images = zip(*show_stages_3d.lift_and_draw(people, BLACK, depth, camera))
    assert titles == ('keypoints on the depth image', 'in front of a person', 'visible joints',
                      'candidate depths of person 0')
    assert {image.shape for image in images} == {BLACK.shape}
    assert not images[0][10, 50].any() and images[0][10, 150].any()  # nothing was measured on the left


def test_a_sheet_has_all_images(tmp_path):
    stages = [('first', np.full((60, 100, 3), 40, np.uint8)), ('so to say', np.full((60, 100, 3), 200, np.uint8))]
    folder = tmp_path / 'new'
    show_stages.write_stages(stages, folder, folder / 'sheet.jpg', 2, False)
    assert sorted(path.name for path in (tmp_path / 'new').iterdir()) == ['1_first.jpg', '2_so_to_say.jpg', 'sheet.jpg']
    sheet = cv2.imread(str(tmp_path / 'new' / 'sheet.jpg'))
    with pytest.raises(ParameterError, match=r'1_first\.jpg is there already; .*--overwrite'):
        show_stages.write_stages(stages, folder, folder / 'other.jpg', 2, False)
    show_stages.write_stages(stages, folder, folder / 'sheet.jpg', 2, True)
    assert sheet.shape[1] == 1260
    assert abs(int(sheet[200, 300].mean()) - 40) < 5 and abs(int(sheet[200, 900].mean()) - 200) < 5


def test_the_shipped_sequence(tmp_path):
    for model in (MOBILENET_THIN, MOVENET_MULTIPOSE):
        need_weights(model)
    arguments = [str(SHIPPED / 'rgb' / '012.jpg'), '--depth', str(SHIPPED / 'depth' / '012.png'), '--camera',
                 str(SHIPPED / 'camera.yaml'), '-o', str(tmp_path),
                 '--set', 'net_input_width=656']  # the networks that have sizes: mobilenet_thin has fields
    assert show_stages_3d.main(arguments) == 0
    assert sorted(path.name for path in tmp_path.rglob('*.jpg')) == [
        '1_input.jpg', '1_keypoints_on_the_depth_image.jpg', '2_heat_maps.jpg', '2_in_front_of_a_person.jpg',
        '3_limb_fields.jpg', '3_visible_joints.jpg', '4_candidate_depths_of_person_0.jpg', '4_candidates.jpg',
        '5_candidate_depths_of_person_1.jpg', '5_opinions.jpg', '6_people.jpg', 'stages_2d.jpg', 'stages_3d.jpg']
    maps = cv2.imread(str(tmp_path / '2_heat_maps.jpg')).max(axis=2)
    # joints shine, and the wall does not: a person stands in the middle
    assert maps[100:500, 430:600].max() > 200 and maps[50:300, 50:100].max() < 150


@pytest.mark.parametrize('arguments, message', [
    (['missing.png', '-o', 'out'], 'missing.png can not be read'),
    (['missing.png', '-o', 'out', '--set', 'mode=slow'], "parameter 'mode' = 'slow' is not allowed"),
])
def test_what_is_wrong_is_said_in_a_line(arguments, message, capsys):
    assert show_stages.main(arguments) == 2
    assert message in capsys.readouterr().err

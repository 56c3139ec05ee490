"""The generated configuration of RViz: its displays, and its viewpoint."""
import numpy as np
import pytest
import yaml

from development import PACKAGES
from openpose_ros_bringup.view import Topics, rviz_configuration, viewpoint
from skeleton_extract_3d.points.transform import TURNED, UPRIGHT

TEMPLATE = yaml.safe_load((PACKAGES['openpose_ros_bringup'] / 'rviz' / 'people.rviz').read_text())
SINGLE = Topics('/left/openpose_ros/skeleton_3d', {'Cloud': '/left/points'}, {'Image': '/left/image'})
LEVEL = (UPRIGHT.T, np.array([0.0, 0.0, 1.4]))
def displays(values, kind):
    return [display for display in values['Visualization Manager']['Displays'] if display['Class'] == f'rviz/{kind}']


def test_the_view_is_where_the_cameras_look_seen_from_the_side_of_the_first():
    for angle in np.radians([0, 100, 190, 300]):
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        focal, yaw = viewpoint([(turn @ LEVEL[0], LEVEL[1])])
        np.testing.assert_allclose(focal, turn @ [2.5, 0, 1.4])
        assert np.dot([np.cos(yaw), np.sin(yaw)], -focal[:2]) > 2
    across = (np.diag([-1.0, -1.0, 1.0]) @ UPRIGHT.T, np.array([5.0, 0, 1.4]))
    np.testing.assert_allclose(viewpoint([LEVEL, across])[0], [2.5, 0, 1.4])


def test_displays_of_a_single_camera():
    values = rviz_configuration(TEMPLATE, 'world', SINGLE, [LEVEL])
    assert [display['Topic'] for display in displays(values, 'PointCloud2')] == ['/left/points']
    assert [display['Image Topic'] for display in displays(values, 'Image')] == ['/left/image']
    markers = {display['Name']: display['Marker Topic'] for display in displays(values, 'Marker')}
    assert markers['Signals'] == '/left/openpose_ros/skeleton_3d/visualization_signals'
    assert {'Joints', 'Skeletons', 'Signals'} <= set(markers)
    assert values['Visualization Manager']['Global Options']['Fixed Frame'] == 'world'
    assert yaml.safe_load(yaml.safe_dump(values)) == values


def test_people_in_the_image_alone():
    topics = Topics('', {}, {'Image': '/image'})
    values = rviz_configuration(TEMPLATE, 'world', topics, [LEVEL])
    assert not displays(values, 'Marker') and not displays(values, 'PointCloud2')
    assert displays(values, 'Image')[0]['Image Topic'] == '/image' and not values['Panels']


@pytest.mark.parametrize('frame, floor', [('world', True), ('base_link', True), (f'optical{TURNED}', False)])
def test_the_grid_is_shown_where_the_frame_has_a_floor(frame, floor):
    values = rviz_configuration(TEMPLATE, frame, SINGLE, [LEVEL])
    assert [display['Enabled'] for display in displays(values, 'Grid')] == [floor]

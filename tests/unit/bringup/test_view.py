"""The generated configuration of RViz: its displays, and a viewpoint from which people fill the view."""
import numpy as np
import pytest
import yaml

from development import PACKAGES
from openpose_ros_bringup.view import Topics, Viewpoint, rviz_configuration, viewpoint
from skeleton_extract_3d.points.transform import TURNED, UPRIGHT

TEMPLATE = yaml.safe_load((PACKAGES['openpose_ros_bringup'] / 'rviz' / 'people.rviz').read_text())
SINGLE = Topics('/left/openpose_ros/skeleton_3d', {'Cloud': '/left/points'}, {'Image': '/left/image'})
LEVEL = (UPRIGHT.T, np.array([0.0, 0.0, 1.4]))
# Tangent of half the angle that RViz sees from top to bottom, and by how much wider the view is than high.
HALF, ASPECT = np.tan(np.radians(22.5)), 1.2


def person(x, y, height=1.75):
    """Return joints of a standing person."""
    return np.array([[x, y, 0.05], [x, y - 0.25, 0.9], [x, y + 0.25, 1.2], [x, y, height]])


def on_screen(view, points):
    """Return where RViz shows points (N, 3): right and up, in halves of the height of the view; and their depth [m].

    As rviz::OrbitViewController places its camera.
    """
    away = np.array([np.cos(view.yaw) * np.cos(view.pitch), np.sin(view.yaw) * np.cos(view.pitch), np.sin(view.pitch)])
    right = np.array([-np.sin(view.yaw), np.cos(view.yaw), 0])
    seen = points - view.focal - view.distance * away
    depth = -seen @ away
    return seen @ right / depth / HALF, seen @ np.cross(away, right) / depth / HALF, depth


def displays(values, kind):
    return [display for display in values['Visualization Manager']['Displays'] if display['Class'] == f'rviz/{kind}']


@pytest.mark.parametrize('people', [[(3.0, 0.0)], [(2.0, 0.5)], [(3, -1), (4, 1), (3.5, 0)], [(6.0, 2.0), (2.5, -0.5)]])
def test_people_are_upright_large_and_in_the_middle(people):
    joints = np.concatenate([person(*place) for place in people])
    right, up, depth = on_screen(viewpoint(joints, [LEVEL]), joints)
    assert (depth > 0.5).all() and np.abs(up).max() < 1 and np.abs(right).max() < ASPECT
    heads, feet = up[3::4], up[0::4]
    assert (heads > feet).all()
    assert max(np.ptp(up), np.ptp(right) / ASPECT) > 0.8  # of 2, the whole view
    assert abs(up.max() + up.min()) < 0.7


def test_people_are_seen_from_the_side_of_the_camera():
    for angle in np.radians([0, 100, 190, 300]):
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        view = viewpoint(person(3, 0) @ turn.T, [(turn @ LEVEL[0], LEVEL[1])])
        assert on_screen(view, LEVEL[1][np.newaxis])[2] < on_screen(view, view.focal[np.newaxis])[2]


def test_without_people_the_view_is_where_the_cameras_look():
    for joints in (np.zeros((0, 3)), np.full((18, 3), np.nan)):
        view = viewpoint(joints, [LEVEL])
        np.testing.assert_allclose(view.focal, [2.5, 0, 1.4])
        assert 2 < view.distance < 5
    across = (np.diag([-1.0, -1.0, 1.0]) @ UPRIGHT.T, np.array([5.0, 0, 1.4]))
    np.testing.assert_allclose(viewpoint(np.zeros((0, 3)), [LEVEL, across]).focal, [2.5, 0, 1.4])


def test_displays_of_a_single_camera():
    values = rviz_configuration(TEMPLATE, 'world', SINGLE, viewpoint(person(3, 0), [LEVEL]))
    assert [display['Topic'] for display in displays(values, 'PointCloud2')] == ['/left/points']
    assert [display['Image Topic'] for display in displays(values, 'Image')] == ['/left/image']
    markers = {display['Name']: display['Marker Topic'] for display in displays(values, 'Marker')}
    assert markers['Signals'] == '/left/openpose_ros/skeleton_3d/visualization_signals'
    assert {'Joints', 'Skeletons', 'Signals'} <= set(markers)
    assert values['Visualization Manager']['Global Options']['Fixed Frame'] == 'world'
    assert yaml.safe_load(yaml.safe_dump(values)) == values


def test_people_in_the_image_alone():
    topics = Topics('', {}, {'Image': '/image'})
    values = rviz_configuration(TEMPLATE, 'world', topics, Viewpoint(np.zeros(3), 3.0, 0.0))
    assert not displays(values, 'Marker') and not displays(values, 'PointCloud2')
    assert displays(values, 'Image')[0]['Image Topic'] == '/image' and not values['Panels']


@pytest.mark.parametrize('frame, floor', [('world', True), ('base_link', True), (f'optical{TURNED}', False)])
def test_the_grid_is_shown_where_the_frame_has_a_floor(frame, floor):
    values = rviz_configuration(TEMPLATE, frame, SINGLE, Viewpoint(np.zeros(3), 3.0, 0.0))
    assert [display['Enabled'] for display in displays(values, 'Grid')] == [floor]

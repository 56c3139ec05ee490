"""What is remembered of people: it begins, moves on, goes to another frame, and is forgotten."""
from dataclasses import fields, replace

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.settings import SmoothingParams
from skeleton_extract_3d.track.tracks import Tracks, frame_change, middle_of_trunk

K = len(COCO_18.joints)
TRUNK = [COCO_18.index[name] for name in ('neck', 'left_shoulder', 'right_shoulder', 'left_hip', 'right_hip')]
QUARTER = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])


def tracks(*ids, stamp=10.0, velocity=(0, 0, 0)):
    """Return tracks of people who stand one metre apart."""
    if not ids:
        return Tracks.none()
    xyz = np.random.default_rng(0).uniform(-0.5, 0.5, (len(ids), K, 3))
    xyz += np.array(ids, float)[:, None, None] * [1, 0, 0] + [0, 0, 3]
    result = Tracks.begun(np.array(ids), stamp, xyz, np.tile([1.0, 0, 0], (len(ids), 1)), np.full(len(ids), 1.7))
    joints, root = (each._replace(velocity=each.velocity + velocity) for each in (result.joints, result.root))
    return replace(result, joints=joints, root=root)


def predicted(those, elapsed):
    return those.predicted(elapsed, SmoothingParams())


def test_no_people():
    none = predicted(tracks(), 1.0).transformed(QUARTER, np.ones(3)).select(np.zeros(0, bool)).in_order()
    assert len(none) == len(none.joined(tracks())) == 0
    assert middle_of_trunk(np.zeros((0, K, 3)), np.zeros((0, K), bool)).shape == (0, 3)


def test_later_ones_come_last():
    three = tracks(4, 7).joined(tracks(9, stamp=11.0))
    assert three.ids.tolist() == [4, 7, 9] and three.born.tolist() == [10, 10, 11]
    np.testing.assert_allclose(three.joints.position[2].mean(axis=0), (9, 0, 3), atol=0.5)
    mixed = tracks(9).joined(tracks(4, 7))
    assert mixed.in_order().ids.tolist() == [4, 7, 9]
    np.testing.assert_array_equal(mixed.in_order().joints.position, mixed.joints.position[[1, 2, 0]])


def test_rows_of_all_arrays_are_selected():
    two = tracks(1, 2, 3).select(np.array([True, False, True]))
    assert two.ids.tolist() == [1, 3]
    for field in fields(two):
        value = getattr(two, field.name)
        for array in (value if isinstance(value, tuple) else [value]):
            assert len(array) == 2, field.name
    assert len(two.select(np.zeros(2, bool))) == 0


def test_in_another_frame_people_and_their_directions_turn():
    x, y, z = np.moveaxis(tracks(1).joints.position, -1, 0)
    one = tracks(1).transformed(QUARTER, np.array([0, 0, 1.0]))
    np.testing.assert_allclose(one.joints.position, np.stack([z, y, 1 - x], axis=-1))
    np.testing.assert_allclose(one.root.position[:, 0], one.joints.position[:, TRUNK].mean(axis=1))
    np.testing.assert_allclose(one.left, [[0, 0, -1]])
    np.testing.assert_allclose(one.down, [[0, 1, 0]])


def test_what_stands_still_in_the_room_is_where_the_moved_camera_sees_it():
    angle = 0.4
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    before, now = (QUARTER, np.array([1.0, 0, 2])), (turn @ QUARTER, np.array([1.5, 0.1, 1.8]))
    point = np.array([0.3, -0.2, 2.5])
    in_room = before[0] @ point + before[1]
    rotation, translation = frame_change(before, now)
    np.testing.assert_allclose(now[0] @ (rotation @ point + translation) + now[1], in_room)

"""What is remembered of people: it begins, moves on, goes to another frame, and is forgotten."""
from dataclasses import fields, replace

import numpy as np
import pytest

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


def test_nobody():
    nobody = predicted(tracks(), 1.0).transformed(QUARTER, np.ones(3)).select(np.zeros(0, bool)).in_order()
    assert len(nobody) == len(nobody.joined(tracks())) == 0
    assert middle_of_trunk(np.zeros((0, K, 3)), np.zeros((0, K), bool)).shape == (0, 3)


def test_newcomers_have_joints_where_they_were_seen_but_nothing_was_learnt():
    both = tracks(4, 7)
    assert len(both) == 2 and both.ids.tolist() == [4, 7]
    assert both.joints.position.shape == (2, K, 3) and both.root.position.shape == (2, 1, 3)
    assert (both.born == 10).all() and (both.last_seen == 10).all() and not both.sightings.any()
    assert not both.has.any(), 'placed are only those that the first frame is taken in with'
    assert not both.sizes.bone_weights.any() and not both.sizes.stature_weight.any()
    assert not both.clothes.weights.any()
    np.testing.assert_allclose(both.root.position[:, 0], both.joints.position[:, TRUNK].mean(axis=1))


def test_joints_without_a_keypoint_do_not_tell_where_the_trunk_is():
    xyz = np.random.default_rng(0).uniform(-0.5, 0.5, (1, K, 3))
    xyz[0, TRUNK[1:]] = np.nan
    one = Tracks.begun(np.array([1]), 0.0, xyz, np.array([[1.0, 0, 0]]), np.array([1.7]))
    np.testing.assert_array_equal(one.root.position[0, 0], xyz[0, TRUNK[0]])
    assert np.isfinite(one.joints.position).all()


def test_later_ones_come_last():
    three = tracks(4, 7).joined(tracks(9, stamp=11.0))
    assert three.ids.tolist() == [4, 7, 9] and three.born.tolist() == [10, 10, 11]
    np.testing.assert_allclose(three.joints.position[2].mean(axis=0), (9, 0, 3), atol=0.5)
    mixed = tracks(9).joined(tracks(4, 7))
    assert mixed.in_order().ids.tolist() == [4, 7, 9]
    np.testing.assert_array_equal(mixed.in_order().joints.position, mixed.joints.position[[1, 2, 0]])


def test_all_that_belongs_to_somebody_is_forgotten():
    two = tracks(1, 2, 3).select(np.array([True, False, True]))
    assert two.ids.tolist() == [1, 3]
    for field in fields(two):
        value = getattr(two, field.name)
        for array in (value if isinstance(value, tuple) else [value]):
            assert len(array) == 2, field.name
    assert len(two.kept(np.zeros(2, bool))) == 0 and two.kept(np.ones(2, bool)) is two


def test_everybody_moves_on_and_hands_become_less_certain_than_hips():
    one = tracks(1, velocity=(1, 0, 0))
    after = predicted(one, 0.5)
    np.testing.assert_allclose(after.joints.position - one.joints.position, np.full((1, K, 3), (0.5, 0, 0)))
    np.testing.assert_allclose(after.root.position - one.root.position, [[[0.5, 0, 0]]])
    sigma = dict(zip(COCO_18.joints, after.joints.sigmas()[0]))
    assert sigma['left_wrist'] > sigma['left_elbow'] > sigma['left_hip'] == sigma['neck']


@pytest.mark.parametrize('elapsed', [0.0, -0.1])
def test_time_that_does_not_pass_changes_nothing(elapsed):
    one = tracks(1, velocity=(1, 1, 1))
    after = predicted(one, elapsed)
    np.testing.assert_array_equal(after.joints.position, one.joints.position)
    np.testing.assert_array_equal(after.joints.sigmas(), one.joints.sigmas())


def test_in_another_frame_people_and_their_directions_turn():
    x, y, z = np.moveaxis(tracks(1).joints.position, -1, 0)
    one = tracks(1).transformed(QUARTER, np.array([0, 0, 1.0]))
    np.testing.assert_allclose(one.joints.position, np.stack([z, y, 1 - x], axis=-1))
    np.testing.assert_allclose(one.root.position[:, 0], one.joints.position[:, TRUNK].mean(axis=1))
    np.testing.assert_allclose(one.left, [[0, 0, -1]])
    np.testing.assert_allclose(one.down, [[0, 1, 0]])


def test_the_middle_is_that_of_the_known_joints_of_the_trunk():
    xyz, known = np.random.default_rng(1).normal(size=(1, K, 3)), np.zeros((1, K), bool)
    known[0, [TRUNK[1], TRUNK[4], 0]] = True
    xyz[~known] = np.nan
    np.testing.assert_allclose(middle_of_trunk(xyz, known)[0], xyz[0, [TRUNK[1], TRUNK[4]]].mean(axis=0))


def test_without_a_trunk_the_middle_is_that_of_all_known_joints():
    xyz, known = np.random.default_rng(1).normal(size=(1, K, 3)), np.zeros((1, K), bool)
    known[0, [0, 4, 10]] = True
    np.testing.assert_allclose(middle_of_trunk(xyz, known)[0], xyz[0, [0, 4, 10]].mean(axis=0))


def test_a_camera_that_stands_still_changes_nothing():
    pose = QUARTER, np.array([1.0, 2, 3])
    rotation, translation = frame_change(pose, pose)
    np.testing.assert_allclose(rotation, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(translation, 0, atol=1e-12)


def test_what_stands_still_in_the_room_is_where_the_moved_camera_sees_it():
    angle = 0.4
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    before, now = (QUARTER, np.array([1.0, 0, 2])), (turn @ QUARTER, np.array([1.5, 0.1, 1.8]))
    point = np.array([0.3, -0.2, 2.5])
    in_room = before[0] @ point + before[1]
    rotation, translation = frame_change(before, now)
    np.testing.assert_allclose(now[0] @ (rotation @ point + translation) + now[1], in_room)

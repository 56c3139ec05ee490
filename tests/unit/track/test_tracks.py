"""What is remembered of people: it begins, moves on, goes to another frame, and is forgotten."""
import numpy as np
import pytest

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.track.tracks import Tracks, frame_change, middle_of_trunk

K = len(COCO_18.joints)
TRUNK = [COCO_18.index[name] for name in ('neck', 'left_shoulder', 'right_shoulder', 'left_hip', 'right_hip')]
QUARTER = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])


def tracks(*ids, stamp=10.0):
    """Return tracks of people who stand one metre apart."""
    result = Tracks()
    if ids:
        add(result, ids, stamp)
    return result


def add(result, ids, stamp):
    xyz = np.random.default_rng(0).uniform(-0.5, 0.5, (len(ids), K, 3))
    xyz += np.array(ids, float)[:, None, None] * [1, 0, 0] + [0, 0, 3]
    result.append(np.array(ids), stamp, xyz, np.ones((len(ids), K), bool), np.tile([1.0, 0, 0], (len(ids), 1)),
                  np.full(len(ids), 1.7))


def test_nobody():
    nobody = tracks()
    nobody.predict(1.0, 4.0, 3.0)
    nobody.transform(QUARTER, np.ones(3))
    nobody.keep(np.zeros(0, bool))
    assert len(nobody) == 0
    assert middle_of_trunk(np.zeros((0, K, 3)), np.zeros((0, K), bool)).shape == (0, 3)


def test_newcomers_have_joints_where_they_were_seen_but_nothing_was_learnt():
    both = tracks(4, 7)
    assert len(both) == 2 and both.ids.tolist() == [4, 7]
    assert both.joints.position.shape == (2, K, 3) and both.root.position.shape == (2, 1, 3)
    assert (both.born == 10).all() and (both.last_seen == 10).all() and not both.sightings.any()
    assert not both.has.any(), 'placed are only those that the first frame is taken in with'
    assert not both.bone_weights.any() and not both.stature_weight.any() and not both.clothes_weight.any()
    np.testing.assert_allclose(both.root.position[:, 0], both.joints.position[:, TRUNK].mean(axis=1))


def test_later_ones_come_last():
    three = tracks(4, 7)
    add(three, [9], 11.0)
    assert three.ids.tolist() == [4, 7, 9] and three.born.tolist() == [10, 10, 11]
    np.testing.assert_allclose(three.joints.position[2].mean(axis=0), (9, 0, 3), atol=0.5)


def test_all_that_belongs_to_somebody_is_forgotten():
    three = tracks(1, 2, 3)
    three.keep(np.array([True, False, True]))
    assert three.ids.tolist() == [1, 3]
    lengths = {name: len(value) for name, value in vars(three).items() if isinstance(value, np.ndarray)}
    assert set(lengths.values()) == {2}, lengths
    assert len(three.joints.position) == len(three.root.position) == 2
    three.keep(np.zeros(2, bool))
    assert len(three) == 0


def test_everybody_moves_on_and_hands_become_less_certain_than_hips():
    one = tracks(1)
    before = one.joints.position.copy()
    one.joints.velocity[:], one.root.velocity[:] = (1, 0, 0), (1, 0, 0)
    root = one.root.position.copy()
    one.predict(0.5, 4.0, 3.0)
    np.testing.assert_allclose(one.joints.position - before, np.broadcast_to([0.5, 0, 0], before.shape))
    np.testing.assert_allclose(one.root.position - root, [[[0.5, 0, 0]]])
    sigma = dict(zip(COCO_18.joints, one.joints.sigmas()[0]))
    assert sigma['left_wrist'] > sigma['left_elbow'] > sigma['left_hip'] == sigma['neck']


@pytest.mark.parametrize('elapsed', [0.0, -0.1])
def test_time_that_does_not_pass_changes_nothing(elapsed):
    one = tracks(1)
    one.joints.velocity[:] = 1
    before, sigmas = one.joints.position.copy(), one.joints.sigmas()
    one.predict(elapsed, 4.0, 3.0)
    np.testing.assert_array_equal(one.joints.position, before)
    np.testing.assert_array_equal(one.joints.sigmas(), sigmas)


def test_in_another_frame_people_and_their_directions_turn():
    one = tracks(1)
    x, y, z = np.moveaxis(one.joints.position.copy(), -1, 0)
    one.transform(QUARTER, np.array([0, 0, 1.0]))
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

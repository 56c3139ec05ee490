"""Joint assignment: keypoints of people who touch go to the people who are tracked there."""
import numpy as np
import pytest

from openpose_ros_pkg.detect.joint_assignment import Tracked, share_out
from openpose_ros_pkg.people import ExpectedPeople
from openpose_ros_pkg.skeletons import COCO_18
from stand_in_networks import person_at

SIZE = (640, 480)
LEGS = np.array([joint.split('_')[-1] in ('hip', 'knee', 'ankle') for joint in COCO_18.joints])


def person(x, score=0.9):
    """Return a person who stands at a column of the image, (18, 3)."""
    return np.insert(person_at(x, 100, 300), 2, score, axis=1).astype(np.float32)


def expected(*poses, depths=None):
    keypoints = np.array(poses, np.float32).reshape(-1, 18, 3)
    return ExpectedPeople(COCO_18, keypoints, np.ones(len(poses)), np.arange(len(poses)),
                          depths=np.full(len(poses), 2.0) if depths is None else np.array(depths))


def tracked(*poses):
    return Tracked.within(expected(*poses), COCO_18, SIZE)


@pytest.mark.parametrize('known', [None, expected()])
def test_without_tracks_all_people_are_as_they_are(known):
    pose = person(300)
    shared = share_out([{0: pose}], [pose], Tracked.within(known, COCO_18, SIZE))
    assert not len(shared.missing) and len(shared.poses) == 1
    np.testing.assert_array_equal(shared.opinions[0][0], pose)


def test_no_person_is_reported_and_one_is_tracked():
    shared = share_out([], [], tracked(person(300)))
    assert shared.missing.tolist() == [0] and shared.opinions == [{}]
    np.testing.assert_allclose(shared.poses[0], person(300))


def test_people_who_are_all_reported_keep_their_keypoints():
    poses = [person(280), person(330)]
    shared = share_out([{0: pose} for pose in poses], poses, tracked(person(330), person(280)))
    assert not len(shared.missing)
    for pose, opinions, place in zip(poses, shared.opinions, shared.poses):
        np.testing.assert_array_equal(opinions[0], pose)
        np.testing.assert_array_equal(place, pose)


def test_the_legs_of_another_person_go_to_that_person():
    here, there = person(280), person(330)
    mixed = np.where(LEGS[:, None], there, here)
    shared = share_out([{0: mixed, 1: here}], [mixed], tracked(here, there))
    assert shared.missing.tolist() == [1]
    first, second = shared.opinions
    np.testing.assert_array_equal(np.isfinite(first[0][:, 0]), ~LEGS)
    np.testing.assert_array_equal(first[1], here)
    assert list(second) == [0]
    np.testing.assert_array_equal(np.isfinite(second[0][:, 0]), LEGS)
    np.testing.assert_allclose(shared.poses[0][:, :2], here[:, :2])
    np.testing.assert_allclose(shared.poses[1][:, :2], there[:, :2])


def test_a_missing_person_gets_keypoints_of_both_neighbours():
    left, there, right = person(220), person(300), person(380)
    head = np.arange(18) < 2
    poses = [np.where(LEGS[:, None], there, left), np.where(head[:, None], there, right)]
    shared = share_out([{0: pose} for pose in poses], poses, tracked(left, there, right))
    assert shared.missing.tolist() == [1]
    gained = shared.opinions[2][0]
    np.testing.assert_array_equal(np.isfinite(gained[:, 0]), LEGS | head)
    np.testing.assert_allclose(gained[LEGS | head], there[LEGS | head])


def test_a_keypoint_near_its_own_place_stays_though_another_person_is_nearer():
    here, there = person(300), person(304)
    pose = person(303)
    shared = share_out([{0: pose}], [pose], tracked(here, there))
    of_here = shared.opinions[0][0]
    assert len(shared.missing) == 1 and np.isfinite(of_here[:, 0]).all()


def test_people_outside_the_image_are_not_missing():
    assert not len(tracked(person(-200)).poses) and len(tracked(person(300), person(900)).poses) == 1

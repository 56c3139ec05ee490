"""Left and right of people whose network exchanges them."""
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from estimating import new_estimator, update
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.points.depth import DepthImage
from synthetic_scene import Person, Pose, Room, pinhole, pointing, render, standing

CAMERA = pinhole(320, 180)
INDEX, SWAP = COCO_18.index, list(COCO_18.swap)
LEFT, RIGHT = ([INDEX[f'{side}_{joint}'] for joint in ('shoulder', 'hip')] for side in ('left', 'right'))
HEAD = [INDEX[name] for name in ('nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear')]


@lru_cache(maxsize=None)
def scene(yaw=0.0, reaching=False):
    pose = standing(20)
    if reaching:
        arms = np.stack([pointing(75, 5, side) for side in (-1, 1)])
        pose = Pose(arms, arms, pose.thighs, pose.shins)
    return render(CAMERA, [Person(1, 0.0, 2.6, pose, yaw)], Room(wall=4.5))


def detected(frame, exchanged=False, face=0.4):
    """Return the people of a frame, with left and right exchanged or not, and a score of the head's joints."""
    keypoints = frame.people.keypoints[:, SWAP if exchanged else slice(None)].copy()
    keypoints[:, HEAD, 2] *= face
    return replace(frame.people, keypoints=keypoints)


def is_right(estimate, frame):
    """Return whether shoulders and hips are where they truly are, rather than the other way round."""
    xyz, true = estimate.people.xyz[0].astype(float), frame.xyz[0]
    as_is = np.linalg.norm(xyz[LEFT + RIGHT] - true[LEFT + RIGHT], axis=1).mean()
    return as_is < np.linalg.norm(xyz[RIGHT + LEFT] - true[LEFT + RIGHT], axis=1).mean()


def seconds_held(rate, face=0.4, before=1.0):
    """Return how long a person keeps left and right whose network exchanges them after a time [s], at a rate [Hz]."""
    estimator, frame = new_estimator(), scene()
    count = round(before * rate)
    for number in range(count):
        assert is_right(update(estimator, frame, 1 + number / rate, detected(frame)), frame)
    for number in range(count, count + round(2 * rate)):
        if not is_right(update(estimator, frame, 1 + number / rate, detected(frame, True, face)), frame):
            return (number - count) / rate
    return 2.0


@pytest.mark.parametrize('rate', [30.0, 15.0, 7.5])
def test_sides_are_kept_for_half_a_second_at_any_rate(rate):
    assert seconds_held(rate) == pytest.approx(0.5, abs=3 / rate)


def test_a_face_that_is_seen_is_believed_sooner():
    assert seconds_held(15.0, face=0.9) < 0.2


def test_sides_that_were_seen_for_a_short_time_are_kept_for_no_longer():
    assert seconds_held(15.0, before=0.2) <= 0.4


def test_a_person_who_turns_round_is_followed():
    """Half a turn takes 0.5 s; the filter may be a frame late where the body is seen from the side."""
    estimator, wrong = new_estimator(), 0
    for number in range(24):
        frame = scene(float(np.clip((number - 8) / 7.5, 0, 1)) * np.pi)
        wrong += not is_right(update(estimator, frame, 1 + number / 15, detected(frame)), frame)
    assert wrong <= 1


def test_hands_before_a_person_tell_where_it_faces():
    """No arm reaches so far backwards; arms that hang tell nothing."""
    frame = scene(reaching=True)
    for rate in (30.0, 15.0, 7.5):
        estimator = new_estimator()
        assert all(is_right(update(estimator, frame, 1 + number / rate, detected(frame, True)), frame)
                   for number in range(20))
    hanging = scene()
    assert not is_right(update(new_estimator(), hanging, 1.0, detected(hanging, True)), hanging)


def test_a_back_that_is_seen_stays_one():
    for frame in (scene(np.pi), scene(np.pi, reaching=True)):
        assert is_right(update(new_estimator(), frame, 1.0, detected(frame)), frame)


def test_the_keypoints_are_exchanged_as_well():
    frame = scene(reaching=True)
    people = update(new_estimator(), frame, 1.0, detected(frame, True)).people_2d
    np.testing.assert_allclose(people.xy, frame.people.xy)
    seen = observe(frame.people, frame.size, DepthImage(frame.depth, CAMERA), CAMERA)
    once = seen.exchanged(np.array([True]))
    np.testing.assert_array_equal(once.uv[:, SWAP], seen.uv)
    np.testing.assert_array_equal(once.people_2d.xy, seen.people_2d.xy[:, SWAP])
    np.testing.assert_array_equal(once.exchanged(np.array([True])).samples, seen.samples)
    np.testing.assert_array_equal(seen.exchanged(np.array([False])).rays, seen.rays)

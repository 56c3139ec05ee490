"""Tracks that are not looked at are registered with the points of a frame, for a short time."""

import numpy as np

from estimating import new_estimator, update
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.people import MEASURED
from synthetic_scene import VISIBLE, Person, Room, pinhole, render, standing

CAMERA, RATE, LOOKS = pinhole(480, 270), 16.0, 6
NO_PEOPLE = People2D.empty(COCO_18)
LONGEST = METHOD.registration.longest


def frame_at(x=None):
    people = [] if x is None else [Person(1, x, 2.5, standing(25))]
    return render(CAMERA, people, Room())


def stopping(number):
    """Return x of a person who walks to the side, and stands still from the last look on [m]."""
    return -0.5 + 1.2 * min(number, LOOKS - 1) / RATE


def followed(number):
    """Return the estimator after some looks, and its estimate."""
    estimator = new_estimator()
    for i in range(number):
        frame = frame_at(stopping(i))
        estimate = update(estimator, frame, 1 + i / RATE, frame.people)
    return estimator, estimate


def error(people, frame):
    """Return the root mean square error of the visible joints of the one person [m]."""
    apart = np.linalg.norm(people.xyz[0] - frame.xyz[0], axis=1)[frame.vis[0] == VISIBLE]
    return np.sqrt((apart ** 2).mean())


def unlooked(estimator, frame, number):
    """Return the estimate of a frame in which no network looks at the person."""
    return update(estimator, frame, 1 + number / RATE, NO_PEOPLE, missed=())


def test_the_points_tell_that_a_person_stopped():
    estimator, before = followed(LOOKS)
    frame = frame_at(stopping(LOOKS))
    for i in range(4):
        found = unlooked(estimator, frame, LOOKS + i)
        assert found.people_2d.ids.tolist() == before.people_2d.ids.tolist() and not found.people_2d.looked.any()
        assert error(found.people, frame) < 0.04  # extrapolation alone: 80 mm per frame
    hidden = before.people.status[0] != MEASURED
    assert not (found.people.status[0, hidden] == MEASURED).any()
    inside = found.people_2d.present[0] & (frame.vis[0] == VISIBLE)
    assert np.linalg.norm(found.people_2d.xy[0] - frame.people.xy[0], axis=1)[inside].max() < 0.06 / 2.5 * 270


def test_the_body_of_a_person_in_free_view_whom_a_network_does_not_see_is_not_that_person():
    estimator, _ = followed(LOOKS)
    assert len(update(estimator, frame_at(stopping(LOOKS)), 1 + LOOKS / RATE, NO_PEOPLE).people_2d) == 0


def test_a_person_who_is_gone_is_not_found_by_the_points():
    estimator, _ = followed(LOOKS)
    assert len(unlooked(estimator, frame_at(), LOOKS).people_2d) == 0


def test_without_a_look_a_person_is_found_for_a_short_time():
    estimator, _ = followed(LOOKS)
    frame, last = frame_at(stopping(LOOKS)), LOOKS - 1
    frames = range(LOOKS, LOOKS + int(LONGEST * RATE) + 2)
    there = [len(unlooked(estimator, frame, i).people_2d) for i in frames]
    assert there == [int((i - last) / RATE <= LONGEST) for i in frames]

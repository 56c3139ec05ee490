"""People who come back within some seconds keep the id; others get a new one. One story per id."""
from functools import lru_cache

import numpy as np
import pytest

from estimating import new_estimator, update
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from synthetic_scene import Person, Room, pinhole, render, standing

# shirt and trousers, BGR
RED, BLUE = ((40, 40, 180), (40, 40, 40)), ((170, 70, 30), (90, 90, 90))
FPS = 10.0
LEFT, RIGHT = (-0.9, 2.6), (0.9, 2.8)
UPPER_ARMS = [i for i, joint in enumerate(COCO_18.joints) if joint.split('_')[-1] in ('neck', 'shoulder', 'elbow')]
WITHOUT_HIPS = [i for i, joint in enumerate(COCO_18.joints) if 'hip' not in joint]


@lru_cache(maxsize=None)
def scene(*people):
    """Return people, (place, clothes) each; place: x, z [m] and the scale of a body that is no adult's."""
    return render(pinhole(320, 180), [
        Person(i, *place[:2], standing(), scale=place[2] if len(place) > 2 else 1.0, shirt=shirt, trousers=trousers)
        for i, (place, (shirt, trousers)) in enumerate(people)], Room(wall=6.0))


class Story:
    """A camera that sees who comes and goes."""

    def __init__(self, **params):
        self.estimator = new_estimator(**params)
        self.stamp = 100.0
        self.pose = None

    def sees(self, *people, seconds=0.5, joints=slice(None)):
        """See people, (place, clothes) each, for some time; return the ids of those with one."""
        frame = scene(*people)
        keypoints, hidden = frame.people.keypoints.copy(), np.ones(len(COCO_18.joints), bool)
        hidden[joints] = False
        keypoints[:, hidden] = (np.nan, np.nan, 0)
        ids = []
        for _ in range(round(seconds * FPS)):
            self.stamp += 1 / FPS
            found = People2D(COCO_18, keypoints, frame.people.scores, np.full(len(keypoints), -1))
            answer = update(self.estimator, frame, self.stamp, found, tracking_from_points=self.pose)
            ids.append(answer.people_2d.ids.tolist())
        return ids[-1]

    def sees_no_person_for(self, seconds):
        assert self.sees(seconds=seconds) == []


def test_a_person_who_leaves_and_comes_back_keeps_the_id():
    story = Story()
    assert story.sees((LEFT, RED)) == [1]
    story.sees_no_person_for(4.0)
    assert story.sees((LEFT, RED)) == [1]
    story.sees_no_person_for(8.0)
    assert story.sees((LEFT, RED)) == [1]
    story.sees_no_person_for(1.5)
    assert story.sees((RIGHT, RED)) == [1]


def test_a_person_in_other_clothes_is_another_person_and_the_first_one_may_still_come_back():
    story = Story()
    assert story.sees((LEFT, RED)) == [1]
    story.sees_no_person_for(3.0)
    assert story.sees((LEFT, BLUE)) == [2]
    assert story.sees((LEFT, BLUE), (RIGHT, RED)) == [2, 1]


def test_a_child_in_the_same_clothes_is_another_person():
    story = Story()
    assert story.sees((LEFT, RED), seconds=1.0) == [1]
    story.sees_no_person_for(3.0)
    assert story.sees(((-0.9, 2.6, 0.6), RED)) == [2]


@pytest.mark.parametrize('params, away', [({}, 10.5), ({'return_timeout': 3.0}, 3.5), ({'use_clothes': False}, 3.0)])
def test_after_the_timeout_or_without_colours_a_person_who_was_away_is_new(params, away):
    story = Story(**params)
    assert story.sees((LEFT, RED)) == [1]
    story.sees_no_person_for(away)
    assert story.sees((LEFT, RED)) == [2]


def test_of_two_in_the_same_clothes_no_person_is_guessed():
    story = Story()
    assert story.sees(((-0.3, 2.6), RED), ((0.4, 2.6), RED)) == [1, 2]
    story.sees_no_person_for(4.0)
    assert story.sees(((0.05, 2.6), RED)) == [3]


@pytest.mark.parametrize('away, expected', [(0.3, [2]), (4.0, [1])])
def test_a_person_does_not_jump_to_another_place(away, expected):
    story = Story()
    assert story.sees(((-1.1, 2.6), RED)) == [1]
    story.sees_no_person_for(away)
    assert story.sees(((1.4, 4.2), RED)) == expected


def test_a_person_of_whom_little_is_in_view_waits_a_moment_for_the_id():
    story = Story()
    assert story.sees((LEFT, RED)) == [1]
    story.sees_no_person_for(3.0)
    assert story.sees((LEFT, RED), seconds=METHOD.track.identity.gap / 2, joints=UPPER_ARMS) == []
    assert story.sees((LEFT, RED), seconds=0.2) == [1]
    story.sees_no_person_for(3.0)
    assert story.sees((LEFT, RED), seconds=METHOD.track.identity.gap + 0.3, joints=UPPER_ARMS) == [2]


def test_a_person_in_plain_view_whose_clothes_are_not_gets_an_id_at_once():
    story = Story()
    assert story.sees((LEFT, RED)) == [1]
    story.sees_no_person_for(3.0)
    assert story.sees((LEFT, RED), seconds=METHOD.track.identity.gap / 2, joints=WITHOUT_HIPS) == [2]


def test_where_a_person_left_stays_where_it_is_in_the_room_when_the_camera_moves():
    def turned(x):
        return np.eye(3), np.array([x, 0.0, 0.0])
    story = Story()
    story.pose = turned(0.0)
    assert story.sees((LEFT, RED)) == [1]
    story.sees_no_person_for(2.5)
    gone = story.estimator._tracker.memory.gone.root.position[0, 0]
    story.pose = turned(1.0)
    story.sees_no_person_for(0.1)
    assert story.estimator._tracker.memory.gone.root.position[0, 0] == pytest.approx(gone - (1.0, 0.0, 0.0), abs=1e-6)

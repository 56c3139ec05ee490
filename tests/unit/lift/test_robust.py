"""Whole people, single frames: every joint where it is, measured where it is seen."""
from functools import lru_cache

import numpy as np

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.lift.records import Expectation
from skeleton_extract_3d.lift.robust import RobustLifting
from skeleton_extract_3d.points.depth import DepthImage
from synthetic_scene import Box, Person, Room, pinhole, render, standing, walking

INDEX = COCO_18.index
CAMERA = pinhole(480, 270)
WALL = Room(wall=4.5)
COUNTER = Room(wall=4.5, furniture=(Box((-1.5, 0.4, 1.6), (1.5, 1.2, 2.0)),))


POSES = {'standing': standing(), 'arms out': standing(40), 'walking': walking(1.2)}


def scene(*people, room=WALL):
    return render(CAMERA, people, room)


@lru_cache(maxsize=None)
def one(pose='standing', room=WALL, **values):
    """Return a picture of one person."""
    return scene(Person(1, 0.1, 2.6, POSES[pose], **values), room=room)


def lifted(frame, expected=None, people=None, depth=None):
    people = frame.people if people is None else people
    points = DepthImage(frame.depth if depth is None else depth, frame.camera)
    seen = observe(people, frame.size, points, frame.camera)
    return RobustLifting().lift(seen, points, expected or Expectation.of_strangers(len(people)))


def errors(people, frame):
    return np.linalg.norm(people.xyz - frame.xyz, axis=2)


def test_no_people():
    none = lifted(one(), people=People2D.empty(COCO_18))
    assert none.xyz.shape == (0, 18, 3) and none.measured.shape == (0, 18)
    assert none.left.shape == (0, 3) and none.root.shape == none.stature.shape == (0,)


def test_a_keypoint_on_another_part_of_the_body_is_not_measured():
    # there is the person's own surface, but no forearm reaches there
    frame = one()
    keypoints = frame.people.keypoints.copy()
    keypoints[0, INDEX['left_wrist']] = keypoints[0, INDEX['right_knee']]
    people = lifted(frame, people=People2D(COCO_18, keypoints, [1], [-1]))
    assert not people.plausible[0, INDEX['left_wrist']] and not people.measured[0, INDEX['left_wrist']]
    assert people.measured[0, INDEX['right_knee']]

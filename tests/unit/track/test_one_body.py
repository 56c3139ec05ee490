"""Two bodies cannot be in one place."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import CameraFrame
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.track.completion import Completion
from skeleton_extract_3d.track.sightings import separate
from skeleton_extract_3d.track.tracks import Tracks
from synthetic_scene import Person, Room, pinhole, render, standing

LONGEST = METHOD.track.one_body.longest
SWAP = list(COCO_18.swap)
FRAME = render(pinhole(320, 180), [Person(0, 0.0, 2.6, standing())], Room(wall=6.0))


class Everybody:
    """The people of a frame, of whom only the number counts here."""

    def __init__(self, indices):
        self.indices = np.asarray(indices)

    def select(self, kept):
        return Everybody(self.indices[kept])


def left(bodies, alone, stamp, placed=None):
    """Return who of bodies, (18, 3) each, the first followed for longest, is left; and since when they were alone."""
    xyz = np.array(bodies).reshape(-1, 18, 3)
    placed = np.ones(xyz.shape[:2], bool) if placed is None else placed
    count = len(xyz)
    tracks = Tracks.begun(np.arange(count), 0.0, xyz, np.tile([1.0, 0, 0], (count, 1)), np.full(count, 1.75))
    tracks = replace(tracks, alone=np.array(alone, float), born=np.arange(count, dtype=float))
    seen, people = separate(Completion(tracks, placed, placed, np.zeros(placed.shape)), Everybody(range(count)), stamp)
    assert len(seen.tracks) == len(seen.trusted) == len(seen.placed) == len(seen.sigma) == len(people.indices)
    assert seen.tracks.ids.tolist() == people.indices.tolist()
    return people.indices.tolist(), seen.tracks.alone.tolist()


def body(x=0.0):
    return FRAME.xyz[0] + np.array([x, 0, 0])


def test_nobody_and_somebody_alone():
    assert left([], [], 10.0) == ([], [])
    assert left([body()], [9.9], 10.0) == ([0], [10.0])


@pytest.mark.parametrize('other', [body(0.1), body(0.1)[SWAP]], ids=['copy', 'left and right exchanged'])
def test_who_is_in_the_place_of_somebody_for_too_long_goes(other):
    stays, alone = left([body(), other], [9.9, 9.9], 10.0)
    assert stays == [0, 1] and alone == [10.0, 9.9]
    assert left([body(), other], [9.9, 10.01 - LONGEST], 10.0)[0] == [0, 1]
    assert left([body(), other], [9.9, 9.99 - LONGEST], 10.0)[0] == [0]


def test_newcomers_in_the_place_of_somebody_go_at_once():
    assert left([body(), body(0.1), body(1.0)], [9.9, -np.inf, -np.inf], 10.0) == ([0, 2], [10.0, 10.0])


def test_people_who_touch_are_two():
    """Back to back, or in an embrace, trunks are their thickness apart."""
    assert left([body(), body() + np.array([0, 0, 0.25])], [0.0, 0.0], 10.0)[0] == [0, 1]


def test_halves_are_compared_by_the_joints_that_were_inferred():
    placed = np.ones((2, 18), bool)
    placed[1, 4:] = False
    assert left([body(), body(0.05)], [0.0, 0.0], 10.0, placed)[0] == [0]
    placed[1, METHOD.track.one_body.least_joints - 1:] = False
    assert left([body(), body(0.05)], [0.0, 0.0], 10.0, placed)[0] == [0, 1]


def test_who_was_taken_for_somebody_who_goes_is_no_reason_to_go():
    """Of three in a row the middle one goes, and the third is alone."""
    assert left([body(), body(0.12), body(0.24)], [0.0, 0.0, 0.0], 10.0)[0] == [0, 2]


def test_a_copy_with_left_and_right_exchanged_is_one_person():
    """A network that finds somebody a second time, as from behind."""
    estimator = PeopleEstimator(build(EstimatorSettings, {}))
    copy = FRAME.people.keypoints[:, SWAP].copy()
    copy[..., :2] += 1.5
    twice = People2D(COCO_18, np.concatenate([FRAME.people.keypoints, copy]), [1, 0.9], [-1, -1])
    for i in range(10):
        people = estimator.update(FRAME.people if i < 3 else twice, CameraFrame(
            FRAME.size, DepthImage(FRAME.depth, FRAME.camera), i / 15)).people
        assert people.ids.tolist() == [1]

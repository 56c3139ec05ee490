"""Who is who: keypoints of known people are given to tracks of known people."""
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from estimating import tracks_of
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.settings import IdentityParams
from skeleton_extract_3d.track.appearance import Clothes
from skeleton_extract_3d.track.identity import assign, compare, joined
from skeleton_extract_3d.track.tracks import Tracks
from synthetic_scene import Person, Room, pinhole, render, standing

INDEX = COCO_18.index
STAMP = 10.0
RED, GREEN = (50.0, 70, 50), (60.0, -60, 50)  # CIELAB


@lru_cache(maxsize=None)
def scene(*places):
    """Return people at (x, z)."""
    return render(pinhole(320, 180), [Person(i, x, z, standing()) for i, (x, z) in enumerate(places)], Room(wall=6.0))


def tracks_at(*places, last_seen=STAMP - 0.1):
    """Return tracks of people who are expected at (x, z)."""
    if not places:
        return Tracks.none()
    return tracks_of(scene(*places).xyz, last_seen)


def clothes(people, *colours):
    result = Clothes.unknown(people)
    for person, colour in enumerate(colours):
        if colour is not None:
            result.colours[person], result.weights[person] = colour, 1
    return result


def dressed(tracks, *colours):
    of_tracks = Clothes(np.repeat(np.array(colours)[:, None], 2, axis=1), np.full((len(colours), 2), 5.0))
    return replace(tracks, clothes=of_tracks)


def rows(tracks, frame, of_people=None, people=None, stamp=STAMP, **params):
    people = frame.people if people is None else people
    seen = observe(people, frame.size, DepthImage(frame.depth, frame.camera), frame.camera)
    of_people = of_people or Clothes.unknown(len(people))
    return assign(tracks, of_people, compare(tracks, seen), stamp, IdentityParams(**params)).tolist()


def permuted(frame, order):
    people = frame.people
    return People2D(COCO_18, people.keypoints[order], people.scores[order], people.ids[order])


LEFT, RIGHT = (-0.8, 2.6), (0.7, 3.2)


# --- assignment -----------------------------------------------------------------------------------------------------

def test_no_people():
    assert rows(tracks_at(), scene((0.0, 2.6)), people=People2D.empty(COCO_18)) == []
    assert rows(tracks_at(LEFT), scene(LEFT), people=People2D.empty(COCO_18)) == []
    assert rows(tracks_at(), scene(LEFT, RIGHT)) == [-1, -1]


def test_people_get_the_tracks_that_expect_them_in_any_order():
    frame = scene(LEFT, RIGHT, (2.0, 4.5))
    tracks = tracks_at(LEFT, RIGHT, (2.0, 4.5))
    assert rows(tracks, frame) == [0, 1, 2]
    assert rows(tracks, frame, people=permuted(frame, [2, 0, 1])) == [2, 0, 1]


def test_a_new_person_has_no_track_and_a_lost_track_no_person():
    assert rows(tracks_at(LEFT), scene(LEFT, RIGHT)) == [0, -1]
    assert rows(tracks_at(LEFT, RIGHT), scene(RIGHT)) == [1]


@pytest.mark.parametrize('step, same', [(0.1, True), (0.4, True), (0.7, False)])
def test_a_person_who_is_beyond_the_gate_is_another_person(step, same):
    assert rows(tracks_at((0.0, 2.6)), scene((step, 2.6)), track_gate=0.5) == [0 if same else -1]


def test_the_gate_grows_while_a_person_is_away():
    tracks = tracks_at((0.0, 2.6), last_seen=STAMP - 1.0)
    assert rows(tracks, scene((1.2, 2.6)), track_gate=0.5, walking_speed=1.2) == [0]
    assert rows(tracks, scene((1.2, 2.6)), track_gate=0.5, walking_speed=0.2) == [-1]
    assert rows(tracks, scene((1.2, 2.6)), stamp=STAMP - 0.9, track_gate=0.5, walking_speed=1.2) == [-1]


def test_depth_tells_two_apart_who_are_in_one_line_of_sight():
    # who is behind shows above and beside who is in front
    near, far = (0.0, 2.2), (0.3, 3.6)
    frame = scene(near, far)
    assert rows(tracks_at(near, far), frame) == [0, 1]
    assert rows(tracks_at(far, near), frame) == [1, 0]


# --- clothes --------------------------------------------------------------------------------------------------------

MIDDLE = [(-0.2, 2.6), (0.2, 2.6)]


def test_two_who_come_back_from_out_of_sight_are_told_apart_by_colours():
    tracks = dressed(tracks_at(*MIDDLE, last_seen=STAMP - 1.0), RED, GREEN)
    frame = scene(*MIDDLE)
    assert rows(tracks, frame, clothes(2, GREEN, RED)) == [1, 0]
    assert rows(tracks, frame, clothes(2, RED, GREEN)) == [0, 1]
    assert rows(tracks, frame, clothes(2, GREEN, RED), use_clothes=False) == [0, 1]


def test_colours_count_little_for_people_who_were_never_out_of_sight():
    # a shadow, or an arm before the chest: two who stand 1.5 m apart do not change places
    tracks = dressed(tracks_at(LEFT, RIGHT), RED, GREEN)
    assert rows(tracks, scene(LEFT, RIGHT), clothes(2, GREEN, RED)) == [0, 1]
    tracks = dressed(tracks_at(*MIDDLE), RED, GREEN)
    assert rows(tracks, scene(*MIDDLE), clothes(2, GREEN, RED)) == [0, 1]


# --- halves ---------------------------------------------------------------------------------------------------------

LOWER = [INDEX[f'{side}_{joint}'] for side in ('right', 'left') for joint in ('hip', 'knee', 'ankle')]


def pieces(frame, *joints):
    """Return one piece with these joints of each person of a frame."""
    keypoints = frame.people.keypoints.copy()
    for person, kept in zip(keypoints, joints):
        person[[joint for joint in range(18) if joint not in kept]] = (np.nan, np.nan, 0)
    return replace(frame.people, keypoints=keypoints)


def joints_after_joining(tracks, frame, people, row):
    seen = observe(people, frame.size, DepthImage(frame.depth, frame.camera), frame.camera)
    people, row = joined(tracks, seen, compare(tracks, seen), np.array(row))
    assert len(people) == len(row)
    return people.present.sum(axis=1).tolist(), row.tolist()


UPPER, EVERYTHING = [joint for joint in range(18) if joint not in LOWER], range(18)


def test_a_person_with_the_same_joints_is_no_half():
    frame = scene(LEFT, (LEFT[0] + 0.15, LEFT[1]))
    for joints in (EVERYTHING, [*LOWER, 0, 1, 2]):
        assert joints_after_joining(tracks_at(LEFT), frame, pieces(frame, UPPER, joints), [0, -1])[1] == [0, -1]


def test_legs_at_another_place_or_depth_are_not_joined():
    frame = scene(LEFT, (LEFT[0] + 0.4, LEFT[1]))
    assert joints_after_joining(tracks_at(LEFT), frame, pieces(frame, UPPER, LOWER), [0, -1])[1] == [0, -1]
    frame = scene(LEFT)
    farther = replace(frame, depth=(1.4 * frame.depth).astype(np.uint16))
    both = pieces(frame, UPPER).joined(pieces(frame, LOWER))
    assert joints_after_joining(tracks_at(LEFT), farther, both, [0, -1])[1] == [0, -1]


# --- the rest -------------------------------------------------------------------------------------------------------

"""Who is who: keypoints of known people are given to tracks of known people."""
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from estimating import tracks_of
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.settings import IdentityParams
from skeleton_extract_3d.track.appearance import Clothes
from skeleton_extract_3d.track.identity import TrackComparison, assign, compare, joined
from skeleton_extract_3d.track.tracks import Tracks
from synthetic_scene import Person, Room, pinhole, render, standing, without_joints

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


def clothes(*colours):
    return Clothes(np.repeat(np.array(colours)[:, None], 2, axis=1), np.full((len(colours), 2), 5.0))


def numbered(people):
    return replace(people, ids=np.arange(len(people)))


def rows(tracks, frame, of_people=None, people=None, stamp=STAMP, **constants):
    people = numbered(frame.people if people is None else people)
    seen = observe(people, frame.size, DepthImage(frame.depth, frame.camera), frame.camera)
    of_people = of_people or Clothes.unknown(len(people))
    compared = compare(tracks, seen, np.full(len(people), -1))
    return assign(tracks, of_people, compared, stamp, IdentityParams(),
                  replace(METHOD.track.identity, **constants)).tolist()


LEFT, RIGHT = (-0.8, 2.6), (0.7, 3.2)


def test_no_people():
    assert rows(tracks_at(), scene((0.0, 2.6)), people=People2D.empty(COCO_18)) == []
    assert rows(tracks_at(LEFT), scene(LEFT), people=People2D.empty(COCO_18)) == []
    assert rows(tracks_at(), scene(LEFT, RIGHT)) == [-1, -1]


def test_people_get_the_tracks_that_expect_them_in_any_order():
    frame = scene(LEFT, RIGHT, (2.0, 4.5))
    tracks = tracks_at(LEFT, RIGHT, (2.0, 4.5))
    assert rows(tracks, frame) == [0, 1, 2]
    assert rows(tracks, frame, people=frame.people.select(np.array([2, 0, 1]))) == [2, 0, 1]


@pytest.mark.parametrize('step, same', [(0.1, True), (0.4, True), (0.7, False)])
def test_a_person_who_is_beyond_the_gate_is_another_person(step, same):
    assert rows(tracks_at((0.0, 2.6)), scene((step, 2.6))) == [0 if same else -1]


@pytest.mark.parametrize('own, expected', [(np.zeros((2, 2), bool), [0, 1]), (~np.eye(2, dtype=bool), [1, 0])])
def test_of_two_who_are_about_as_near_each_has_the_person_on_its_own_crop(own, expected):
    compared = TrackComparison(np.array([[0.10, 0.12], [0.12, 0.10]]), np.zeros((2, 2)), own)
    assert assign(tracks_at(LEFT, RIGHT), Clothes.unknown(2), compared, STAMP, IdentityParams()).tolist() == expected


def test_the_gate_grows_while_a_person_is_away():
    tracks = tracks_at((0.0, 2.6), last_seen=STAMP - 1.0)
    assert rows(tracks, scene((1.2, 2.6))) == [0]
    assert rows(tracks, scene((1.2, 2.6)), walking_speed=0.2) == [-1]
    assert rows(tracks, scene((1.2, 2.6)), stamp=STAMP - 0.9) == [-1]


@pytest.mark.parametrize('places', [(LEFT, RIGHT), ((-0.2, 2.6), (0.2, 2.6))], ids=['1.6 m apart', '0.4 m'])
def test_colours_count_little_for_people_who_were_never_out_of_sight(places):
    # a shadow, or an arm before the chest
    tracks = replace(tracks_at(*places), clothes=clothes(RED, GREEN))
    assert rows(tracks, scene(*places), clothes(GREEN, RED)) == [0, 1]


@pytest.mark.parametrize('aside, worn, same', [(1.2, RED, True), (1.2, GREEN, False), (0.4, GREEN, True)],
                         ids=['the same clothes', 'others', 'of what covers the person'])
def test_the_gate_does_not_grow_for_a_person_in_other_clothes(aside, worn, same):
    tracks = replace(tracks_at((0.0, 2.6), last_seen=STAMP - 1.0), clothes=clothes(RED))
    assert rows(tracks, scene((aside, 2.6)), clothes(worn)) == [0 if same else -1]


LOWER = np.isin(COCO_18.joints, [f'{side}_{joint}' for side in ('right', 'left') for joint in ('hip', 'knee', 'ankle')])


@pytest.mark.parametrize('lower, aside, depth', [
    (np.ones(18, bool), 0.15, 1.0), (LOWER | (np.arange(18) < 3), 0.15, 1.0), (LOWER, 0.4, 1.0), (LOWER, 0.0, 1.4)],
    ids=['the same joints', 'some of the same', 'at another place', 'farther away'])
def test_what_is_no_half_of_a_person_is_not_joined(lower, aside, depth):
    frame = scene(LEFT, (LEFT[0] + aside, LEFT[1])) if aside else scene(LEFT)
    people = frame.people.select(np.array([0, len(frame.people) - 1]))
    people = without_joints(people, np.stack([LOWER, ~lower]))
    seen = observe(people, frame.size, DepthImage((depth * frame.depth).astype(np.uint16), frame.camera), frame.camera)
    tracks = tracks_at(LEFT)
    assert joined(tracks, seen, compare(tracks, seen, np.array([-1, -1])), np.array([0, -1]))[1].tolist() == [0, -1]

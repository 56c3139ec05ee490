"""Two bodies cannot be in one place."""
from dataclasses import replace

import numpy as np
import pytest

from estimating import new_estimator, tracks_of, update
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.track.completion import Completion
from skeleton_extract_3d.track.one_body import apart, sharing
from skeleton_extract_3d.track.tracks import Tracks
from synthetic_scene import (
    VISIBLE,
    Person,
    Pose,
    Room,
    moved_pixels,
    pinhole,
    pointing,
    render,
    seated,
    standing,
    without_joints,
)

SURE = METHOD.track.one_body.sure
SWAP = list(COCO_18.swap)
UPPER = [joint for joint, name in enumerate(COCO_18.joints) if not name.endswith(('hip', 'knee', 'ankle'))]
LEFT = [joint for joint, name in enumerate(COCO_18.joints) if name.startswith('left')]
FRAME = render(pinhole(320, 180), [Person(0, 0.0, 2.6, standing())], Room(wall=6.0))


def taken(*bodies, looked=True, sure=True, **values):
    """Return which of bodies, (18, 3) each, the first followed for longest, are in the place of another one."""
    tracks = tracks_of(bodies, **{'born': np.arange(len(bodies), dtype=float), 'existence': np.full(
        len(bodies), 0.99 if sure else SURE - 0.1), **values})
    seen = Completion(tracks, tracks.has, tracks.has, np.zeros(tracks.has.shape))
    return sharing(seen, np.broadcast_to(looked, len(bodies))).tolist()


def body(x=0.0):
    return FRAME.xyz[0] + np.array([x, 0, 0])


def test_no_people_and_one_alone():
    assert taken() == [] and taken(body()) == [False]


@pytest.mark.parametrize('other', [body(0.1), body(0.1)[SWAP]], ids=['copy', 'left and right exchanged'])
def test_of_two_in_one_place_one_is_the_other(other):
    assert taken(body(), other) == [False, True]
    assert taken(body(), other, born=np.array([2.0, 1.0])) == [True, False], 'who is followed for longer stays'
    assert taken(body(), other, looked=[False, True]) == [True, False], 'a network saw the other one'
    assert taken(body(), other, body(0.12)) == [False, True, True]


def test_of_a_chain_of_bodies_those_who_are_near_one_that_stays_go():
    assert taken(body(), body(0.12), body(0.24)) == [False, True, False]


@pytest.mark.parametrize('apart_by, sure, expected', [(0.2, True, False), (0.2, False, True), (0.3, False, False)])
def test_unsure_people_need_more_room(apart_by, sure, expected):
    assert taken(body(), body(apart_by), sure=sure) == [False, expected]


def test_hidden_people_are_not_in_the_place_of_visible_ones():
    seen = Completion(tracks_of([body()]), *np.ones((3, 1, 18), bool))
    none = Completion(Tracks.none(), *np.ones((3, 0, 18), bool))
    hidden = tracks_of([body(0.1), body(0.3), body(0.1)[SWAP]])
    assert apart(hidden, seen).ids.tolist() == [1]
    assert apart(hidden, none) is hidden and len(apart(Tracks.none(), seen)) == 0


def in_halves(people, joints):
    """Return each person as two: one with these joints, one with the others."""
    first = np.isin(np.arange(18), joints)
    upper, lower = (without_joints(people, np.tile(gone, (len(people), 1))) for gone in (~first, first))
    return upper.joined(lower)


@pytest.mark.parametrize('joints, cut', [
    pytest.param(UPPER, lambda i: True, id='upper and lower'),
    pytest.param(UPPER, lambda i: i % 2 == 1, id='upper and lower in every other frame'),
    pytest.param(LEFT, lambda i: i % 2 == 1, id='left and right in every other frame'),
    pytest.param(LEFT, lambda i: i >= 5, id='left and right from some time on')])
def test_halves_of_a_person_become_one_with_all_joints(joints, cut):
    estimator = new_estimator()
    for i in range(12):
        people = update(estimator, FRAME, i / 15, in_halves(FRAME.people, joints) if cut(i) else FRAME.people).people
        assert people.ids.tolist() == [1]
        if i:
            assert (people.confidence[0] > 0).all()
            assert np.median(np.linalg.norm(people.xyz[0] - FRAME.xyz[0], axis=1)) < 0.04


def arms(forwards):
    """Return a standing pose with both arms swung forwards [deg]."""
    swung = np.stack([pointing(forwards, 0, side) for side in (-1, 1)])
    return replace(standing(), upper_arms=swung, forearms=swung)


HAND = Pose(np.stack([pointing(60, 0, -1), pointing(0, 5, 1)]), np.stack([pointing(80, 0, -1), pointing(0, 5, 1)]),
            standing().thighs, standing().shins)
# Pairs that must not become one: they touch, or one is behind the other.
PAIRS = {
    'hug': (Person(0, -0.15, 2.4, arms(80), yaw=np.pi / 2), Person(1, 0.15, 2.4, arms(60), yaw=-np.pi / 2)),
    'handshake': (Person(0, -0.4, 2.4, HAND, yaw=np.pi / 2), Person(1, 0.4, 2.4, HAND, yaw=-np.pi / 2)),
    'behind a shoulder': (Person(0, 0.0, 2.2, standing()), Person(1, 0.25, 2.6, standing())),
    'seated back to back': (Person(0, 0.16, 2.6, seated(), yaw=np.pi / 2),
                            Person(1, -0.16, 2.6, seated(), yaw=-np.pi / 2)),
    'child before a parent': (Person(0, 0.05, 2.2, standing(), scale=0.6), Person(1, 0.0, 2.5, standing())),
}


@pytest.mark.parametrize('pair', PAIRS)
def test_two_who_touch_stay_two(pair):
    """A detector that finds what the camera sees of each, to two pixels, for 1.5 s."""
    frame, rng = render(pinhole(480, 270), PAIRS[pair], Room(wall=5.0)), np.random.default_rng(0)
    shown = without_joints(frame.people, frame.vis != VISIBLE)
    estimator = new_estimator()
    for i in range(22):
        people = update(estimator, frame, i / 15, moved_pixels(shown, rng, sigma=2.0)).people
        assert people.ids.tolist() == [1, 2]
    off = np.linalg.norm(people.xyz - frame.xyz, axis=2)
    assert (np.nanmedian(off, axis=1) < 0.15).all()

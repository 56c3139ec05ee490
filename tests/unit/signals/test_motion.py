"""Walking, facing and falling of a simulated body."""
from dataclasses import replace

import numpy as np
import pytest

from animated_skeleton import (
    ADULT,
    CHILD,
    CROUCHING,
    LYING,
    SITTING,
    SITTING_ON_FLOOR,
    STANDING,
    TRUNK,
    UP,
    frames,
    held,
    people_of,
    watch,
    without,
)
from openpose_ros_signals.reader import SignalReader
from skeleton_extract_3d.landmarks import Faces3D, Landmarks3D, Points3D


def walking(speed, seconds=3.0):
    """Return a motion along x [m/s], and standing still after it."""
    return held((0, STANDING), (seconds, replace(STANDING, place=(speed * seconds, 0.0))))


def falls_of(signals):
    return {person.fall for _, person in signals if person.fall}


@pytest.mark.parametrize('speed, rate', [(0.6, 5), (1.4, 10), (0.6, 30)])
def test_walking_is_told_with_its_speed_and_direction(speed, rate):
    signals = watch(walking(speed), 5, rate)
    walks = [person.walk for stamp, person in signals if 0.6 < stamp < 2.9]
    assert all(walk.moving for walk in walks)
    assert np.median([walk.speed for walk in walks]) == pytest.approx(speed, abs=0.08)
    assert np.median([walk.direction[0] for walk in walks]) > 0.97 and walks[0].direction[2] == 0
    still = [person.walk for stamp, person in signals if stamp > 3.7]
    assert not any(walk.moving for walk in still) and max(walk.speed for walk in still) < 0.1
    assert (still[-1].direction == 0).all()


def test_a_person_that_stopped_with_a_hidden_trunk_does_not_move_when_seen_again():
    reader, walks = SignalReader(), {}
    for stamp, people in frames(walking(1.0, 1.0), 8, 10):
        seen = without(people, TRUNK) if 0.95 < stamp < 6 else people
        walks[stamp] = reader.update(seen, stamp, UP)[0].walk
    again = [walk for stamp, walk in walks.items() if stamp > 6 and walk is not None]
    assert walks[0.9].moving and len(again) > 10 and not any(walk.moving for walk in again)


@pytest.mark.parametrize('facing', [0, 75, 290])
def test_facing_of_body_and_head(facing):
    person = watch(held((0, replace(STANDING, facing=facing))), 0.5)[-1][1]
    ahead = [np.cos(np.radians(facing)), np.sin(np.radians(facing)), 0]
    assert person.body.direction @ ahead > np.cos(np.radians(6))
    assert person.head.direction @ ahead > np.cos(np.radians(12))
    assert 0.02 < person.body.sigma < person.head.sigma < 0.5
    assert person.body.begin is None and (person.head.begin - person.place) @ UP > 0.3


def test_the_face_tells_where_a_head_faces_if_it_was_found():
    points, status = np.full((1, 70, 3), np.nan), np.zeros((1, 70))
    points[0, :2], status[0, :2] = [[0.1, 0.0, 1.6], [0.1, 0.1, 1.6]], 1
    half = np.radians(60) / 2  # to the left of x
    face = Faces3D(Points3D(points, status, status, np.full((1, 70), np.nan)), np.ones(1), np.ones(1, int),
                   np.array([[0, 0, np.sin(half), np.cos(half)]]), np.array([0.1]))
    people = people_of([STANDING], [1], np.random.RandomState(0))
    head = SignalReader().update(people, 0.0, UP, landmarks=Landmarks3D(Landmarks3D().hands, face))[0].head
    np.testing.assert_allclose(head.direction, [0.5, 3 ** 0.5 / 2, 0], atol=1e-6)
    np.testing.assert_allclose(head.begin, [0.1, 0.05, 1.6], atol=1e-6)


@pytest.mark.parametrize('before, rate, stature', [(STANDING, 5, ADULT), (STANDING, 30, CHILD), (SITTING, 10, ADULT),
                                                   (SITTING, 5, CHILD)])
def test_a_fall_is_told_once(before, rate, stature):
    signals = watch(held((0, before), (1.5, before), (2.1, LYING), (4, LYING)), 4, rate, stature=stature)
    falls = falls_of(signals)
    assert len(falls) == 1
    fall, = falls
    assert 1.7 < fall.stamp <= 2.1 + 1 / rate and 0.2 < fall.duration < 0.9
    first = next(stamp for stamp, person in signals if person.fall)
    assert first <= fall.stamp + 0.06 + 1 / rate
    assert all(person.fall is fall for stamp, person in signals if stamp >= first)


def test_two_falls():
    motion = held((0, STANDING), (1, STANDING), (1.6, LYING), (3, LYING), (4, STANDING), (6, STANDING), (6.6, LYING))
    signals = watch(motion, 8, 10)
    assert len(falls_of(signals)) == 2
    assert not [stamp for stamp, person in signals if 4.3 < stamp < 6 and person.fall]


def test_sitting_up_and_lying_back_is_one_fall():
    sits = replace(SITTING_ON_FLOOR, lean=-10)
    motion = held((0, STANDING), (1, STANDING), (1.5, LYING), (1.8, LYING), (2.3, sits), (2.5, sits), (3.1, LYING))
    assert len(falls_of(watch(motion, 5, 15))) == 1


@pytest.mark.parametrize('motion, rate', [
    (held((0, LYING)), 5), (held((0, STANDING), (1, STANDING), (5.5, LYING)), 30),
    (held((0, SITTING), (1, SITTING), (4.5, LYING)), 10),
    (held((0, STANDING), (1, STANDING), (1.4, CROUCHING), (2, CROUCHING)), 5),
    (held((0, STANDING), (1, STANDING), (1.5, SITTING)), 30),
    (held((0, STANDING), (1, STANDING), (1.5, replace(STANDING, lean=85))), 10)],
    ids=['lies when first seen', 'lies down', 'lies back', 'crouches', 'sits down', 'bends over'])
def test_no_fall(motion, rate):
    assert not falls_of(watch(motion, 6, rate))

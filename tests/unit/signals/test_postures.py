"""Postures of a simulated body: true ones, and ones that are like them."""
from dataclasses import replace

import numpy as np
import pytest

from animated_skeleton import (
    ADULT,
    BENT_OVER,
    CHILD,
    CROSS_LEGGED,
    CROUCHING,
    KNEELING,
    LYING,
    ON_ALL_FOURS,
    ON_ONE_KNEE,
    RATES,
    RUNNING,
    SITTING,
    SITTING_ON_FLOOR,
    STANDING,
    Limb,
    Pose,
    held,
    swinging,
    watch,
)

_WIDE_STEP = Pose(left_leg=Limb((0, 0.5, -1), (0, 0.2, -1)), right_leg=Limb((0, -0.4, -1), (0, -0.8, -0.8)))
_ON_A_BED = replace(LYING, left_leg=Limb((0, 1, 0), (0, 0, -1)), right_leg=Limb((0, 1, 0), (0, 0, -1)))
_ON_THE_BELLY = Pose(left_leg=Limb((0, -1, 0), (0, -1, 0)), right_leg=Limb((0, -1, 0), (0, -1, 0)), lean=90.0)
_KNEES_UP = replace(LYING, left_leg=Limb((0, 0.6, 0.8), (0, 0.6, -0.8)), right_leg=Limb((0, 0.6, 0.8), (0, 0.6, -0.8)))
_FOOT_ON_A_STEP = replace(STANDING, right_leg=Limb((0, 0.9, -0.4), (0, -0.1, -1)))
_PICKS_SOMETHING_UP = replace(CROUCHING, lean=60.0)
_FOOT_HELD_BEHIND = replace(STANDING, right_leg=Limb((0, -0.1, -1), (0, -0.6, 0.7)))


@pytest.mark.parametrize('stature', [ADULT, CHILD])
@pytest.mark.parametrize('rate', RATES)
@pytest.mark.parametrize('pose, posture', [
    (STANDING, 'standing'), (SITTING, 'sitting'), (CROUCHING, 'crouching'), (KNEELING, 'kneeling'), (LYING, 'lying')],
    ids=lambda value: value if isinstance(value, str) else '')
def test_each_posture_is_told_within_a_third_of_a_second(pose, posture, rate, stature):
    signals = watch(held((0, pose)), 2, rate, stature=stature)
    assert {person.posture.name for stamp, person in signals if stamp > 0.34} == {posture}
    assert signals[-1][1].posture.since <= 0.34
    assert signals[-1][1].posture.confidence > 0.7


@pytest.mark.parametrize('pose, posture', [
    (BENT_OVER, 'standing'), (_WIDE_STEP, 'standing'), (RUNNING, 'standing'), (_FOOT_ON_A_STEP, 'standing'),
    (_FOOT_HELD_BEHIND, 'standing'), (SITTING_ON_FLOOR, 'sitting'), (CROSS_LEGGED, 'sitting'),
    (ON_ONE_KNEE, 'kneeling'), (ON_ALL_FOURS, 'kneeling'), (_ON_A_BED, 'lying'), (_ON_THE_BELLY, 'lying'),
    (_KNEES_UP, 'lying'), (_PICKS_SOMETHING_UP, 'crouching')],
    ids=('bent over', 'wide step', 'running', 'foot on a step', 'foot held behind', 'on the floor', 'cross-legged',
         'on one knee', 'on all fours', 'legs hang from a bed', 'on the belly', 'knees up', 'picks something up'))
def test_what_looks_like_another_posture(pose, posture):
    assert watch(held((0, pose)), 1)[-1][1].posture.name == posture


def test_who_bends_down_and_up_again_stands_all_the_time():
    signals = watch(held((0, STANDING), (1, STANDING), (1.5, BENT_OVER), (2.5, BENT_OVER), (3, STANDING)), 4)
    assert {person.posture.name for stamp, person in signals if stamp > 0.34} == {'standing'}


@pytest.mark.parametrize('facing', [0, 90, 200])
def test_a_posture_does_not_depend_on_where_one_faces(facing):
    for pose, posture in ((SITTING, 'sitting'), (CROUCHING, 'crouching'), (KNEELING, 'kneeling')):
        assert watch(held((0, replace(pose, facing=facing))), 1)[-1][1].posture.name == posture


def test_hidden_legs_tell_no_posture():
    signals = watch(held((0, SITTING)), 1, hidden=('knee', 'ankle'))
    assert {person.posture.name for _, person in signals} == {'unknown'}
    assert np.isnan(signals[-1][1].posture.since) and signals[-1][1].posture.confidence == 0


@pytest.mark.parametrize('pose', [STANDING, LYING], ids=['upright', 'flat'])
def test_a_trunk_alone_at_the_border_tells_no_posture(pose):
    signals = watch(held((0, pose)), 1, hidden=('knee', 'ankle', 'eye', 'ear', 'nose', 'wrist'))
    assert {person.posture.name for _, person in signals} == {'unknown'}
    assert not any(person.fall or person.gestures for _, person in signals)


def test_one_leg_that_is_seen_is_enough():
    assert watch(held((0, SITTING)), 1, hidden=('left_knee', 'left_ankle'))[-1][1].posture.name == 'sitting'


@pytest.mark.parametrize('rate', RATES)
def test_on_the_way_from_one_posture_to_the_next_none_is_told_but_these(rate):
    signals = watch(held((0, STANDING), (1, STANDING), (2, SITTING)), 3, rate)
    names = [person.posture.name for stamp, person in signals if stamp > 0.34]
    assert names[0] == 'standing' and names[-1] == 'sitting'
    assert set(names) <= {'standing', 'sitting', 'unknown'}
    assert names == sorted(names, key=['standing', 'unknown', 'sitting'].index)


def test_walking_is_standing():
    step, other = Limb((0, 0.45, -1), (0, 0.1, -1)), Limb((0, -0.3, -1), (0, -0.75, -0.8))
    walking = swinging(Pose(left_leg=step, right_leg=other), Pose(left_leg=other, right_leg=step), 1.0)
    assert {person.posture.name for stamp, person in watch(walking, 3, 15) if stamp > 0.3} == {'standing'}

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

WIDE_STEP = Pose(left_leg=Limb((0, 0.5, -1), (0, 0.2, -1)), right_leg=Limb((0, -0.4, -1), (0, -0.8, -0.8)))
ON_A_BED = replace(LYING, left_leg=Limb((0, 1, 0), (0, 0, -1)), right_leg=Limb((0, 1, 0), (0, 0, -1)))
ON_THE_BELLY = Pose(left_leg=Limb((0, -1, 0), (0, -1, 0)), right_leg=Limb((0, -1, 0), (0, -1, 0)), lean=90.0)
KNEES_UP = replace(LYING, left_leg=Limb((0, 0.6, 0.8), (0, 0.6, -0.8)), right_leg=Limb((0, 0.6, 0.8), (0, 0.6, -0.8)))
FOOT_ON_A_STEP = replace(STANDING, right_leg=Limb((0, 0.9, -0.4), (0, -0.1, -1)))
FOOT_HELD_BEHIND = replace(STANDING, right_leg=Limb((0, -0.1, -1), (0, -0.6, 0.7)))


def names_after(signals, begin=0.34):
    return {person.posture.name for stamp, person in signals if stamp > begin}


@pytest.mark.parametrize('pose, posture, rate, stature', [
    (STANDING, 'standing', 5, ADULT), (STANDING, 'standing', 30, CHILD), (SITTING, 'sitting', 10, CHILD),
    (SITTING, 'sitting', 5, ADULT), (CROUCHING, 'crouching', 30, ADULT), (CROUCHING, 'crouching', 5, CHILD),
    (KNEELING, 'kneeling', 10, ADULT), (KNEELING, 'kneeling', 5, CHILD), (LYING, 'lying', 30, CHILD),
    (LYING, 'lying', 5, ADULT)])
def test_each_posture_is_told_within_a_third_of_a_second(pose, posture, rate, stature):
    signals = watch(held((0, pose)), 2, rate, stature=stature)
    assert names_after(signals) == {posture}
    assert signals[-1][1].posture.since <= 0.34
    assert signals[-1][1].posture.confidence > 0.7


@pytest.mark.parametrize('pose, posture', [
    (BENT_OVER, 'standing'), (WIDE_STEP, 'standing'), (RUNNING, 'standing'), (FOOT_ON_A_STEP, 'standing'),
    (FOOT_HELD_BEHIND, 'standing'), (SITTING_ON_FLOOR, 'sitting'), (CROSS_LEGGED, 'sitting'),
    (ON_ONE_KNEE, 'kneeling'), (ON_ALL_FOURS, 'kneeling'), (ON_A_BED, 'lying'), (ON_THE_BELLY, 'lying'),
    (KNEES_UP, 'lying'), (replace(CROUCHING, lean=60.0), 'crouching'), (replace(SITTING, facing=90), 'sitting'),
    (replace(CROUCHING, facing=200), 'crouching'), (replace(KNEELING, facing=200), 'kneeling')],
    ids=('bent over', 'wide step', 'running', 'foot on a step', 'foot held behind', 'on the floor', 'cross-legged',
         'on one knee', 'on all fours', 'legs hang from a bed', 'on the belly', 'knees up', 'picks something up',
         'sits turned', 'crouches turned', 'kneels turned'))
def test_what_looks_like_another_posture(pose, posture):
    assert watch(held((0, pose)), 1)[-1][1].posture.name == posture


STEP, OTHER = Limb((0, 0.45, -1), (0, 0.1, -1)), Limb((0, -0.3, -1), (0, -0.75, -0.8))


@pytest.mark.parametrize('motion', [
    held((0, STANDING), (1, STANDING), (1.5, BENT_OVER), (2.5, BENT_OVER), (3, STANDING)),
    swinging(Pose(left_leg=STEP, right_leg=OTHER), Pose(left_leg=OTHER, right_leg=STEP), 1.0)],
    ids=['bends down and up again', 'walks'])
def test_motions_that_are_standing(motion):
    assert names_after(watch(motion, 4, 15)) == {'standing'}


@pytest.mark.parametrize('pose, hidden', [
    (SITTING, ('knee', 'ankle')), (STANDING, ('knee', 'ankle', 'eye', 'ear', 'nose', 'wrist')),
    (LYING, ('knee', 'ankle', 'eye', 'ear', 'nose', 'wrist'))])
def test_hidden_legs_tell_no_posture(pose, hidden):
    signals = watch(held((0, pose)), 1, hidden=hidden)
    assert names_after(signals, -1) == {'unknown'}
    assert np.isnan(signals[-1][1].posture.since) and signals[-1][1].posture.confidence == 0
    assert not any(person.fall or person.gestures for _, person in signals)


@pytest.mark.parametrize('rate', RATES)
def test_no_third_posture_on_the_way_from_one_to_the_next(rate):
    signals = watch(held((0, STANDING), (1, STANDING), (2, SITTING)), 3, rate)
    names = [person.posture.name for stamp, person in signals if stamp > 0.34]
    assert names[0] == 'standing' and names[-1] == 'sitting'
    assert set(names) <= {'standing', 'sitting', 'unknown'}
    assert names == sorted(names, key=['standing', 'unknown', 'sitting'].index)

"""Gestures of a simulated body: true ones, and motions that are like them."""
from dataclasses import replace

import numpy as np
import pytest

from animated_skeleton import (
    ADULT,
    CHILD,
    CROUCHING,
    HANGING,
    KNEELING,
    LYING,
    RATES,
    SITTING,
    STANDING,
    UP,
    Limb,
    all_told,
    frames,
    held,
    joints_of,
    swinging,
    then,
    told,
    watch,
)
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.reader import SignalReader
from skeleton_extract_3d.landmarks import Hands3D, Landmarks3D, Points3D

ARMS = ('left', 'right')
RAISED = Limb((0.2, 0.1, 1.0), (0.1, 0.0, 1.0))
WAVE_IN, WAVE_OUT = Limb((0.4, 0.5, -0.5), (-0.35, 0.2, 1.0)), Limb((0.4, 0.5, -0.5), (0.6, 0.2, 1.0))
BECKON_OPEN, BECKON_BENT = Limb((0.1, 0.6, -0.7), (0.0, 1.0, -0.1)), Limb((0.1, 0.6, -0.7), (0.0, -0.1, 1.0))
POINTING = Limb((0.3, 1.0, -0.1), (0.25, 1.0, 0.05))
SAYS_STOP = Limb((0.1, 1.0, -0.5), (0.0, 0.65, 0.75))
CROSSED = Limb((0.25, 0.2, -1.0), (-1.0, 0.4, 0.05))
# Near the ear; on top of the head; before the mouth; before the belly; together before the chest.
AT_EAR, ON_HEAD = Limb((0.5, 0.4, -0.7), (-0.25, -0.1, 1.0)), Limb((0.9, 0.1, 0.6), (-0.8, 0.0, 0.5))
AT_MOUTH = Limb((0.35, 0.5, -0.75), (-0.45, 0.15, 1.0))
CLASPED, PRAYING = Limb((0.2, 0.2, -1.0), (-0.6, 0.7, -0.35)), Limb((0.2, 0.3, -1.0), (-0.55, 0.6, 0.6))
TO_THE_SIDE = Limb((1.0, 0.0, 0.0), (1.0, 0.05, 0.0))


def lifted(arm, pose=STANDING, at=0.5, until=2.5, side='right'):
    """Return a motion: the arm hangs, goes to a place within 0.3 s, stays, and goes down again."""
    up = pose.with_arm(side, arm)
    return held((0, pose), (at, pose), (at + 0.3, up), (until, up), (until + 0.3, pose))


def begins_with(arm, motion, pose=STANDING, at=0.5, side='right'):
    """Return a motion: the arm hangs, goes to a place within 0.3 s, and another motion goes on from there."""
    return then((0, held((0, pose), (at, pose), (at + 0.3, pose.with_arm(side, arm)))), (at + 0.3, motion))


@pytest.mark.parametrize('stature', [ADULT, CHILD])
@pytest.mark.parametrize('rate', RATES)
@pytest.mark.parametrize('side', ARMS)
@pytest.mark.parametrize('name, arm, patience', [
    ('raise_hand', RAISED, 0.3), ('point', POINTING, 0.3), ('stop', SAYS_STOP, 0.55)])
def test_an_arm_that_is_held(name, arm, patience, side, rate, stature):
    signals = watch(lifted(arm, side=side), 4, rate, stature=stature)
    stamps = [stamp for stamp, _ in told(signals, name)]
    assert all_told(signals) == {name}
    assert {arm for _, arm in told(signals, name)} == {side}
    assert 0.6 <= stamps[0] <= 0.8 + patience + 1 / rate
    assert 2.5 <= stamps[-1] + 1 / rate <= 2.8 + 0.21 + 1 / rate
    assert len(stamps) == round((stamps[-1] - stamps[0]) * rate) + 1  # without a break


@pytest.mark.parametrize('pose', [SITTING, KNEELING], ids=['seated', 'kneeling'])
@pytest.mark.parametrize('rate', RATES)
@pytest.mark.parametrize('side', ARMS)
@pytest.mark.parametrize('frequency', [1.2, 2.0])
def test_waving_is_told_within_a_swing(frequency, side, rate, pose):
    wave = swinging(pose.with_arm(side, WAVE_IN), pose.with_arm(side, WAVE_OUT), frequency, 0.8)
    stamps = told(watch(begins_with(WAVE_IN, wave, pose, side=side), 3.5, rate), 'wave')
    assert {arm for _, arm in stamps} == {side}
    assert 0.8 < stamps[0][0] <= 0.8 + max(0.75 / frequency, 0.6)
    assert len(stamps) >= 0.85 * (3.5 - stamps[0][0]) * rate


@pytest.mark.parametrize('rate', RATES)
@pytest.mark.parametrize('side', ARMS)
@pytest.mark.parametrize('frequency', [1.2, 1.7])
def test_beckoning_is_told_within_a_swing(frequency, side, rate):
    beckon = swinging(STANDING.with_arm(side, BECKON_OPEN), STANDING.with_arm(side, BECKON_BENT), frequency, 0.8)
    signals = watch(begins_with(BECKON_OPEN, beckon, side=side), 3.5, rate)
    stamps = told(signals, 'beckon')
    assert {arm for _, arm in stamps} == {side}
    assert stamps[0][0] <= 0.8 + max(0.8 / frequency, 0.6)
    assert len(stamps) >= 0.8 * (3.5 - stamps[0][0]) * rate
    assert not told(signals, 'wave')


def test_both_arms_wave():
    def both(arm):
        return STANDING.with_arm('left', arm).with_arm('right', arm)
    signals = watch(swinging(both(WAVE_IN), both(WAVE_OUT), 1.7), 2)
    assert {arm for _, arm in told(signals, 'wave')} == {'left', 'right'}


@pytest.mark.parametrize('rate', RATES)
@pytest.mark.parametrize('stature', [ADULT, CHILD])
def test_crossed_arms(stature, rate):
    crossed = STANDING.with_arm('left', CROSSED).with_arm('right', CROSSED)
    signals = watch(held((0, STANDING), (0.5, STANDING), (0.9, crossed), (2.5, crossed), (2.9, STANDING)), 4, rate,
                    stature=stature)
    stamps = told(signals, 'arms_crossed')
    assert all_told(signals) == {'arms_crossed'} and {arm for _, arm in stamps} == {'both'}
    assert 0.5 < stamps[0][0] <= 1.0 + 1 / rate and 2.5 <= stamps[-1][0] + 1 / rate <= 2.9 + 1 / rate
    assert signals[int(2 * rate)][1].gesture('arms_crossed').confidence > 0.8


@pytest.mark.parametrize('rate', RATES)
@pytest.mark.parametrize('arm', [AT_EAR, ON_HEAD, AT_MOUTH, CLASPED, PRAYING, CROSSED, HANGING],
                         ids=['on the phone', 'hand on the head', 'drinks', 'before the belly', 'before the chest',
                              'one arm across', 'hangs'])
def test_an_arm_that_tells_nothing(arm, rate):
    assert all_told(watch(lifted(arm), 4, rate)) == set()


@pytest.mark.parametrize('arm', [CLASPED, PRAYING, HANGING, ON_HEAD, TO_THE_SIDE],
                         ids=['clasped', 'prays', 'hang', 'on the head', 'stretched to the sides'])
@pytest.mark.parametrize('rate', RATES)
def test_both_arms_that_tell_nothing(arm, rate):
    both = STANDING.with_arm('left', arm).with_arm('right', arm)
    assert all_told(watch(held((0, STANDING), (0.5, STANDING), (0.8, both), (2.5, both), (2.8, STANDING)), 4,
                          rate)) == set()


@pytest.mark.parametrize('rate', RATES)
def test_a_hand_that_goes_up_and_down_once_does_not_wave(rate):
    assert 'wave' not in all_told(watch(lifted(RAISED, until=0.9), 3, rate))
    assert 'wave' not in all_told(watch(lifted(WAVE_OUT, until=1.5), 3, rate))


@pytest.mark.parametrize('rate', RATES)
def test_a_hand_that_is_up_and_moves_to_the_side_once_does_not_wave(rate):
    inside, outside = (STANDING.with_arm('right', arm) for arm in (WAVE_IN, WAVE_OUT))
    moves = held((0, inside), (1.5, inside), (1.9, outside))
    assert 'wave' not in all_told(watch(moves, 4, rate))


@pytest.mark.parametrize('side', ARMS)
def test_a_hand_that_goes_up_and_down_aslant_does_not_wave(side):
    low, high = Limb((0.2, 0.3, -0.8), (0.05, 0.2, 1.0)), Limb((0.6, 0.4, 0.1), (0.05, 0.2, 1.0))
    aslant = swinging(STANDING.with_arm(side, low), STANDING.with_arm(side, high), 1.5)
    assert 'wave' not in all_told(watch(aslant, 3))


@pytest.mark.parametrize('rate', RATES)
def test_who_bends_the_elbow_once_does_not_beckon(rate):
    opened, bent = (STANDING.with_arm('right', arm) for arm in (BECKON_OPEN, BECKON_BENT))
    assert 'beckon' not in all_told(watch(held((0, opened), (1, opened), (1.4, bent)), 4, rate))


@pytest.mark.parametrize('rate', RATES)
def test_who_shakes_hands_does_not_beckon(rate):
    low, high = (STANDING.with_arm('right', Limb((0.1, 0.4, -0.9), (-0.1, 1.0, up))) for up in (-0.35, 0.1))
    assert all_told(watch(swinging(low, high, 2.5), 3, rate)) == set()


@pytest.mark.parametrize('rate', RATES)
def test_who_reaches_down_does_not_point(rate):
    reaches = replace(CROUCHING, right=Limb((0.1, 0.75, -0.65), (0.0, 0.75, -0.65)))
    assert 'point' in all_told(watch(held((0, replace(reaches, left_leg=KNEELING.left_leg,
                                                      right_leg=KNEELING.right_leg, lean=0.0))), 2, rate))
    assert all_told(watch(held((0, replace(reaches, lean=60.0))), 2, rate)) == set()


@pytest.mark.parametrize('hidden', [('nose', 'eye'), ('nose', 'eye', 'ear')], ids=['from behind', 'head is cut'])
def test_who_does_not_show_the_face_waves(hidden):
    wave = swinging(STANDING.with_arm('right', WAVE_IN), STANDING.with_arm('right', WAVE_OUT), 1.5)
    assert 'wave' in all_told(watch(wave, 2, 15, hidden=hidden))


@pytest.mark.parametrize('rate', RATES)
def test_arms_that_swing_in_walking_tell_nothing(rate):
    ahead, behind = Limb((0.1, 0.45, -1.0), (0.05, 0.75, -1.0)), Limb((0.1, -0.45, -1.0), (0.05, -0.2, -1.0))
    first = replace(STANDING, left=ahead, right=behind)
    second = replace(STANDING, left=behind, right=ahead, place=(0.0, 0.0))
    assert all_told(watch(swinging(first, second, 0.9), 4, rate)) == set()


@pytest.mark.parametrize('hidden', ['right_wrist', 'right_elbow', 'right_shoulder'])
def test_a_hidden_arm_tells_nothing_and_says_so(hidden):
    signals = watch(lifted(RAISED), 2, hidden=(hidden,))
    assert all_told(signals) == set()
    assert signals[-1][1].hidden_arms == ('right',)


def test_a_gesture_goes_on_while_the_arm_is_hidden_for_a_moment():
    shown, hidden = (dict(frames(lifted(RAISED), 3, 10, hidden=names)) for names in ((), ('right_wrist',)))

    def gestures(until):
        reader = SignalReader()
        read = {stamp: reader.update((hidden if 1.45 < stamp < until else shown)[stamp], stamp, UP)[0]
                for stamp in shown}
        return [bool(person.gestures) for stamp, person in read.items() if 1.2 < stamp < 2.4]
    assert all(gestures(until=1.75))
    assert not all(gestures(until=2.3))


def test_who_falls_tells_nothing_with_the_arms():
    flat = replace(LYING, left=BECKON_OPEN, right=POINTING)
    bent = replace(LYING, left=BECKON_BENT, right=POINTING)
    motion = then((0, held((0, STANDING), (1, STANDING), (1.6, flat))), (1.6, swinging(flat, bent, 1.7, 1.6)))
    assert all_told(watch(motion, 4, 15)) == set()


def palm_at(joints, side, out_of_palm, fingers):
    """Return the hand of person 1, with its palm and its fingers in two directions."""
    wrist = joints[COCO_18.index[f'{side}_wrist']]
    # from the little finger to the index of a left hand, the other way of a right one
    across, sign = np.cross(out_of_palm, fingers), -1 if side == 'left' else 1
    points = np.tile(wrist, (1, 21, 1))
    for number, sideways in ((5, 0.03), (9, 0.01), (17, -0.03)):
        points[0, number] = wrist + 0.09 * np.array(fingers) - sign * sideways * across
    shape = (1, 21)
    hands = Hands3D(Points3D(points, np.ones(shape), np.ones(shape), np.full(shape, 0.01)), np.ones(1), np.ones(1, int),
                    np.array([side == 'left']))
    return Landmarks3D(hands, Landmarks3D.empty().faces)


@pytest.mark.parametrize('side', ARMS)
@pytest.mark.parametrize('out_of_palm, fingers, name', [
    ((1, 0, 0), (0, 0, 1), 'stop'), ((0, 0, -1), (1, 0, 0), 'point'), ((-1, 0, 0), (0, 0, 1), 'point')],
    ids=['palm forward', 'palm down', 'back of the hand'])
def test_the_palm_tells_stop_from_pointing(out_of_palm, fingers, name, side):
    motion, reader, names = lifted(POINTING, side=side), SignalReader(), set()
    for stamp, people in frames(motion, 2.3, 10):
        hand = palm_at(joints_of(motion(stamp)), side, out_of_palm, fingers)
        names |= {gesture.name for gesture in reader.update(people, stamp, UP, landmarks=hand)[0].gestures
                  if stamp > 1.3}
    assert names == {name}


@pytest.mark.parametrize('facing', [0, 120, 250])
def test_gestures_do_not_depend_on_where_one_faces(facing):
    turned = replace(STANDING, facing=facing)
    for name, arm in (('raise_hand', RAISED), ('point', POINTING), ('stop', SAYS_STOP)):
        assert all_told(watch(lifted(arm, turned), 2.5)) == {name}

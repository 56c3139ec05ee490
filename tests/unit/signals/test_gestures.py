"""Gestures of a simulated body: motions that are like one, hidden joints, both arms; true ones: test_population."""
from dataclasses import replace

import numpy as np
import pytest

from animated_skeleton import (
    CROUCHING,
    HANGING,
    LYING,
    STANDING,
    UP,
    Limb,
    all_told,
    frames,
    held,
    joints_of,
    swinging,
    watch,
)
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.geometry import ramp
from openpose_ros_signals.reader import SignalReader
from skeleton_extract_3d.landmarks import Hands3D, Landmarks3D, Points3D
from skeleton_extract_3d.people import INFERRED

RAISED = Limb((0.2, 0.1, 1.0), (0.1, 0.0, 1.0))
WAVE_IN, WAVE_OUT = Limb((0.4, 0.5, -0.5), (-0.35, 0.2, 1.0)), Limb((0.4, 0.5, -0.5), (0.6, 0.2, 1.0))
POINTING = Limb((0.3, 1.0, -0.1), (0.25, 1.0, 0.05))
CROSSED = Limb((0.25, 0.2, -1.0), (-1.0, 0.4, 0.05))
PRAYING, TO_THE_SIDE = Limb((0.2, 0.3, -1.0), (-0.55, 0.6, 0.6)), Limb((1.0, 0.0, 0.0), (1.0, 0.05, 0.0))
LOW_ASLANT, HIGH_ASLANT = Limb((0.2, 0.3, -0.8), (0.05, 0.2, 1.0)), Limb((0.6, 0.4, 0.1), (0.05, 0.2, 1.0))
REACHES_DOWN = replace(CROUCHING, right=Limb((0.1, 0.75, -0.65), (0.0, 0.75, -0.65)), lean=60.0)


def both(arm):
    return replace(STANDING, left=arm, right=arm)


def right(arm):
    return STANDING.with_arm('right', arm)


def shown(pose, until=2.5):
    """Return a motion: the arms hang, take a pose within 0.3 s, stay, and go down again."""
    return held((0, STANDING), (0.5, STANDING), (0.8, pose), (until, pose), (until + 0.3, STANDING))


def lifted(arm, until=2.5, side='right'):
    return shown(STANDING.with_arm(side, arm), until)


@pytest.mark.parametrize('motion, rate, absent', [
    (lifted(CROSSED), 10, ''), (lifted(PRAYING), 30, ''), (lifted(HANGING), 5, ''),
    (shown(both(PRAYING)), 5, ''), (shown(both(TO_THE_SIDE)), 10, ''),
    (lifted(RAISED, until=0.9), 5, 'wave'), (lifted(RAISED, until=0.9), 30, 'wave'),
    (lifted(WAVE_OUT, until=1.5), 10, 'wave'),
    (held((0, right(WAVE_IN)), (1.5, right(WAVE_IN)), (1.9, right(WAVE_OUT))), 30, 'wave'),
    (swinging(right(LOW_ASLANT), right(HIGH_ASLANT), 1.5), 10, 'wave'),
    (held((0, REACHES_DOWN)), 10, '')],
    ids=['one arm across', 'one hand before the chest', 'hangs', 'prays', 'stretched to the sides',
         'up and down once', 'up and down once, 30 Hz', 'up and down aside', 'to the side once', 'up and down aslant',
         'reaches down'])
def test_no_gesture(motion, rate, absent):
    """Nothing is told, or not the gesture that the motion resembles."""
    found = all_told(watch(motion, 4, rate))
    assert absent not in found if absent else found == set()


@pytest.mark.parametrize('hidden', [('nose', 'eye'), ('nose', 'eye', 'ear')], ids=['from behind', 'head is cut'])
def test_waving_does_not_need_the_face(hidden):
    wave = swinging(right(WAVE_IN), right(WAVE_OUT), 1.5)
    assert 'wave' in all_told(watch(wave, 2, 15, hidden=hidden))


def test_a_gesture_goes_on_while_the_arm_is_hidden_for_a_moment():
    shown, hidden = (dict(frames(lifted(RAISED), 3, 10, hidden=names)) for names in ((), ('right_wrist',)))

    def gestures(until):
        reader = SignalReader()
        read = {stamp: reader.update((hidden if 1.45 < stamp < until else shown)[stamp], stamp, UP)[0]
                for stamp in shown}
        return [bool(person.gestures) for stamp, person in read.items() if 1.2 < stamp < 2.4]
    assert all(gestures(until=1.75))
    assert not all(gestures(until=2.3))


@pytest.mark.parametrize('score, told', [(0.5, {'point'}), (0.0, set())])
def test_a_joint_that_the_image_does_not_show_makes_no_gesture(score, told):
    reader, names, wrist = SignalReader(), set(), COCO_18.index['right_wrist']
    for stamp, people in frames(held((0, right(POINTING))), 1, 10):
        people.status[:, wrist], people.confidence[:, wrist] = INFERRED, score
        names |= {gesture.name for gesture in reader.update(people, stamp, UP)[0].gestures}
    assert names == told


@pytest.mark.parametrize('ends', [(125, 145), (145, 125)])
def test_an_uncertain_value_tells_little(ends):
    assert ramp(ends[1], ends) == ramp(ends[1], ends, 5) == 1
    assert ramp(ends[1], ends, 50) == pytest.approx(0.6)
    assert ramp(ends[0], ends, 1e3) == pytest.approx(0.5, abs=0.01)


def test_the_arms_of_a_falling_person_make_no_gesture():
    motion = held((0, STANDING), (1, STANDING), (1.6, replace(LYING, right=POINTING)))
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
    return Landmarks3D(hands, Landmarks3D().faces)


@pytest.mark.parametrize('out_of_palm, fingers, name, side', [
    ((1, 0, 0), (0, 0, 1), 'stop', 'left'), ((1, 0, 0), (0, 0, 1), 'stop', 'right'),
    ((0, 0, -1), (1, 0, 0), 'point', 'left'), ((-1, 0, 0), (0, 0, 1), 'point', 'right')],
    ids=['palm forward, left', 'palm forward', 'palm down', 'back of the hand'])
def test_the_palm_tells_stop_from_pointing(out_of_palm, fingers, name, side):
    motion, reader, names = lifted(POINTING, side=side), SignalReader(), set()
    for stamp, people in frames(motion, 2.3, 10):
        hand = palm_at(joints_of(motion(stamp)), side, out_of_palm, fingers)
        names |= {gesture.name for gesture in reader.update(people, stamp, UP, landmarks=hand)[0].gestures
                  if stamp > 1.3}
    assert names == {name}

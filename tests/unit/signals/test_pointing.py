"""Where a simulated body points, and what is there."""
import numpy as np
import pytest

from animated_skeleton import ADULT, CHILD, FACE, STANDING, UP, Limb, frames, held, joints_of, watch, without
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.geometry import Body
from openpose_ros_signals.person import Surroundings
from openpose_ros_signals.pointing import pointing_of, with_targets
from openpose_ros_signals.reader import SignalReader
from openpose_ros_signals.records import Pointing, Ray, Target

RIGHT = 1
WRIST = np.array([0.6, 0.0, 1.4])


def ray_from(height, sigma):
    """Return the ray from a height [m] through the wrist."""
    way = WRIST - (0.0, 0.0, height)
    return Ray(np.array([0.0, 0.0, height]), way / np.linalg.norm(way), sigma)


# Eyes and shoulder 13 cm above and below: 12 deg up and down.
AHEAD = Pointing(np.array([0.0, 0.0, 1.4]), np.array([1.0, 0.0, 0.0]), 0.23, ray_from(1.53, 0.1),
                 ray_from(1.27, 0.1))


def aimed(target, begin, stature=ADULT, side='right'):
    """Return a pose whose straight arm holds the wrist between a target (3,) [m] and a joint or the eyes."""
    def miss(way):
        pose = STANDING.with_arm(side, Limb(tuple(way), tuple(way)))
        joints = dict(zip(COCO_18.joints, joints_of(pose, stature)))
        joints['eyes'] = (joints['left_eye'] + joints['right_eye']) / 2
        to_wrist, to_target = joints[f'{side}_wrist'] - joints[begin], target - joints[begin]
        return pose, to_target / np.linalg.norm(to_target) - to_wrist / np.linalg.norm(to_wrist)
    sign, way = (1 if side == 'left' else -1), np.array([0.0, 1.0, 0.0])
    for _ in range(200):
        pose, error = miss(way)
        way = way + 0.5 * np.array([sign * error[1], error[0], error[2]])
        way = way / np.linalg.norm(way)
    assert np.linalg.norm(error) < 0.02
    return pose


def ray_of(pose, stature=ADULT, side='right'):
    signals = watch(held((0, pose)), 1, stature=stature)
    gesture = signals[-1][1].gesture('point')
    assert gesture is not None and gesture.arm == side
    return gesture.pointing


def off(ray, target):
    to = target - ray.origin
    return np.degrees(np.arccos(ray.direction @ to / np.linalg.norm(to)))


TARGETS = {'ahead': (3.0, -0.5, 1.2), 'on the floor': (1.6, -0.4, 0.0), 'up high': (2.5, -1.0, 2.2),
           'to the side': (1.0, -2.5, 1.0)}


@pytest.mark.parametrize('name, begin, side, stature', [
    ('ahead', 'eyes', 'left', ADULT), ('ahead', 'shoulder', 'right', CHILD),
    ('on the floor', 'eyes', 'right', CHILD), ('on the floor', 'shoulder', 'left', ADULT),
    ('up high', 'eyes', 'right', ADULT), ('up high', 'shoulder', 'left', CHILD),
    ('to the side', 'eyes', 'left', CHILD), ('to the side', 'shoulder', 'right', ADULT)])
def test_the_ray_of_the_true_style_meets_the_target_and_the_cone_holds_it(name, begin, side, stature):
    target = np.array(TARGETS[name]) * (1, 1 if side == 'right' else -1, stature / ADULT)
    joint = begin if begin == 'eyes' else f'{side}_shoulder'
    ray = ray_of(aimed(target, joint, stature, side), stature, side)
    own, other = (ray.eye_ray, ray.arm_ray) if begin == 'eyes' else (ray.arm_ray, ray.eye_ray)
    assert off(own, target) < 3 < 10 < off(other, target)
    # half the angle between both rays, 33 deg of an adult at the most
    assert off(ray, target) < 18.0
    assert off(ray, target) < np.degrees(ray.sigma)
    assert with_targets(ray, [Target(name, target)]).hit.name == name
    for one in (ray, own, other):
        assert np.linalg.norm(one.direction) == pytest.approx(1)


def test_the_cone_is_wider_where_joints_are_less_sure():
    joints = joints_of(STANDING.with_arm('right', Limb((0.2, 1, 0), (0.2, 1, 0))))
    def sigma(of_joints):
        body = Body(0.0, joints, np.full(18, of_joints), np.array([0.0, 0.0, 1.0]), ADULT)
        return pointing_of(body, RIGHT).sigma
    assert sigma(0.01) < sigma(0.03) < sigma(0.08)
    assert 0.05 < sigma(0.03) < 0.3


def at(angle, distance=2.0, begin=1.4):
    """Return a place at an angle over straight ahead [deg], at a distance from the axis of the body [m]."""
    return np.array([distance, 0.0, begin + distance * np.tan(np.radians(angle))])


def test_probabilities_are_those_that_a_simulation_finds():
    """People point from the eyes or the shoulder at one of three targets, and miss by the sigma of the ray."""
    random, count = np.random.default_rng(3), 200_000
    targets = [Target(str(angle), at(angle, 20.0)) for angle in (-8.0, 0.0, 11.0)]
    told = {target.name: target.probability for target in with_targets(AHEAD, targets).targets}
    hits = dict.fromkeys(told, 0)
    for ray in (AHEAD.eye_ray, AHEAD.arm_ray):
        aims = random.normal(0.0, np.degrees(ray.sigma) / np.sqrt(2), (count, 2))
        for target in targets:
            way = target.position - ray.origin
            apart = np.degrees(np.arctan2(way[2], way[0]) - np.arctan2(ray.direction[2], ray.direction[0]))
            hits[target.name] += int((np.linalg.norm(aims - (apart, 0.0), axis=1) < 1.5).sum())
    for name, number in hits.items():
        assert told[name] == pytest.approx(number / sum(hits.values()), abs=0.02)


def test_signals_tell_what_is_hit():
    target = np.array(TARGETS['ahead'])
    motion = held((0, aimed(target, 'eyes')))
    assert watch(motion, 1, around=Surroundings((Target('cup', target),)))[-1][1].gesture(
        'point').pointing.hit.name == 'cup'
    assert watch(motion, 1)[-1][1].gesture('point').pointing.hit is None


# The head does not matter for the gesture itself where the arm is stretched out sideways.
SIDEWAYS = STANDING.with_arm('right', Limb((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)))


def pointing_while_the_head_leaves(motion, seconds, headless, around):
    """Return the pointing gestures by stamp; the head is out of the image from a time on [s]."""
    reader = SignalReader()
    return {stamp: reader.update(people if stamp < headless else without(people, FACE), stamp, UP, around)[0].gesture(
        'point') for stamp, people in frames(motion, seconds, 10)}


def test_without_a_head_the_ray_ends_after_a_moment():
    found = pointing_while_the_head_leaves(held((0, SIDEWAYS)), 3, 1.0, Surroundings())
    assert all(found[stamp].pointing is not None for stamp in found if 0.2 <= stamp < 1.35)
    assert all(found[stamp] and found[stamp].pointing is None for stamp in found if stamp > 1.45)


def test_without_a_head_there_is_no_ray_of_an_earlier_gesture():
    target = np.array(TARGETS['ahead'])
    at_lamp = aimed(target, 'eyes')
    motion = held((0, at_lamp), (1.0, at_lamp), (1.2, STANDING), (1.4, STANDING), (1.5, SIDEWAYS))
    found = pointing_while_the_head_leaves(motion, 3, 1.25, Surroundings((Target('lamp', target),)))
    assert found[0.9].pointing.hit.name == 'lamp'
    later = [gesture for stamp, gesture in found.items() if stamp > 1.45 and gesture]
    assert len(later) > 5 and all(gesture.pointing is None for gesture in later)

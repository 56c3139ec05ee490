"""Where a simulated body points, and what is there."""
import numpy as np
import pytest

from animated_skeleton import ADULT, CHILD, FACE, STANDING, UP, Limb, frames, held, joints_of, watch, without
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.geometry import Body
from openpose_ros_signals.person import Surroundings
from openpose_ros_signals.pointing import hit_points, hit_target, pointing_of
from openpose_ros_signals.reader import SignalReader
from openpose_ros_signals.records import Pointing, Target

RIGHT = 1
AHEAD = Pointing(np.array([0.0, 0.0, 1.4]), np.array([1.0, 0.0, 0.0]), 0.12)


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
def test_the_ray_meets_the_target_by_the_eyes_or_by_the_arm(name, begin, side, stature):
    target = np.array(TARGETS[name]) * (1, 1 if side == 'right' else -1, stature / ADULT)
    begin = begin if begin == 'eyes' else f'{side}_shoulder'
    ray = ray_of(aimed(target, begin, stature, side), stature, side)
    # half the angle between both rays, 33 deg of an adult at the most
    assert off(ray, target) < 18.0
    assert hit_target(ray, [Target(name, target)]).name == name
    assert np.linalg.norm(ray.direction) == pytest.approx(1)


def test_the_cone_is_wider_where_joints_are_less_sure():
    joints = joints_of(STANDING.with_arm('right', Limb((0.2, 1, 0), (0.2, 1, 0))))
    def sigma(of_joints):
        body = Body(0.0, joints, np.full(18, of_joints), np.array([0.0, 0.0, 1.0]), ADULT)
        return pointing_of(body, RIGHT).sigma
    assert sigma(0.01) < sigma(0.03) < sigma(0.08)
    assert 0.05 < sigma(0.03) < 0.3


def test_the_nearest_known_target_within_the_cone_is_hit():
    near, nearer = Target('near', np.array([2.0, 0.3, 1.4])), Target('nearer', np.array([2.0, 0.1, 1.5]))
    beside = Target('beside', np.array([2.0, 1.0, 1.4]))
    behind = Target('behind', np.array([-2.0, 0.0, 1.4]))
    hit = hit_target(AHEAD, [behind, beside, near, nearer])
    assert hit.name == 'nearer' and hit.position is nearer.position
    assert hit.off == pytest.approx(np.arctan(np.hypot(0.1, 0.1) / 2.0), abs=0.002)
    assert hit_target(AHEAD, [behind, beside]) is None and hit_target(AHEAD, []) is None


def wall(distance, size=1.0):
    """Return points of a wall across x, 2 cm apart."""
    y, z = np.meshgrid(np.arange(-size, size, 0.02), 1.4 + np.arange(-size, size, 0.02))
    return np.stack([np.full(y.shape, distance), y, z], axis=-1).reshape(-1, 3)


def test_the_ray_meets_the_first_surface_beyond_the_hand():
    wrist = np.array([0.6, 0.0, 1.4])
    own_hand = np.array([[0.6, 0.0, 1.4], [0.7, 0.01, 1.4], [0.72, 0.0, 1.41], [0.75, 0.0, 1.4]])
    lone_points = np.array([[1.5, 0.0, 1.4], [np.nan, np.nan, np.nan]])
    scene = np.concatenate([wall(3.0), own_hand, lone_points])
    assert hit_points(AHEAD, scene, wrist, ADULT).position == pytest.approx([3.0, 0.0, 1.4], abs=0.01)
    assert hit_points(AHEAD, np.concatenate([scene, wall(2.0, 0.1)]), wrist, ADULT).position[0] == pytest.approx(2.0)
    assert hit_points(AHEAD, own_hand, wrist, ADULT) is None
    assert hit_points(AHEAD, np.zeros((0, 3)), wrist, ADULT) is None


def test_signals_tell_known_targets_before_points():
    target = np.array(TARGETS['ahead'])
    pose, points = aimed(target, 'eyes'), wall(3.5, 2.0)
    known = Surroundings((Target('cup', target),), points)
    for around, name in ((known, 'cup'), (Surroundings(points=points), '')):
        hit = watch(held((0, pose)), 1, around=around)[-1][1].gesture('point').pointing.hit
        assert hit.name == name
    assert watch(held((0, pose)), 1)[-1][1].gesture('point').pointing.hit is None


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

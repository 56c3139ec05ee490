"""Ways of lifting: which one is chosen, and what each makes of the joints of another one."""
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.lifting import LiftingParams, NearestSurface, WindowMean, make_lifting
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.lift.records import Expectation, Lifted
from skeleton_extract_3d.lift.robust import RobustLifting
from skeleton_extract_3d.points.depth import DepthImage
from synthetic_scene import Person, Room, pinhole, render, standing

FRAME = render(pinhole(320, 180), [Person(1, 0.1, 2.6, standing())], Room(wall=4.0))
POINTS = DepthImage(FRAME.depth, FRAME.camera)
INDEX = COCO_18.index
WRIST, KNEE = INDEX['left_wrist'], INDEX['left_knee']


def seen(people=FRAME.people):
    return observe(people, FRAME.size, POINTS, FRAME.camera)


def other_method(hidden=(), stature=METHOD.body.adult_stature):
    """Return a way of lifting that has all joints at 9 m, but the hidden ones measured."""
    measured = ~np.isin(np.arange(18), hidden)[None]

    def lift(people, points, expected):
        return Lifted(people.rays * 9.0, measured, measured | True, np.full((1, 18), 0.1), np.array([[1.0, 0, 0]]),
                      np.array([9.0]), np.array([stature]), np.zeros((1, 13, 45), np.float32))

    return SimpleNamespace(lift=lift)


def lifted(method, people=FRAME.people):
    return method.lift(seen(people), POINTS, Expectation.of_strangers(1))


@pytest.mark.parametrize('params, occlusion, kind', [
    ({}, True, RobustLifting), ({}, False, NearestSurface), ({'lifting': 'mean3x3'}, True, WindowMean),
    ({'lifting': 'mean3x3'}, False, WindowMean)])
def test_parameters_choose_the_way(params, occlusion, kind):
    method = make_lifting(LiftingParams(**params), occlusion)
    assert type(method) is kind
    none = method.lift(seen(People2D.empty(COCO_18)), POINTS, Expectation.of_strangers(0))
    assert none.xyz.shape == (0, 18, 3) and none.measured.shape == (0, 18)


def test_the_mean_of_the_window_is_where_both_see_the_joint():
    result = lifted(WindowMean(other_method(hidden=[WRIST]), 1, 'mean', occlusion=True))
    np.testing.assert_array_equal(result.measured[0], np.arange(18) != WRIST)
    u, v = np.rint(FRAME.people.xy[0, KNEE]).astype(int)
    assert result.xyz[0, KNEE, 2] == pytest.approx(FRAME.depth[v, u] / 1000)
    assert result.xyz[0, WRIST, 2] == 9.0


def test_the_nearest_surface_is_as_much_in_front_as_the_joint_lies_deep():
    scale = 0.5
    result = lifted(NearestSurface(other_method(hidden=[WRIST], stature=scale * METHOD.body.adult_stature)))
    assert result.measured.all()
    u, v = np.rint(FRAME.people.xy[0, KNEE]).astype(int)
    offset = scale * METHOD.body.surface_offsets[KNEE]
    assert result.xyz[0, KNEE, 2] == pytest.approx(FRAME.depth[v, u] / 1000 + offset, abs=0.03)


def test_a_joint_without_a_keypoint_stays_where_the_other_method_has_it():
    keypoints = FRAME.people.keypoints.copy()
    keypoints[0, WRIST] = (np.nan, np.nan, 0)
    result = lifted(NearestSurface(other_method()), replace(FRAME.people, keypoints=keypoints))
    assert not result.measured[0, WRIST] and result.xyz[0, WRIST, 2] == 9.0

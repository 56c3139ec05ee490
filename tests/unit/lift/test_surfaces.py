"""What the points say: samples around keypoints, the depth of the trunk, and the costs of a joint's depths."""
import numpy as np
import pytest

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift import surfaces

INDEX = COCO_18.index
ROOT_DEPTHS = METHOD.trunk.depths


def root_evidence(depth, foreign=None):
    return METHOD.compiled.root_evidence(depth, np.ones(depth.shape[:2]), foreign)[0]


def flat_rays(depth, scale=1.0):
    """Return rays on which the sized pairs lie as long as an adult's, turned towards nowhere, (1, 18, 3)."""
    x = {'neck': (0, 0), 'right_shoulder': (-0.1655, 0), 'left_shoulder': (0.1655, 0), 'right_hip': (-0.0935, 0.503),
         'left_hip': (0.0935, 0.503), 'right_knee': (-0.0935, 0.897), 'left_knee': (0.0935, 0.897),
         'right_ankle': (-0.0935, 1.297), 'left_ankle': (0.0935, 1.297), 'right_elbow': (-0.1655, 0.269),
         'left_elbow': (0.1655, 0.269)}
    rays = np.full((1, 18, 3), np.nan)
    for name, place in x.items():
        rays[0, INDEX[name]] = (*(np.array(place) * scale / depth), 1)
    return rays


@pytest.mark.parametrize('depth', [1.0, 2.5, 8.0])
@pytest.mark.parametrize('scale', [0.6, 1.0])
def test_an_adult_is_where_it_looks_as_large_as_adults_do(depth, scale):
    size = surfaces.size_depth(flat_rays(depth, scale), np.ones((1, 18)))
    np.testing.assert_allclose(size, depth / scale, rtol=0.02)


def test_samples_of_others_do_not_tell_where_a_person_is():
    depth, foreign = np.full((1, 18, 25), 2.0), np.ones((1, 18, 25), bool)
    depth[0, :2], foreign[0, :2] = 3.5, False
    assert 3.1 < ROOT_DEPTHS[root_evidence(depth, foreign).argmax()] < 4.0
    assert 1.6 < ROOT_DEPTHS[root_evidence(depth).argmax()] < 2.5


@pytest.mark.parametrize('offset', [0.0, 0.05, 0.115])
def test_a_joint_is_cheapest_so_deep_under_its_surface(offset):
    full = np.ones((1, 18))
    cost = METHOD.compiled.depth_costs(np.full((1, 18, 25), 2.5), full, np.array([2.5]), offset * full, 0.08 * full,
                                       full, full < 0, None)
    assert cost.dtype == np.float32 and cost.shape == (1, 18, METHOD.costs.steps)
    assert (cost.min(axis=2) == 0).all()
    # half a step
    assert METHOD.costs.deltas[cost[0, INDEX['left_wrist']].argmin()] == pytest.approx(offset, abs=0.021)


def test_the_size_speaks_for_its_depth_and_less_against_nearer_ones():
    evidence = surfaces.size_evidence(np.array([3.0]), np.array([0.12]))[0]
    assert ROOT_DEPTHS[evidence.argmax()] == pytest.approx(3.0, rel=METHOD.trunk.step)
    nearer, further = (np.interp(depth, ROOT_DEPTHS, evidence) for depth in (3.0 / 1.2, 3.0 * 1.2))
    # people may be turned away or bent, which makes them look smaller and never larger
    assert 0 > nearer > 0.5 * further


@pytest.mark.parametrize('values, median', [
    ([np.nan, np.inf], np.nan), ([3.0], 3.0), ([5.0, 1.0, 3.0], 3.0), ([4.0, 1.0, 3.0, 2.0], 2.0),
    ([np.nan, 2.0, -np.inf, 7.0, np.inf], 2.0)])
def test_lower_median_is_of_the_finite_values(values, median):
    np.testing.assert_equal(surfaces.lower_median(np.array(values)), np.float64(median))


def test_lower_median_is_along_the_last_axis():
    values = np.moveaxis(np.arange(24.0).reshape(4, 2, 3), 0, 2)  # as a view that is not contiguous
    np.testing.assert_array_equal(surfaces.lower_median(values), [[6, 7, 8], [9, 10, 11]])
    assert surfaces.lower_median(np.zeros((0, 18, 25))).shape == (0, 18)

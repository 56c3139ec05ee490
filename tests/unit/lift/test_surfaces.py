"""What the points say: samples around keypoints, the depth of the trunk, and the costs of a joint's depths."""
from types import SimpleNamespace

import numpy as np
import pytest

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.records import Ownership, Skin
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage

CAMERA = CameraModel(64, 36, [36.0, 0, 31.5, 0, 36.0, 17.5, 0, 0, 1])
INDEX = COCO_18.index
WRIST = INDEX['left_wrist']
DELTAS, ROOT_DEPTHS = METHOD.costs.deltas, METHOD.trunk.depths


def image(z):
    return DepthImage(np.asarray(z, np.float32), CAMERA)


def samples(people=1, depth=2.5):
    """Return windows whose samples are all of one depth, (P, 18, 25) [m]."""
    return np.full((people, 18, 25), float(depth))


def root_evidence(depth, scores, foreign=None):
    return METHOD.compiled.root_evidence(depth, scores, foreign)


def seen(depth, scores=None):
    """Return what steps read of observed people, with these samples (P, 18, 25)."""
    return SimpleNamespace(samples=depth, scores=np.ones(depth.shape[:2]) if scores is None else scores)


def costs(depth, offset=0.05, gap=0.08, root=2.5, score=1.0, own=1.0, covered=False, foreign=None):
    """Return the costs of (1, 18, 25) samples with the same of the rest for all joints, (18, 45)."""
    full = np.full((1, 18), 1.0)
    return surfaces.depth_costs(seen(depth, score * full), np.array([root]), Skin(offset * full, gap * full),
                                Ownership(own * full, np.full((1, 18), covered), foreign))[0]


def depth_of(cost, root=2.5):
    return root + DELTAS[cost.argmin()]


# --- samples --------------------------------------------------------------------------------------------------------

def test_no_people():
    assert surfaces.window_depths(image(np.ones((36, 64))), np.zeros((0, 18, 2)), np.zeros(0)).shape == (0, 18, 25)
    assert surfaces.size_depth(np.zeros((0, 18, 3)), np.zeros((0, 18))).shape == (0,)
    assert root_evidence(np.zeros((0, 18, 25)), np.zeros((0, 18))).shape == (0, len(ROOT_DEPTHS))
    none = np.zeros((0, 18))
    skin, ownership = Skin(none, none), Ownership(none, none > 0, None)
    costs_of_none = surfaces.depth_costs(seen(np.zeros((0, 18, 25))), np.zeros(0), skin, ownership)
    assert costs_of_none.shape == (0, 18, METHOD.costs.steps)


# --- size -----------------------------------------------------------------------------------------------------------

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
    # somewhat nearer, since errors of keypoints make the longest bones longer
    np.testing.assert_allclose(size, 0.97 * depth / scale, rtol=0.02)


# --- depth of the trunk ---------------------------------------------------------------------------------------------


def test_samples_of_others_do_not_tell_where_a_person_is():
    depth, foreign = samples(1, 2.0), np.ones((1, 18, 25), bool)
    depth[0, :2], foreign[0, :2] = 3.5, False
    best = ROOT_DEPTHS[root_evidence(depth, np.ones((1, 18)), foreign)[0].argmax()]
    assert 3.1 < best < 4.0
    without = ROOT_DEPTHS[root_evidence(depth, np.ones((1, 18)))[0].argmax()]
    assert 1.6 < without < 2.5


# --- depths of joints -----------------------------------------------------------------------------------------------

@pytest.mark.parametrize('offset', [0.0, 0.05, 0.115])
def test_a_joint_is_cheapest_so_deep_under_its_surface(offset):
    cost = costs(samples(), offset)
    assert cost.dtype == np.float32 and cost.shape == (18, METHOD.costs.steps)
    assert (cost.min(axis=1) == 0).all()
    # half a step
    assert depth_of(cost[WRIST]) == pytest.approx(2.5 + offset, abs=0.021)

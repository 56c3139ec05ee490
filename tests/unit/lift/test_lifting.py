"""Lifting: the joint's window in the cloud, at borders, holes and other resolutions."""
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.lift.window_mean import lift_by_window
from skeleton_extract_3d.people import MISSING
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.depth import DepthImage

K = len(COCO_18.joints)
W, H = 96, 54


def one_person(*joints):
    """A person with the first joints at (x, y), confidence 0.5, 0.51, ..."""
    keypoints = np.full((1, K, 3), np.nan)
    keypoints[..., 2] = 0
    for i, (x, y) in enumerate(joints):
        keypoints[0, i] = (x, y, 0.5 + i / 100)
    return People2D(COCO_18, keypoints, [1.0], [4])


def pixel_cloud(width=W, height=H):
    """A cloud whose points name their pixel: (u, v, 1 + u + 1000 v)."""
    v, u = np.mgrid[:height, :width].astype(np.float32)
    return np.stack([u, v, 1 + u + 1000 * v])


def lifted(points, *joints, size=(W, H), **params):
    cloud = points if isinstance(points, DepthImage) else OrganizedCloud(*points)
    return lift_by_window(one_person(*joints), size, cloud, **params)


def test_no_people():
    people = lift_by_window(People2D.empty(COCO_18), (W, H), OrganizedCloud(*pixel_cloud()))
    assert people.xyz.shape == (0, K, 3)


def test_ids_and_existence_stay():
    people = lift_by_window(replace(one_person((40, 20)), existence=[0.75]), (W, H), OrganizedCloud(*pixel_cloud()))
    assert (people.ids.tolist(), people.existence.tolist()) == ([4], [0.75])


@pytest.mark.parametrize('x, y', [(-0.51, 20), (W - 0.5, 20), (40, -0.51), (40, H - 0.5), (-1e9, 0), (1e9, 1e9)])
def test_outside_the_image_a_joint_is_missing_though_its_window_reaches_inside(x, y):
    people = lifted(pixel_cloud(), (x, y), window=31)
    assert people.status[0, 0] == MISSING
    assert people.confidence[0, 0] == 0.5


@pytest.mark.parametrize('hole', [np.nan, np.inf, -np.inf, 0.0])
def test_holes_do_not_count(hole):
    cloud = pixel_cloud()
    cloud[:, 19:22, 39:42] = hole
    cloud[:, 21, 41] = (41, 21, 7)
    np.testing.assert_allclose(lifted(cloud, (40, 20)).xyz[0, 0], [41, 21, 7])
    np.testing.assert_allclose(lifted(cloud, (40, 20), statistic='median').xyz[0, 0], [41, 21, 7])


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 3, 5]), st.floats(0, 1))
def test_both_statistics_are_those_of_numpy(seed, window, holes):
    rng = np.random.default_rng(seed)
    cloud = rng.normal(3, 1, (3, H, W))
    cloud[:, rng.random((H, W)) < holes] = np.nan
    pixels = rng.integers((0, 0), (W, H), (K, 2))
    for statistic, reference in (('mean', np.mean), ('median', np.median)):
        people = lifted(cloud, *pixels, window=window, statistic=statistic)
        for (u, v), xyz in zip(pixels, people.xyz[0]):
            reach = window // 2
            patch = cloud[:, max(v - reach, 0):v + reach + 1, max(u - reach, 0):u + reach + 1].reshape(3, -1)
            patch = patch[:, np.isfinite(patch).all(axis=0)]
            expected = reference(patch, axis=1) if patch.size else np.full(3, np.nan)
            np.testing.assert_allclose(xyz, expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize('scale', [2, 3])
def test_in_a_cloud_of_other_resolution_the_same_place_is_found(scale):
    # image pixels 2 u and 2 u + 1 lie in pixel u of a cloud of half the size
    joints = [(scale * 30, scale * 10), (scale * 31 - 1, scale * 11 - 1), (0, 0), (scale * W - 1, scale * H - 1)]
    people = lifted(pixel_cloud(), *joints, size=(scale * W, scale * H), window=1)
    np.testing.assert_array_equal(people.xyz[0, :4, :2], [[30, 10], [30, 10], [0, 0], [W - 1, H - 1]])
    up = lifted(pixel_cloud(scale * W, scale * H), (30, 10), window=1)
    assert (np.abs(up.xyz[0, 0, :2] - (scale * 30.5 - 0.5, scale * 10.5 - 0.5)) <= 0.5).all()

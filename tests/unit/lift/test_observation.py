"""What a frame shows of people: keypoints on the grid of the points, rays, and samples of the surfaces."""
from functools import lru_cache

import numpy as np
import pytest

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from synthetic_scene import Person, Room, pinhole, render, standing, without_joints

INDEX = COCO_18.index


@lru_cache(maxsize=None)
def scene():
    return render(pinhole(320, 180), [Person(1, 0.1, 2.6, standing()), Person(2, -1.0, 3.4, standing(), scale=0.6)],
                  Room(wall=4.0))


def look(frame, people=None, size=None, camera=None):
    camera = camera or frame.camera
    return observe(frame.people if people is None else people, size or frame.size,
                   DepthImage(frame.depth, camera), camera)


def without(*joints):
    frame = scene()
    return without_joints(frame.people, np.tile(np.isin(COCO_18.joints, joints), (len(frame.people), 1)))


def test_no_people():
    seen = look(scene(), People2D.empty(COCO_18))
    assert seen.uv.shape == (0, 18, 2) and seen.rays.shape == (0, 18, 3) and seen.samples.shape == (0, 18, 25)
    assert seen.adult_depth.shape == (0,) and seen.known_rays.shape == (0, 18, 3)


def test_rays_lead_to_the_joints():
    frame, seen = scene(), look(scene())
    np.testing.assert_array_equal(seen.known, np.ones((2, 18), bool))
    np.testing.assert_array_equal(seen.scores, np.ones((2, 18)))
    np.testing.assert_allclose(seen.rays * frame.xyz[..., 2:], frame.xyz, atol=1e-5)
    assert seen.focal == pytest.approx(180)


def test_the_middle_of_a_window_is_the_surface_at_the_keypoint():
    frame, seen = scene(), look(scene())
    u, v = np.rint(frame.people.xy).astype(int).transpose(2, 0, 1)
    np.testing.assert_allclose(seen.samples[..., 12], frame.depth[v, u] / 1000)
    # of a person who is seen from the front, all joints lie less than 12 cm under it
    assert (np.abs(frame.xyz[..., 2] - seen.samples[..., 12]) < 0.12).all()


def test_a_missing_joint_has_a_guess_near_the_next_one_towards_the_trunk():
    seen, whole = look(scene(), without('left_wrist', 'left_hip', 'nose')), look(scene())
    missing = [INDEX[name] for name in ('left_wrist', 'left_hip', 'nose')]
    assert not seen.known[:, missing].any() and not seen.scores[:, missing].any()
    assert np.isnan(seen.uv[:, missing]).all() and np.isnan(seen.known_rays[:, missing]).all()
    assert np.isnan(seen.samples[:, missing]).all()
    assert np.isfinite(seen.rays).all()
    np.testing.assert_allclose(seen.rays[:, INDEX['left_wrist']], whole.rays[:, INDEX['left_elbow']])
    np.testing.assert_allclose(seen.rays[:, INDEX['left_hip']], whole.rays[:, INDEX['right_hip']])
    kept = np.setdiff1d(np.arange(18), missing)
    np.testing.assert_array_equal(seen.rays[:, kept], whole.rays[:, kept])


def test_keypoints_outside_the_picture_have_a_ray_but_no_surface():
    frame = scene()
    keypoints = frame.people.keypoints.copy()
    keypoints[0, INDEX['left_wrist'], :2] = (-40, 90)
    seen = look(frame, People2D(COCO_18, keypoints, [1, 1], [-1, -1]))
    assert seen.known[0, INDEX['left_wrist']] and np.isnan(seen.samples[0, INDEX['left_wrist']]).all()
    assert seen.rays[0, INDEX['left_wrist'], 0] == pytest.approx((-40 - 159.5) / 180)


def test_a_keypoint_that_no_ray_reaches_counts_as_missing():
    frame = scene()
    # a lens that folds the picture back on itself beyond 28 degrees: nothing is seen at its corners
    lens = CameraModel(320, 180, frame.camera.matrix, 'plumb_bob', [-1.2, 0, 0, 0, 0])
    keypoints = frame.people.keypoints.copy()
    keypoints[0, INDEX['left_wrist'], :2] = (318, 2)
    seen = look(frame, People2D(COCO_18, keypoints, [1, 1], [-1, -1]), camera=lens)
    wrist = INDEX['left_wrist']
    assert not seen.known[0, wrist] and seen.scores[0, wrist] == 0 and np.isnan(seen.uv[0, wrist]).all()
    assert np.isfinite(seen.rays).all()
    assert seen.known[0, INDEX['neck']]

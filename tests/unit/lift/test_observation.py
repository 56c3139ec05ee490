"""What a frame shows of people: keypoints on the grid of the points, rays, and samples of the surfaces."""
import numpy as np
import pytest

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from synthetic_scene import Person, Room, pinhole, render, standing

INDEX = COCO_18.index


WRIST = INDEX['left_wrist']
FRAME = render(pinhole(320, 180), [Person(1, 0.1, 2.6, standing()), Person(2, -1.0, 3.4, standing(), scale=0.6)],
               Room(wall=4.0))


def look(people, camera=FRAME.camera):
    return observe(people, FRAME.size, DepthImage(FRAME.depth, camera), camera)


def with_wrist_at(x, y):
    keypoints = FRAME.people.keypoints.copy()
    keypoints[0, WRIST, :2] = x, y
    return People2D(COCO_18, keypoints, [1, 1], [-1, -1])


def test_keypoints_outside_the_picture_have_a_ray_but_no_surface():
    seen = look(with_wrist_at(-40, 90))
    assert seen.known[0, WRIST] and np.isnan(seen.samples[0, WRIST]).all()
    assert seen.rays[0, WRIST, 0] == pytest.approx((-40 - 159.5) / 180)


def test_a_keypoint_that_no_ray_reaches_counts_as_missing():
    # a lens that folds the picture back on itself beyond 28 degrees: nothing is seen at its corners
    lens = CameraModel(320, 180, FRAME.camera.matrix, 'plumb_bob', [-1.2, 0, 0, 0, 0])
    seen = look(with_wrist_at(318, 2), lens)
    assert not seen.known[0, WRIST] and seen.scores[0, WRIST] == 0 and np.isnan(seen.uv[0, WRIST]).all()
    assert np.isfinite(seen.rays).all()
    assert seen.known[0, INDEX['neck']]

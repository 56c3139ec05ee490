"""What must not matter to the 3D estimator: handedness, order of people, resolution, units, the origin of time."""
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pytest

from estimating import new_estimator
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.depth import DepthImage, cloud_from_depth
from synthetic_scene import (
    Box,
    Person,
    Room,
    moved_pixels,
    pinhole,
    render,
    standing,
    walking,
    waving,
    with_flying_pixels,
    with_holes,
    with_noise,
)

RATE = 10.0
SWAP = np.array(COCO_18.swap)
SEEDS = (0, 1)


class Input(NamedTuple):
    """What an estimator is given of one frame."""

    people: People2D
    size: tuple
    depth: np.ndarray
    camera: CameraModel
    bgr: np.ndarray


@lru_cache(maxsize=None)
def scene(seed, overlooked=True):
    """Return 25 frames of three people: one waves, one walks by behind, one turns behind a box.

    The detector overlooks joints, and, if `overlooked`, two of them in some frames.
    """
    rng, chance = np.random.default_rng(seed), np.random.default_rng(100 + seed)
    camera, room = pinhole(320, 180), Room(wall=5.0, furniture=(Box((0.6, 0.5, 1.8), (1.6, 1.2, 2.0)),))
    frames = []
    for i in range(25):
        x = -1.2 + 0.09 * i + 0.1 * seed
        frame = render(camera, [
            Person(0, -0.2, 2.3, waving(i / 3), shirt=(60, 180, 60)),
            Person(1, x, 3.4, walking(2 * np.pi * x / 1.4), yaw=1.2, shirt=(50, 50, 200)),
            Person(2, 1.2, 2.8, standing(20), yaw=0.1 * i, shirt=(200, 90, 40), scale=0.9)], room, seed=i)
        gone = np.array([False, i in (6, 7, 8), i in (15, 16)]) & overlooked
        dropped = chance.random(frame.people.present.shape) < 0.05
        people = moved_pixels(frame.people, rng, sigma=0.7)
        keypoints = people.keypoints.copy()
        keypoints[dropped] = (np.nan, np.nan, 0)
        people = People2D(COCO_18, keypoints[~gone], people.scores[~gone], people.ids[~gone])
        depth = with_holes(with_flying_pixels(with_noise(frame.depth, rng), rng), 0.05, rng)
        frames.append(Input(people, frame.size, depth, camera, frame.bgr))
    return frames


def run(frames, start=100.0, points=None):
    """Return the estimates of frames in a row, from a new estimator; `points(frame)` replaces the depth image."""
    estimator = new_estimator()
    points = points or (lambda frame: DepthImage(frame.depth, frame.camera))
    return [estimator.update(frame.people, Frame('', start + i / RATE, frame.bgr, points(frame)))
            for i, frame in enumerate(frames)]


@lru_cache(maxsize=None)
def answers(seed):
    """Return the estimates of a scene as it is."""
    return run(scene(seed))


def mirrored(frame):
    """Return the input that the camera would give in a mirror."""
    keypoints = frame.people.keypoints[:, SWAP].copy()
    keypoints[..., 0] = frame.size[0] - 1 - keypoints[..., 0]
    matrix = frame.camera.matrix.copy()
    matrix[0, 2] = frame.size[0] - 1 - matrix[0, 2]
    camera = CameraModel(frame.camera.width, frame.camera.height, matrix)
    return Input(replace(frame.people, keypoints=keypoints), frame.size, frame.depth[:, ::-1], camera,
                 frame.bgr[:, ::-1])


def assert_same(first, other, atol):
    """Fail unless two runs say the same of all people, within `atol` [m]."""
    for i, (one, two) in enumerate(zip(first, other)):
        assert len(one.people_2d) == len(two.people_2d), f'frame {i}'
        one, two = one.people, two.people
        np.testing.assert_array_equal(one.ids, two.ids, f'frame {i}')
        np.testing.assert_array_equal(one.status, two.status, f'frame {i}')
        np.testing.assert_allclose(one.xyz, two.xyz, rtol=0, atol=atol, err_msg=f'frame {i}')
        np.testing.assert_allclose(one.sigma, two.sigma, rtol=0.02, atol=atol, err_msg=f'frame {i}')


@pytest.mark.parametrize('seed', SEEDS)
def test_in_a_mirror_left_is_right_and_nothing_else_changes(seed):
    # surfaces of people who are overlooked are sampled from left to right
    turned, frames = [], scene(seed, overlooked=False)
    for estimate in run([mirrored(frame) for frame in frames]):
        people = estimate.people
        turned.append(replace(estimate, people=replace(
            people, xyz=people.xyz[:, SWAP] * np.array([-1, 1, 1]), status=people.status[:, SWAP],
            sigma=people.sigma[:, SWAP])))
    assert_same(run(frames), turned, atol=1e-3)


def test_the_unit_of_depth_and_the_kind_of_points_do_not_matter():
    metres = [frame._replace(depth=frame.depth.astype(np.float32) / 1000) for frame in scene(0)]
    assert_same(answers(0), run(metres), atol=1e-3)

    def cloud(frame):
        points = cloud_from_depth(frame.depth / 1000, frame.camera, frame.bgr)
        return OrganizedCloud(points['x'], points['y'], points['z'])

    assert_same(answers(0), run(scene(0), points=cloud), atol=2e-3)


@pytest.mark.parametrize('start', [0.0, 1.7e9])
def test_the_origin_of_time_does_not_matter(start):
    # stamps of today are good to a microsecond in float64
    assert_same(answers(0), run(scene(0), start=start), atol=1e-3)

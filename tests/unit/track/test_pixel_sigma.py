"""The standard deviation that a network tells of a keypoint becomes that of the joint in space."""
import numpy as np
import pytest

from estimating import new_estimator, update
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from synthetic_scene import Person, Room, pinhole, render, standing

SCENE = render(pinhole(480, 270), [Person(1, 0.1, 2.6, standing())], Room(wall=4.0))
WRIST, ELBOW = COCO_18.index['left_wrist'], COCO_18.index['left_elbow']
SHAPE = (1, len(COCO_18.joints), 2)


def estimate(sigmas=None, frames=4):
    """Return the people of the last frame by pixels of a standard deviation [px]; None: unknown."""
    people = SCENE.people
    people = People2D(people.skeleton, people.keypoints, people.scores, people.ids, sigmas=sigmas)
    estimator = new_estimator()
    for i in range(frames):
        result = update(estimator, SCENE, i / 15, people)
    return result.people


def told(**of_joints):
    """Return standard deviations of some joints, both axes alike."""
    sigmas = np.full(SHAPE, np.nan)
    for name, value in of_joints.items():
        sigmas[0, COCO_18.index[name]] = value
    return sigmas


def test_a_wrist_is_as_uncertain_as_its_pixel():
    unsure, sure, plain = estimate(told(left_wrist=20.0)), estimate(told(left_wrist=0.5)), estimate()
    # 20 px are 19 cm at 2.6 m
    assert unsure.sigma[0, WRIST] > 2 * plain.sigma[0, WRIST] and 0.1 < unsure.sigma[0, WRIST] < 0.35
    # a network can not know how far its joint is from the true one
    assert sure.sigma[0, WRIST] == plain.sigma[0, WRIST]
    assert unsure.sigma[0, ELBOW] == pytest.approx(plain.sigma[0, ELBOW], rel=0.3)


def test_pixels_of_a_larger_image_are_smaller():
    people = SCENE.people
    keypoints = people.keypoints * [2, 2, 1] + [0.5, 0.5, 0]
    double = People2D(people.skeleton, keypoints, people.scores, people.ids, sigmas=told(left_wrist=40.0))
    width, height = SCENE.size
    estimator = new_estimator()
    for i in range(4):
        result = update(estimator, SCENE, i / 15, double, bgr=None, size=(2 * width, 2 * height))
    assert result.people.sigma[0, WRIST] == pytest.approx(estimate(told(left_wrist=20.0)).sigma[0, WRIST], rel=0.02)


def test_halves_of_a_person_keep_what_is_told_of_their_joints():
    upper = np.isin(np.arange(18), [COCO_18.index[name] for name in (
        'nose', 'neck', 'left_shoulder', 'right_shoulder', 'left_elbow', 'right_elbow', 'left_wrist', 'right_wrist')])
    estimator, whole = new_estimator(), SCENE.people.keypoints
    for i in range(4):
        update(estimator, SCENE, i / 15)
    halves = np.concatenate([np.where(part[:, np.newaxis], whole, np.float32((np.nan, np.nan, 0)))
                             for part in (upper, ~upper)])
    sigmas = np.where(halves[..., 2:] > 0, np.array([2.0, 5.0])[:, np.newaxis, np.newaxis], np.nan).repeat(2, axis=2)
    points = np.full((2, 133, 3), (np.nan, np.nan, 0))
    points[1, 91:112] = 7
    people = People2D(COCO_18, halves, [1.0, 1.0], [-1, -1], sigmas=sigmas, points=points)
    result = update(estimator, SCENE, 4 / 15, people).people_2d
    assert len(result) == 1
    np.testing.assert_array_equal(result.sigmas[0, :, 0], np.where(upper, 2, 5))
    assert (result.points[0, 91:112] == 7).all()

"""Each camera has an estimator of its own, and no two people have one id."""
import numpy as np
import pytest

from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import CameraFrame
from skeleton_extract_3d.points.camera_estimators import CameraEstimators
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.settings import EstimatorSettings
from synthetic_scene import Person, Room, pinhole, render, standing

SETTINGS = build(EstimatorSettings, {})
FRAME = render(pinhole(320, 180), [Person(0, 0.1, 2.6, standing())], Room(wall=4.0))
POINTS = DepthImage(FRAME.depth, FRAME.camera)


@pytest.fixture
def cameras():
    return CameraEstimators(COCO_18, SETTINGS)


def test_nobody_is_seen(cameras):
    assert len(cameras.update(People2D.empty(COCO_18), POINTS, 'left', 0.0, FRAME.bgr).people) == 0


def test_it_gives_what_an_estimator_gives(cameras):
    alone = PeopleEstimator(SETTINGS)
    for stamp in (0.0, 0.1):
        estimate = cameras.update(FRAME.people, POINTS, 'left', stamp, FRAME.bgr)
        expected = alone.update(FRAME.people, CameraFrame(FRAME.size, POINTS, stamp, FRAME.bgr))
        np.testing.assert_array_equal(estimate.people.xyz, expected.people.xyz)


def test_ids_are_given_out_once_for_all_cameras(cameras):
    ids = [cameras.update(FRAME.people, POINTS, camera, 0.0, FRAME.bgr).people.ids.tolist()
           for camera in ('left', 'right', 'left')]
    assert ids == [[0], [1], [0]]


def test_new_parameters_hold_for_all_cameras(cameras):
    cameras.update(FRAME.people, POINTS, 'left', 0.0, FRAME.bgr)
    cameras.reconfigure(build(EstimatorSettings, {'tracking': False, 'lifting': 'mean3x3'}))
    for camera in ('left', 'new'):
        people = cameras.update(FRAME.people, POINTS, camera, 0.1, FRAME.bgr).people
        # the ids are those of the detections
        assert people.ids.tolist() == FRAME.people.ids.tolist()
        assert np.isnan(people.velocity).all()

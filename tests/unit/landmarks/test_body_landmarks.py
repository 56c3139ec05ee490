"""Landmarks of bodies: the crop and the way back by a stand-in, MediaPipe's refinement, and the network itself."""
import cv2
import numpy as np
import pytest

from openpose_ros_pkg.landmarks.body_landmarks import (
    BodyLandmarkNetwork,
    create_body_landmarks,
    refined,
    region_of_body,
)
from openpose_ros_pkg.networks.backends import BackendParams
from openpose_ros_pkg.networks.model_registry import POSE_LANDMARK
from openpose_ros_pkg.networks.proof import _truth
from openpose_ros_pkg.people import keypoints_in
from openpose_ros_pkg.skeletons import BLAZEPOSE_33, COCO_17, COCO_18
from optional_weights import need_weights

SIDE, LOW = 256, -20.0
# A person upright in metres, x to the right and y down, from the middle of the hips.
BODY = {'nose': (0.0, -0.7), 'right_shoulder': (-0.2, -0.5), 'left_shoulder': (0.2, -0.5), 'right_hip': (-0.1, 0.0),
        'left_hip': (0.1, 0.0), 'right_ankle': (-0.1, 0.8), 'left_ankle': (0.15, 0.8)}


class DotReader:
    """Sees the dots that `scene` paints in crops, each as a point of the body; depth and score are as it is told."""

    fallback, description, score = '', 'dot reader', 0.9

    def infer_many(self, images):
        return [self._output(image[0].astype(float)) for image in images]

    def _output(self, image):
        points, world = np.zeros((39, 5)), np.zeros((39, 3))
        for k, name in enumerate(BLAZEPOSE_33.joints):
            if name in BODY:
                weight = image[..., 1] * (np.abs(image[..., 2] - image[..., 1] * colour(name) / 250) < 4)
                weight = np.where(weight > 120, weight, 0)
                v, u = np.indices(weight.shape)
                points[k, :2] = [(axis * weight).sum() / weight.sum() + 0.5 for axis in (u, v)]
                world[k, :2] = (points[k, :2] - SIDE / 2) / 100
        world[:, 2] = np.arange(39)
        points[:33, 3], points[:33, 4] = 0.0, LOW
        return (points.reshape(1, -1), np.array([[self.score]]), np.full((1, 64, 64, 39), LOW), world.reshape(1, -1))


def colour(name):
    return 30 * list(BODY).index(name) + 20


def scene(angle, centre=(320, 240), pixels=150):
    """Return an image, the keypoints of the person in it, turned clockwise by an angle [rad]; black beyond."""
    image = np.zeros((480, 640, 3), np.uint8)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    keypoints = np.full((1, 18, 3), (np.nan, np.nan, 0), np.float32)
    for name, xy in BODY.items():
        x, y = np.round(turn @ xy * pixels + centre).astype(int).tolist()
        cv2.circle(image, (x, y), 6, (0, 250, colour(name)), -1)
        keypoints[0, COCO_18.index[name]] = x, y, 0.8
    return image, keypoints


@pytest.mark.parametrize('degrees', [0, 30, 90, 180, -120])
def test_points_come_back_from_the_turned_crop_to_their_pixels_and_places_to_the_axes_of_the_image(degrees):
    image, keypoints = scene(np.radians(degrees))
    found, = BodyLandmarkNetwork(DotReader()).observe(image, keypoints, COCO_18)
    hips = keypoints[0, [COCO_18.index['left_hip'], COCO_18.index['right_hip']], :2].mean(axis=0)
    side = region_of_body(keypoints[0], COCO_18).side
    for name in BODY:
        k, true = BLAZEPOSE_33.index[name], keypoints[0, COCO_18.index[name], :2]
        assert np.abs(found.points[k] - true).max() < 0.3, name
        assert found.world[k, :2] == pytest.approx((true - hips) * SIDE / side / 100, abs=0.01), name
        assert found.world[k, 2] == k
    assert found.visibility == pytest.approx(0.5)
    assert found.score == 0.9


def test_region_is_mediapipes_circle_round_the_hips_with_the_shoulders_above():
    _, keypoints = scene(np.radians(90))
    region = region_of_body(keypoints[0], COCO_18)
    farthest = np.hypot(0.15, 0.8) * 150
    assert (region.x, region.y) == pytest.approx((320, 240), abs=1)
    assert region.side == pytest.approx(2 * 1.25 * 1.14 * farthest, rel=0.02)
    assert np.degrees(region.angle) == pytest.approx(90, abs=1)


def test_no_landmarks_without_people_hips_shoulders_or_a_sure_network():
    network = BodyLandmarkNetwork(DotReader())
    image, keypoints = scene(0.0)
    assert network.observe(image, np.zeros((0, 18, 3), np.float32), COCO_18) == []
    for part in ('hip', 'shoulder'):
        lacking = keypoints.copy()
        lacking[0, [COCO_18.index[f'left_{part}'], COCO_18.index[f'right_{part}']]] = np.nan, np.nan, 0
        first, second = network.observe(image, np.concatenate([lacking, keypoints]), COCO_18)
        assert first is None and second is not None
    network = BodyLandmarkNetwork(DotReader())
    network._network.score = 0.49
    assert network.observe(image, keypoints, COCO_18) == [None]


def test_refinement_is_mediapipes():
    maps = np.full((64, 64, 5), LOW)
    maps[20:22, 10, :4] = 3.0  # two cells
    maps[40, 40, 4] = -0.1  # below the confidence of .5
    at = np.array([(11.5, 20.5), (13.9, 20.5), (14.1, 20.5), (-0.1, 20.5), (40.5, 40.5)]) / 64
    expected = np.array([(10, 20.5), (10, 20.5), (14.1, 20.5), (-0.1, 20.5), (40.5, 40.5)]) / 64
    # cells 3 away count, from 4 on they do not; beyond the input and without confidence a point stays
    assert refined(at, maps) == pytest.approx(expected, abs=1e-5)


@pytest.fixture(scope='module')
def network():
    pytest.importorskip('openvino', reason='openvino is not installed: pip install openvino')
    need_weights(POSE_LANDMARK)
    return create_body_landmarks(BackendParams())


@pytest.mark.parametrize('degrees', [0, 90])
def test_the_network_finds_joints_and_feet_of_a_known_picture_upright_and_turned(network, degrees):
    truth = _truth()
    turns = degrees // 90
    bgr, joints = np.rot90(truth.bgr, -turns), truth.joints
    if turns:
        joints = np.stack([truth.bgr.shape[0] - 1 - joints[..., 1], joints[..., 0]], axis=2)
    true = np.full((len(joints), 33, 2), np.nan)
    for name, xy in zip(truth.names, np.moveaxis(joints, 1, 0)):
        if name in BLAZEPOSE_33.index:
            true[:, BLAZEPOSE_33.index[name]] = xy
    keypoints = np.concatenate([true, np.ones((len(true), 33, 1))], axis=2)
    found = network.observe(np.ascontiguousarray(bgr), keypoints_in(keypoints, BLAZEPOSE_33, COCO_17), COCO_17)
    for person, xy in zip(found, true):
        apart = np.linalg.norm(person.points - xy, axis=1)
        body = np.linalg.norm(xy[BLAZEPOSE_33.index['left_shoulder']] - xy[BLAZEPOSE_33.index['left_ankle']])
        assert np.nanmedian(apart) < 0.04 * body and np.nanmax(apart) < 0.08 * body
        assert person.score > 0.9 and person.visibility[np.isfinite(apart)].min() > 0.7
        # down in the image, or to the left where the picture is turned clockwise, are the feet
        down = np.array((0.0, 1.0)) if not turns else np.array((-1.0, 0.0))
        feet = [BLAZEPOSE_33.index[f'{side}_ankle'] for side in ('left', 'right')]
        assert (person.world[feet, :2] @ down > 0.4).all()
    sits = found[1].world
    assert sits[BLAZEPOSE_33.index['left_knee'], 2] < -0.1  # knees are nearer to the camera than hips

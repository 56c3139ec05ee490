"""Decoders of networks that find people themselves: positions, joint names, thresholds, duplicates."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.decode.direct import DirectThresholds, decode_direct
from openpose_ros_pkg.networks.model_registry import MODELS, MOVENET_MULTIPOSE
from openpose_ros_pkg.networks.model_types import YOLO_INPUT
from openpose_ros_pkg.networks.preprocess import ImageToNet
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18

RTMO = MODELS['rtmo_s']
YOLO = replace(RTMO, decoder='yolo_pose', input=YOLO_INPUT, outputs=())
SIZE = (256, 192)
WHOLE = ImageToNet(SIZE, SIZE, SIZE)
# Pixels of a standing person of 100 px, in COCO's order of the joints.
STANDING = np.array([
    (50, 10), (53, 7), (47, 7), (57, 9), (43, 9), (62, 25), (38, 25), (68, 42), (32, 42), (70, 58), (30, 58), (58, 60),
    (42, 60), (59, 82), (41, 82), (60, 104), (40, 104)], float)


def moved(x, y):
    """The same person elsewhere."""
    return STANDING + np.array([x, y])


def movenet_rows(*people):
    """(6, 56) as MoveNet gives it, of (17, 2) pixels, joint scores and person scores; the other rows are empty."""
    rows = np.zeros((6, 56), np.float32)
    for row, (pixels, joints, score) in zip(rows, people):
        shares = (pixels + 0.5) / SIZE
        row[0:51:3], row[1:51:3], row[2:51:3], row[55] = shares[:, 1], shares[:, 0], joints, score
        row[51:55] = [*shares.min(axis=0)[::-1], *shares.max(axis=0)[::-1]]
    return (rows,)


def rtmo_outputs(*people):
    """Boxes (N, 5) and keypoints (N, 17, 3), of (17, 2) pixels, joint scores and person scores."""
    boxes, joints = np.zeros((len(people), 5), np.float32), np.zeros((len(people), 17, 3), np.float32)
    for box, joint, (pixels, confidence, score) in zip(boxes, joints, people):
        box[:] = [*pixels.min(axis=0), *pixels.max(axis=0), score]
        joint[:, :2], joint[:, 2] = pixels, confidence
    return boxes, joints


def yolo_rows(*people):
    """Boxes x1, y1, x2, y2 (N, 4), scores (N,) and joints (N, 51) in pixels from the corner of the first one.

    The score of a joint is its visibility times the score of the person.
    """
    pixels = np.array([person[0] for person in people]).reshape(-1, 17, 2) + 0.5
    visibility = np.array([np.broadcast_to(person[1], 17) / person[2] for person in people]).reshape(-1, 17, 1)
    boxes = np.concatenate([pixels.min(axis=1), pixels.max(axis=1)], axis=1)
    return boxes, np.array([person[2] for person in people]), np.concatenate([pixels, visibility], 2).reshape(-1, 51)


def yolo_raw(*people):
    """(56, N): the people, and empty cells."""
    boxes, scores, joints = yolo_rows(*people)
    output = np.zeros((56, 84), np.float32)
    output[:2, :len(people)], output[2:4, :len(people)] = (boxes[:, :2] + boxes[:, 2:]).T / 2, (
        boxes[:, 2:] - boxes[:, :2]).T
    output[4, :len(people)], output[5:, :len(people)] = scores, joints.T
    return (output,)


def yolo_end_to_end(*people):
    """(N, 57): the people, and rows that are not used."""
    boxes, scores, joints = yolo_rows(*people)
    output = np.zeros((300, 57), np.float32)
    output[:len(people)] = np.column_stack([boxes, scores, np.zeros(len(people)), joints])
    return (output,)




def decoder(outputs, model):
    """Return what decodes people, as a network gives them."""
    def decode(*people, params=None, valid=SIZE):
        return decode_direct(outputs(*people), model, params or DirectThresholds(), ImageToNet(valid, valid, SIZE))
    return decode


DECODERS = {'MoveNet': decoder(movenet_rows, MOVENET_MULTIPOSE), 'RTMO': decoder(rtmo_outputs, RTMO),
            'YOLO raw': decoder(yolo_raw, YOLO), 'YOLO end to end': decoder(yolo_end_to_end, YOLO)}
ALL = pytest.mark.parametrize('decode', DECODERS.values(), ids=DECODERS)


def place(keypoints, joint):
    return keypoints[COCO_18.index[joint]]


@ALL
def test_no_person(decode):
    keypoints, scores, *_ = decode()
    assert keypoints.shape == (0, 18, 3) and scores.shape == (0,)
    assert keypoints.dtype == scores.dtype == np.float32


@ALL
def test_every_joint_lands_where_it_is_under_its_name(decode):
    confidence = np.linspace(0.3, 0.9, 17)
    keypoints, scores, *_ = decode((STANDING, confidence, 0.8))
    assert keypoints.shape == (1, 18, 3) and scores[0] == pytest.approx(0.8)
    people = People2D(COCO_18, keypoints, scores, [-1])  # which checks missing joints
    order = ('nose', 'left_eye', 'right_eye', 'left_ear', 'right_ear', 'left_shoulder', 'right_shoulder', 'left_elbow',
             'right_elbow', 'left_wrist', 'right_wrist', 'left_hip', 'right_hip', 'left_knee', 'right_knee',
             'left_ankle', 'right_ankle')
    for joint, pixel, score in zip(order, STANDING, confidence):
        np.testing.assert_allclose(place(people.keypoints[0], joint), [*pixel, score], atol=1e-4)


@ALL
def test_neck_is_between_the_shoulders_and_as_sure_as_the_less_sure(decode):
    confidence = np.full(17, 0.9)
    confidence[5], confidence[6] = 0.8, 0.4
    keypoints, *_ = decode((STANDING, confidence, 0.8))
    np.testing.assert_allclose(place(keypoints[0], 'neck'), [50, 25, 0.4], atol=1e-4)


@ALL
def test_joints_in_the_padding_and_beyond_the_picture_are_missing(decode):
    pixels = STANDING.copy()
    pixels[9], pixels[10], pixels[15] = (120.6, 58), (-0.6, 58), (60, 104.4)  # wrists, left ankle
    keypoints, *_ = decode((pixels, np.full(17, 0.9), 0.9), valid=(121, 105))
    assert np.isnan(place(keypoints[0], 'left_wrist')[0]) and np.isnan(place(keypoints[0], 'right_wrist')[0])
    np.testing.assert_allclose(place(keypoints[0], 'left_ankle'), [60, 104.4, 0.9], atol=1e-4)


@ALL
def test_joint_below_its_threshold_is_missing_and_without_joints_there_is_no_person(decode):
    confidence = np.full(17, 0.2)
    confidence[0] = 0.5
    params = DirectThresholds(joint_score=0.3)
    keypoints, *_ = decode((STANDING, confidence, 0.9), params=params)
    assert (keypoints[0, :, 2] > 0).sum() == 1
    assert len(decode((STANDING, np.full(17, 0.2), 0.9), params=params)[0]) == 0


@pytest.mark.parametrize('decode, threshold', list(zip(DECODERS.values(), (0.15, 0.7, 0.25, 0.25))), ids=DECODERS)
def test_person_score_is_that_of_the_network_unless_demanded(decode, threshold):
    people = [(STANDING, np.full(17, 0.9), threshold - 0.01), (moved(120, 0), np.full(17, 0.9), threshold + 0.01)]
    assert decode(*people)[1] == pytest.approx([threshold + 0.01])
    assert len(decode(*people, params=DirectThresholds(person_score=0.05))[1]) == 2


@ALL
def test_the_same_person_twice_is_one_the_surer_one(decode):
    people = [(moved(1, 1), np.full(17, 0.9), 0.75), (STANDING, np.full(17, 0.9), 0.9)]
    keypoints, scores, *_ = decode(*people)
    np.testing.assert_allclose(scores, [0.9], atol=1e-6)
    np.testing.assert_allclose(place(keypoints[0], 'nose')[:2], [50, 10], atol=1e-4)


def test_of_overlapping_boxes_rtmo_keeps_the_surer():
    both = [(STANDING, np.full(17, 0.9), 0.8), (moved(8, 0), np.full(17, 0.9), 0.9)]  # overlap 2/3
    assert DECODERS['RTMO'](*both)[1] == pytest.approx([0.9])
    apart = [(STANDING, np.full(17, 0.9), 0.8), (moved(20, 0), np.full(17, 0.9), 0.9)]  # 1/3
    assert len(DECODERS['RTMO'](*apart)[1]) == 2



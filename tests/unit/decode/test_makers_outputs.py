"""Our decoders against the makers' own code on the same tensors.

mmpose 1.3.2, rtmlib 0.0.16 and PaddleDetection (deploy/python/keypoint_postprocess.py, HRNetPostProcess) wrote
makers_outputs.npz, in environments of their own.
"""
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import makers_tensors
from openpose_ros_pkg.decode.boxes import decode_boxes
from openpose_ros_pkg.decode.direct import DirectThresholds, decode_direct
from openpose_ros_pkg.decode.one_person import heat_map_points
from openpose_ros_pkg.detect.views import View
from openpose_ros_pkg.networks.backends.arrays import network_input
from openpose_ros_pkg.networks.model_registry import MODELS
from openpose_ros_pkg.networks.model_types import SIMCC_INPUT, skeleton_of
from openpose_ros_pkg.networks.preprocess import ImageToNet
from openpose_ros_pkg.skeletons import COCO_17, POINT_SETS

MAKERS = dict(np.load(str(Path(__file__).parent / 'makers_outputs.npz')))
# All that has a score, in float32 of both.
ALL, TOLERANCE = DirectThresholds(joint_score=0.0, person_score=1e-6), {'rtol': 1e-5, 'atol': 1e-5}


def people(decoder, tensors, size, points=17):
    """People in pixels of an image of a size, which is that of the input, and their joint set."""
    model = replace(MODELS['rtmo_s'], decoder=decoder, points=points, skeleton=skeleton_of(points))
    view = View(ImageToNet(size, size, size))
    poses = decode_direct([tensor[0] for tensor in tensors], model, ALL, view.plan)
    return view.in_image(poses, model.skeleton), model.skeleton


@pytest.mark.parametrize('name', makers_tensors.SIMCC)
def test_simcc_as_mmpose(name):
    points, size = makers_tensors.SIMCC[name]
    poses, skeleton = people('simcc', makers_tensors.simcc(name), size, points)
    expected = MAKERS[f'simcc_{name}'][0]
    there = expected[:, 2] > 0
    assert 0 < there.sum() < points and (expected[~there, :2] == -0.5).all()  # a missing place is -1 of the bins
    expected = np.where(there[:, None], np.minimum(expected, (np.inf, np.inf, 1)), (np.nan, np.nan, 0))
    source = POINT_SETS[points]
    for joint, found in zip(skeleton.joints, poses.keypoints[0]):
        if joint == 'neck' or (points != 26 and joint == 'mid_hip'):
            ends = [source.index[f'{side}_{"shoulder" if joint == "neck" else "hip"}'] for side in ('left', 'right')]
            np.testing.assert_allclose(found[:2], expected[ends, :2].mean(axis=0), **TOLERANCE)
            assert found[2] == (0 if np.isnan(found[0]) else pytest.approx(expected[ends, 2].min()))
        else:
            np.testing.assert_allclose(found, expected[source.index[joint]], **TOLERANCE)
    assert poses.scores[0] == pytest.approx(expected[:17, 2].mean())
    assert (poses.points is None) == (points != 133)
    if points == 133:
        np.testing.assert_allclose(poses.points[0], expected, **TOLERANCE)


def test_input_of_simcc_as_mmpose():
    ours = network_input(MAKERS['image'][np.newaxis], SIMCC_INPUT)
    np.testing.assert_allclose(ours, MAKERS['simcc_input'], atol=2e-6)


def test_heat_maps_as_paddle_detection():
    """Four pixels of the input for each cell; scores of people are squares."""
    expected = MAKERS['heat_maps']
    found = heat_map_points(makers_tensors.heat_maps()[0])
    np.testing.assert_allclose(found, expected, **TOLERANCE)
    assert (expected[:, :2] % 1 != 0).all(axis=1).sum() > 10, 'places between cells'
    poses, skeleton = people('heat_maps', (makers_tensors.heat_maps(),), (192, 256))
    left_knee = COCO_17.index['left_knee']
    np.testing.assert_allclose(poses.keypoints[0, skeleton.index['left_knee']],
                               [*(4 * expected[left_knee, :2]), expected[left_knee, 2] ** 2], **TOLERANCE)


def test_large_boxes_of_yolox_as_rtmlib():
    """Places of rtmlib are from the corner of the first pixel, ours from its middle."""
    found = decode_boxes([tensor[0] for tensor in makers_tensors.yolox_end_to_end()], 0.0, makers_tensors.YOLOX_SIZE)
    expected = MAKERS['yolox_end_to_end']
    assert 20 < len(expected) < 50 and (np.diff(found.scores) <= 0).all()
    assert set(map(tuple, np.round(found.boxes + 0.5, 3))) == set(map(tuple, np.round(expected, 3)))
    found = decode_boxes([makers_tensors.yolox()[0]], 0.0, makers_tensors.YOLOX_SIZE)
    expected = MAKERS['yolox_raw']
    assert len(found.boxes) == len(expected) > 20
    np.testing.assert_allclose(found.boxes + 0.5, expected, rtol=1e-5, atol=1e-3)

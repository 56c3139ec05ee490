"""Our decoders against the makers' own code on the same tensors.

mmpose 1.3.2, rtmlib 0.0.16, rfdetr 1.11.2, DETRPose a6ca202d: development/benchmarks/makers_outputs.py.
"""
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import makers_tensors
from openpose_ros_pkg.decode.boxes import decode_boxes
from openpose_ros_pkg.decode.direct import DirectDecodeParams, decode_direct
from openpose_ros_pkg.detect.views import View
from openpose_ros_pkg.networks.backends.arrays import network_input
from openpose_ros_pkg.networks.model_registry import MODELS
from openpose_ros_pkg.networks.model_types import SIMCC_INPUT, skeleton_of
from openpose_ros_pkg.networks.preprocess import ImageToNet
from openpose_ros_pkg.skeletons import COCO_17, POINT_SETS

MAKERS = dict(np.load(str(Path(__file__).parent / 'makers_outputs.npz')))
# All that has a score, in float32 of both.
ALL, TOLERANCE = DirectDecodeParams(direct_joint_score=0.0, direct_person_score=1e-6), {'rtol': 1e-5, 'atol': 1e-5}


def people(decoder, tensors, size, points=17, image=None):
    """People in pixels of an image of a size, None: that of the input, which it fills; and their joint set."""
    model = replace(MODELS['rtmo_s'], decoder=decoder, points=points, skeleton=skeleton_of(points))
    view = View(ImageToNet(image or size, size, size))
    poses = decode_direct([tensor[0] for tensor in tensors], model, ALL, view.plan)
    return view.in_image(poses, model.skeleton), model.skeleton


def joints_in_order(poses, skeleton):
    """(P, 17, 3) in COCO's order."""
    return poses.keypoints[:, [skeleton.index[joint] for joint in COCO_17.joints]]


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


@pytest.mark.parametrize('image', makers_tensors.IMAGES)
@pytest.mark.parametrize('form', ['with its post-processor', 'without', 'not deployed'])
def test_detr_pose_as_its_makers(form, image):
    logits, joints = makers_tensors.detr_pose()
    exported = [MAKERS[f'detr_shares_{part}'][None] for part in ('scores', 'labels', 'joints')]
    tensors = {'with its post-processor': exported, 'without': (logits, joints),
               'not deployed': (logits, joints.reshape(1, -1, 34))}
    poses, skeleton = people('detr_pose', tensors[form], makers_tensors.DETR_SIZE, image=image)
    theirs = MAKERS[f'detr_{image[0]}_joints']
    # A query comes once for each class there; the second time is the same person.
    _, first = np.unique(theirs[:, 0, 0], return_index=True)
    first = np.sort(first)
    found = joints_in_order(poses, skeleton)
    count = len(first)
    assert count > 40 and len(found) >= count  # its 60 pairs of query and class leave queries out, ours takes them all
    np.testing.assert_allclose(poses.scores[:count], MAKERS[f'detr_{image[0]}_scores'][first], **TOLERANCE)
    np.testing.assert_allclose(found[:count, :, :2], theirs[first], rtol=1e-5, atol=1e-3)
    np.testing.assert_allclose(found[:count, :, 2], np.repeat(poses.scores[:count, None], 17, axis=1))


@pytest.mark.parametrize('image', makers_tensors.IMAGES)
def test_rf_detr_as_its_makers(image):
    poses, skeleton = people('rf_detr', makers_tensors.rf_detr(), makers_tensors.RF_SIZE, image=image)
    order = np.argsort(-MAKERS['rf_scores'], kind='stable')
    assert len(order) > 50
    np.testing.assert_allclose(poses.scores, MAKERS['rf_scores'][order], **TOLERANCE)
    found = joints_in_order(poses, skeleton)
    np.testing.assert_allclose(found, MAKERS[f'rf_{image[0]}_joints'][order], rtol=1e-5, atol=1e-3)
    variances = np.moveaxis(MAKERS[f'rf_{image[0]}_covariances'][order], (2, 3), (0, 1))[[0, 1], [0, 1]]
    sigmas = poses.sigmas[:, [skeleton.index[joint] for joint in COCO_17.joints]]
    np.testing.assert_allclose(sigmas, np.sqrt(np.moveaxis(variances, 0, 2)), rtol=1e-4)


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

"""The report's section on motion capture, by people that are where they should be, or beside it."""
import numpy as np
import pytest

from common import DEMO
from openpose_ros_pkg.skeletons import COCO_18, MESSAGE_JOINTS
from scoring.figures import figures
from sections.rendered.mocap import score_trajectories, statistics
from simulated_mocap import sequence_truth
from skeleton_extract_3d.people import MEASURED, People3D

JOINTS = [MESSAGE_JOINTS.index(joint) for joint in COCO_18.joints]


def found(offset):
    """Return the figures of the shipped sequence with true people, moved in the frame of the camera [m]."""
    truth = sequence_truth(DEMO).joints
    frames = []
    for number, seconds in enumerate(truth.times):
        positions = truth.positions[:, number][:, JOINTS]
        there = np.flatnonzero(np.isfinite(positions).all(axis=(1, 2)))
        shape = len(there), len(JOINTS)
        frames.append((seconds, People3D(
            COCO_18, positions[there].astype(np.float32) + np.float32(offset), np.ones(shape, np.float32),
            np.full(shape, MEASURED, np.uint8), np.full(shape, 0.02, np.float32), there)))
    return figures([score_trajectories(DEMO, frames)], statistics(), resamples=0)


def test_true_people():
    values = found((0, 0, 0))
    assert values['knees_vertical_all_rmse'].value == pytest.approx(0, abs=0.01)
    assert values['knee_angle_visible_rmse'].value == pytest.approx(0, abs=0.01)
    assert values['head_medio_lateral_visible_r'].value == pytest.approx(1, abs=1e-4)
    # one of two people is hidden by the other for a quarter of the time
    assert values['head_vertical_visible_rmse'].n < values['head_vertical_all_rmse'].n


def test_people_beside():
    """30 mm to the right in the image are medio-lateral, and gone with the offset."""
    values = found((0.03, 0, 0))
    assert values['trunk_medio_lateral_all_rmse'].value == pytest.approx(30, abs=0.01)
    assert values['trunk_medio_lateral_all_centred'].value == pytest.approx(0, abs=0.01)
    assert values['trunk_vertical_all_rmse'].value == pytest.approx(0, abs=0.01)
    assert values['elbow_angle_all_rmse'].value == pytest.approx(0, abs=0.01)

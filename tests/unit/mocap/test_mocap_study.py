"""Figures of trajectories and angles agree with movements that are written down."""
import dataclasses

import cv2
import numpy as np
import pytest

from known_tables import known_table
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.alignment.alignment import AlignmentParams, align
from openpose_ros_tools.mocap.evaluation import compare
from openpose_ros_tools.mocap.joints import JointRecording
from openpose_ros_tools.mocap.study import AXES, anatomical_axes, study
from simulated_mocap import STANDING
from skeleton_extract_3d.people import INFERRED

# One whole period of a movement, so that means and correlations are exact.
FRAMES, RATE = 60, 30.0
PHASE = 2 * np.pi * np.arange(FRAMES) / FRAMES
# From the camera's optical frame (x right, y down, z away) to the frame of `STANDING` (z up): it looks along -x.
FACING = np.array([[0, 0, -1], [1, 0, 0], [0, -1, 0]], float)
KNEE = MESSAGE_JOINTS.index('left_knee')


def standing():
    """A person who stands still, (F, K, 3) [m]."""
    points = np.full((FRAMES, len(MESSAGE_JOINTS), 3), np.nan)
    for name, place in STANDING.items():
        points[:, MESSAGE_JOINTS.index(name)] = place
    return points


def comparison(estimate, truth):
    """Compare a person's joints (F, K, 3), both in the frame of the reference and by its clock."""
    table = known_table(np.rint(np.arange(FRAMES) * 1e9 / RATE).astype(np.int64), np.ones(FRAMES, int), estimate,
                        MESSAGE_JOINTS)
    reference = JointRecording(('Ann',), np.arange(FRAMES) / RATE, truth[None])
    return compare(table, reference, align(table.measured(), reference, AlignmentParams(0.0, (np.eye(3), np.zeros(3)))))


def figures(estimate, truth):
    return study(comparison(estimate, truth), FACING)['answered']


@pytest.mark.parametrize('rotation', [FACING, FACING @ cv2.Rodrigues(np.array([0.4, 0, 0]))[0]])
def test_axes_of_a_camera_that_people_face(rotation):
    """Also of one that looks down by 23 degrees."""
    found = anatomical_axes(comparison(standing(), standing()), rotation)
    np.testing.assert_allclose(found, [(0, 1, 0), (0, 0, 1), (-1, 0, 0)], atol=1e-9)


def test_camera_above_the_people():
    """It sees their feet at the lower border of the image: that is where antero-posterior comes from."""
    down = np.array([[0, -1, 0], [-1, 0, 0], [0, 0, -1]], float).T
    found = anatomical_axes(comparison(standing(), standing()), down)
    np.testing.assert_allclose(found[1:], [(0, 0, 1), (1, 0, 0)], atol=1e-9)


def test_known_offset():
    """All joints 30 mm to the side, 40 mm up and 20 mm away; they move in the same way."""
    truth = standing() + 0.1 * np.sin(PHASE)[:, None, None]
    found = figures(truth + np.array([-0.02, 0.03, 0.04]), truth)
    for axis, offset in zip(AXES, (30, 40, 20)):
        one = found['elbows and wrists'][axis]
        assert one['rmse'] == pytest.approx(offset, abs=0.01)
        assert one['rmse_without_offset'] == pytest.approx(0, abs=0.01)
        assert one['r'] == pytest.approx(1, abs=1e-5) and one['motion'] == pytest.approx(1e2 / np.sqrt(2), abs=0.01)


def test_known_delay():
    """A swing of 100 mm, 30 degrees of its period late: r = cos(30), RMSE = 100 sqrt(2) sin(15)."""
    truth, late = standing(), standing()
    truth[..., 1] += 0.1 * np.sin(PHASE)[:, None]
    late[..., 1] += 0.1 * np.sin(PHASE - np.pi / 6)[:, None]
    found = figures(late, truth)['head']
    assert found['medio-lateral']['r'] == pytest.approx(np.cos(np.pi / 6), abs=1e-4)
    assert found['medio-lateral']['rmse'] == pytest.approx(100 * np.sqrt(2) * np.sin(np.pi / 12), abs=0.01)
    assert found['vertical']['r'] is None and found['vertical']['rmse'] == pytest.approx(0, abs=1e-3)


def legs(bend):
    """Return a person whose left knee bends by angles (F,) [deg], in the plane of x and z."""
    body = standing()
    body[:, KNEE] = (0, 0.1, 0.48)
    body[:, MESSAGE_JOINTS.index('left_ankle')] = np.stack(
        [-0.4 * np.sin(np.radians(bend)), np.full(FRAMES, 0.1), 0.48 - 0.4 * np.cos(np.radians(bend))], axis=1)
    return body


def test_known_angles():
    """One knee is bent by 10 degrees too much, the other stands still and is right."""
    bend = 30 + 20 * np.sin(PHASE)
    found = figures(legs(bend + 10), legs(bend))
    assert found['knee']['angle']['rmse'] == pytest.approx(10 / np.sqrt(2), abs=0.01)
    assert found['knee']['angle']['rmse_without_offset'] == pytest.approx(0, abs=0.01)
    assert found['knee']['angle']['motion'] == pytest.approx(20 / np.sqrt(2) / 2, abs=0.01)
    assert found['hip']['angle']['rmse'] == pytest.approx(0, abs=0.01)


def test_inferred_joints_are_told_apart():
    """A knee 80 mm off that is inferred is not among the measured, nor are angles with it."""
    estimate = standing()
    estimate[:, KNEE, 2] += 0.08
    found = comparison(estimate, standing())
    status = found.status.copy()
    status[:, found.joints.index('left_knee')] = INFERRED
    values = study(dataclasses.replace(found, status=status), FACING)
    answered, measured = values['answered'], values['measured']
    assert answered['knees']['vertical']['rmse'] == pytest.approx(80 / np.sqrt(2), abs=0.01)
    assert measured['knees']['vertical']['rmse'] == pytest.approx(0, abs=1e-3)
    assert (answered['knee']['angle']['samples'], measured['knee']['angle']['samples']) == (2 * FRAMES, FRAMES)

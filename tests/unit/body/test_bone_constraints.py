"""Bones pull joints to where lengths agree, each as far as it is uncertain."""
import numpy as np
import pytest

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.body import JOINTS
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.track.joint_filter import isotropic
from synthetic_scene import Person, joints_of, standing

INDEX = COCO_18.index
TRUE = np.array([[0.37, 0.19, 0.51, 0.21, 0.29, 0.25, 0.42, 0.42]])  # in the order of BONES


def person():
    """Return the joints of a person whose bones are as long as in TRUE, (1, 18, 3) [m]."""
    joints = joints_of(Person(1, 0.2, 2.6, standing(20)), 1.2)
    return np.array([[joints[name] for name in JOINTS]])


def satisfied(xyz, sigma, usable):
    return METHOD.compiled.satisfy_lengths(xyz, isotropic(np.full((1, 18), sigma)), TRUE, np.full((1, 8), 0.03), usable)


def test_a_bone_is_one_more_measurement():
    # scalar Kalman update: both ends 3 cm per axis uncertain, the length 0.03 * 0.25 m
    xyz = person()
    direction = xyz[0, INDEX['left_wrist']] - xyz[0, INDEX['left_elbow']]
    xyz[0, INDEX['left_wrist']] += 0.04 * direction / np.linalg.norm(direction)
    usable = np.isin(JOINTS, ('left_wrist', 'left_elbow'))[None]
    moved = satisfied(xyz, 0.03 * np.sqrt(3), usable) - xyz
    share = 0.03 ** 2 / (2 * 0.03 ** 2 + (0.03 * 0.25) ** 2)
    assert np.linalg.norm(moved[0, INDEX['left_wrist']]) == pytest.approx(0.04 * share)
    np.testing.assert_allclose(moved[0, INDEX['left_elbow']], -moved[0, INDEX['left_wrist']], atol=1e-12)

"""True joints of a sequence as a motion capture file: against curves that are known between the images."""
import json
from pathlib import Path

import numpy as np
import pytest

from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.mocap.files import read_mocap
from openpose_ros_tools.mocap.joints import joints_of
from openpose_ros_tools.mocap.marker_map import read_marker_map
from truth_as_mocap import main, read_truth, resample, rigid_transform

SHIPPED = Path(__file__).resolve().parents[3] / 'skeleton_extract_3d' / 'demo' / 'cross'
RATE = 15.0


def curve(times, joint):
    """Return the place of a joint that sways by 0.2 m within 2 s, (..., 3) [m]."""
    phase = np.pi * np.asarray(times) + 0.3 * joint
    return np.stack([0.2 * np.sin(phase), 0.2 * np.cos(phase), 2 + 0 * phase], axis=-1)


@pytest.fixture()
def folder(tmp_path):
    """Person 3 is there all the time, person 7 from frame 5 to 9, in frame 15 alone, and from frame 20."""
    frames = []
    for i in range(30):
        people = [3] + [7] * (5 <= i < 10 or i == 15 or i >= 20)
        frames.append({'i': i, 't': round(i / RATE, 6), 'people': [
            {'id': person, 'xyz': [curve(i / RATE, joint).tolist() for joint in range(18)]} for person in people]})
    (tmp_path / 'gt.json').write_text(json.dumps({'joints': list(COCO_18.joints), 'frames': frames}))
    return tmp_path


def test_it_follows_the_curve_between_the_images(folder):
    joints = resample(read_truth(folder), 120.0, clock_offset=12.345)
    np.testing.assert_allclose(joints.times * 120, np.rint(joints.times * 120), atol=1e-9)
    assert joints.times[0] >= 12.345 > joints.times[0] - 1 / 120
    # a natural bound for splines of 15 Hz on a motion of 0.5 Hz
    expected = curve(joints.times[:, None] - 12.345, np.arange(18))
    np.testing.assert_allclose(joints.positions[0, :, :18], expected, atol=2e-4)


def test_transforms_by_hand():
    np.testing.assert_allclose(rigid_transform((90, 0, 0), (1, 2, 3)) @ [0, 1, 0, 1], [1, 2, 4, 1], atol=1e-12)
    np.testing.assert_allclose(rigid_transform((0, 90, 0), (0, 0, 0)) @ [0, 0, 1, 1], [1, 0, 0, 1], atol=1e-12)
    # first about x, then about z
    np.testing.assert_allclose(rigid_transform((90, 0, 90), (0, 0, 0)) @ [1, 2, 3, 1], [3, 1, 2, 1], atol=1e-12)


def test_the_shipped_sequence_comes_back(tmp_path):
    out = tmp_path / 'cross.trc'
    assert main([str(SHIPPED), str(out), '--rate', '30', '--clock-offset', '2', '--rotate-degrees', '90', '-20', '30',
                 '--move', '-1', '2', '0.5']) == 0
    joints, truth = joints_of(read_mocap(out), read_marker_map('joint_names')), read_truth(SHIPPED)
    assert joints.subjects == truth.subjects
    transform = rigid_transform((90, -20, 30), (-1, 2, 0.5))
    expected = truth.positions[:, :, :18] @ transform[:3, :3].T + transform[:3, 3]
    # gt.json has its times in microseconds, in which people move less than 10 um
    np.testing.assert_allclose(joints.times[::2] - 2, truth.times, atol=2e-6)
    np.testing.assert_allclose(joints.positions[:, ::2, :18], expected, atol=1e-5)

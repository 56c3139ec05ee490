"""True joints of a sequence as a motion capture file: against curves that are known between the images."""
from pathlib import Path

import numpy as np

from openpose_ros_tools.mocap.files import read_mocap
from openpose_ros_tools.mocap.joints import joints_of
from openpose_ros_tools.mocap.marker_map import read_marker_map
from truth_as_mocap import main, read_truth, rigid_transform

SHIPPED = Path(__file__).resolve().parents[3] / 'skeleton_extract_3d' / 'demo' / 'cross'


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

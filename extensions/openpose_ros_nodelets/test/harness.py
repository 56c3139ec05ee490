"""What the tests of the nodelets share: clouds of known points."""
import sys
from pathlib import Path
from typing import Sequence

import numpy as np
import rospy
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

sys.path.append(str(Path(__file__).resolve().parents[3] / 'tests/support'))

FRAME_ID = 'test_optical_frame'


def cloud(xyz: np.ndarray, stamp: rospy.Time, offsets: Sequence[int] = (0, 4, 8), point_step: int = 32,
          padding: int = 0) -> PointCloud2:
    """Return the message of (H, W, 3) float32 points [m].

    Args:
        offsets, point_step: where x, y and z lie in a point, and its size [bytes].
        padding: bytes between the rows.
    """
    height, width = xyz.shape[:2]
    dtype = np.dtype({'names': list('xyz'), 'formats': ['<f4'] * 3, 'offsets': list(offsets), 'itemsize': point_step})
    points = np.zeros((height, width), dtype)
    for i, axis in enumerate('xyz'):
        points[axis] = xyz[..., i]
    rows = np.full((height, width * point_step + padding), 0x5a, np.uint8)
    rows[:, :width * point_step] = points.view(np.uint8).reshape(height, -1)
    fields = [PointField(name=axis, offset=offset, datatype=PointField.FLOAT32, count=1)
              for axis, offset in zip('xyz', offsets)]
    return PointCloud2(header=Header(stamp=stamp, frame_id=FRAME_ID), height=height, width=width, fields=fields,
                       point_step=point_step, row_step=rows.shape[1], data=rows.tobytes())

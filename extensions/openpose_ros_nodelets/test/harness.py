"""What the tests of the nodelets share: clouds of known points, sent to a nodelet and to a program of it."""
import sys
import unittest
from pathlib import Path
from typing import Sequence

import numpy as np
import rospy
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

sys.path.append(str(Path(__file__).resolve().parents[3] / 'tests/support'))

from session import Diagnostics

FRAME_ID = 'test_optical_frame'
NAMESPACES = ('managed', 'alone')


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


class NodeletTest(unittest.TestCase):
    """A test that sends clouds to <namespace>/points, each with a stamp of its own."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_nodelets')
        cls.diagnostics, cls.last = Diagnostics(), rospy.Time(1000)
        cls.clouds = cls.publishers('points', PointCloud2)

    @staticmethod
    def publishers(topic, kind, **options):
        return {ns: rospy.Publisher(f'/{ns}/{topic}', kind, queue_size=10, **options) for ns in NAMESPACES}

    def send(self, ns, message, after=1 / 30):
        """Publish a cloud, so many seconds after the last one by its stamp, and return that."""
        type(self).last += rospy.Duration.from_sec(after)
        message.header.stamp = self.last
        self.clouds[ns].publish(message)
        return self.last

"""What the tests of the nodes of clouds share: clouds of known points, sent to one of two nodes."""
import sys
import unittest
from pathlib import Path

import numpy as np
import rospy
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

sys.path.append(str(Path(__file__).resolve().parents[3] / 'tests/support'))

from session import Diagnostics

FRAME_ID = 'test_optical_frame'


def cloud(xyz: np.ndarray) -> PointCloud2:
    """Return the message of (H, W, 3) float32 points [m]."""
    points = np.zeros((*xyz.shape[:2], 8), np.float32)
    points[..., :3] = xyz
    fields = [PointField(name=axis, offset=4 * i, datatype=PointField.FLOAT32, count=1) for i, axis in enumerate('xyz')]
    return PointCloud2(header=Header(frame_id=FRAME_ID), height=points.shape[0], width=points.shape[1], fields=fields,
                       point_step=32, row_step=32 * points.shape[1], data=points.tobytes())


class CloudTest(unittest.TestCase):
    """A test that sends clouds to <namespace>/points, each with a stamp of its own."""

    NAMESPACES = ('managed', 'alone')

    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_clouds')
        cls.diagnostics, cls.last = Diagnostics(), rospy.Time(1000)
        cls.clouds = cls.publishers('points', PointCloud2)

    @classmethod
    def publishers(cls, topic, kind, **options):
        return {ns: rospy.Publisher(f'/{ns}/{topic}', kind, queue_size=10, **options) for ns in cls.NAMESPACES}

    def send(self, ns, message, after=1 / 30):
        """Publish a cloud, so many seconds after the last one by its stamp, and return that."""
        type(self).last += rospy.Duration.from_sec(after)
        message.header.stamp = self.last
        self.clouds[ns].publish(message)
        return self.last

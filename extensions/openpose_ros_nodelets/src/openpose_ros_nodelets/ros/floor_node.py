"""The floor in a point cloud: a plane, and a frame of tf."""
import time
from typing import Dict, Optional

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from pcl_msgs.msg import ModelCoefficients
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from openpose_ros_nodelets.floor import Floor, FloorParams, FloorTracker, find_floor
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.stream.frame_loop import NewestWinsWorker
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.transforms import Transforms

# About as many points of a cloud are read, evenly over its rows and columns.
_POINTS = 12000
# Greatest angle of the floor's normal from `up`, and with `gravity_frame` [degrees].
_TOLERANCE, _GRAVITY_TOLERANCE = 40.0, 10.0
# The floor is sought this often, by the stamps of the clouds [Hz].
_RATE = 5.0
# Until frames that others publish are heard after the start [s], as of the rig of openpose_ros_fusion.
_SETTLING = 2.0


class FloorNode:
    """Finds the floor in clouds, organized or not; publishes ~plane and, with `publish_tf`, its frame."""

    def __init__(self, params: FloorParams) -> None:
        self._params, self._tracker = params, FloorTracker()
        self._found: Optional[Floor] = None  # in the newest cloud
        self._frame: Optional[TransformStamped] = None  # where the floor was seen last: people may hide it
        self._sought = rospy.Time()
        self._health = Health(bad_input='bad clouds')
        self._health.show(self._values)
        self._begin, self._is_alone = time.monotonic(), False
        self._transforms = Transforms(0.0) if self._params.gravity_frame or self._params.publish_tf else None
        self._broadcaster = tf2_ros.TransformBroadcaster() if self._params.publish_tf else None
        demand = Demand(params.lazy and not params.publish_tf, self._health)
        self._planes = demand.advertise('~plane', ModelCoefficients, queue_size=1)
        clouds = InputSubscriber('points', PointCloud2)
        clouds.registerCallback(NewestWinsWorker(self._process, self._health.frame_failed, 'clouds').submit)
        demand.read(clouds)
        introduce(demand.inputs)

    def _values(self) -> Dict[str, str]:
        floor = self._found
        if floor is None:
            return {'height [m]': 'none'}
        return {'height [m]': f'{floor.height:.3f}', 'height, standard deviation [m]': f'{floor.height_sigma:.4f}',
                'tilt, standard deviation [deg]': f'{np.degrees(floor.tilt_sigma):.3f}',
                'share of points on the floor': f'{floor.share:.3f}', 'area that is seen [m^2]': f'{floor.area:.2f}'}

    def _process(self, cloud: PointCloud2) -> None:
        header = cloud.header
        if header.stamp.is_zero():
            raise BadInputError('it has no stamp')
        since = (header.stamp - self._sought).to_sec()
        if since < 0:
            self._frame = None
        try:
            if since < 0 or since > 0.9 / _RATE:  # a tenth of a period early is in time, as stamps jitter
                self._sought = header.stamp
                self._seek(cloud)
        finally:
            if self._broadcaster is not None and self._frame is not None:
                self._send_frame(header)

    def _seek(self, cloud: PointCloud2) -> None:
        """Find the floor in a cloud, and publish it if it is known."""
        up, tolerance = self._params.upwards, _TOLERANCE
        if self._params.gravity_frame:
            newest = self._transforms.newest(cloud.header.frame_id, self._params.gravity_frame)
            up, tolerance = convert.rotation_and_translation(newest)[0][:, 2], _GRAVITY_TOLERANCE
        found, fault = find_floor(convert.sampled_points(cloud, _POINTS), up, np.radians(tolerance), self._params)
        if found is None and self._params.publish_tf:
            self._health.warn('floor not seen', fault)  # readers of tf, such as RViz, wait for the frame
        elif found is None:
            self._health.count(f'floor not seen: {fault}')
        self._found = floor = self._tracker.update(found, cloud.header.stamp.to_sec())
        if floor is not None:
            self._frame = convert.transform_from_matrix(floor.frame, Header(), self._params.floor_frame)
            self._planes.publish(ModelCoefficients(header=cloud.header, values=[*floor.normal, floor.height]))
        self._health.frame_done(cloud.header.stamp)
        self._health.count('no floor' if floor is None else 'floor')

    def _send_frame(self, header: Header) -> None:
        """Publish the frame of the floor on tf, unless another node does: a frame has one parent."""
        if time.monotonic() < self._begin + _SETTLING:
            return
        if not self._is_alone:
            name, parents = self._params.floor_frame, self._transforms.parents()
            if name in {*parents, *parents.values()}:
                self._health.warn('frame exists', f"tf has a frame '{name}', so that of the floor is not published: "
                                                  'set floor_frame to another name, or publish_tf to false')
                return
            self._is_alone = True
            if not self._params.gravity_frame:
                self._transforms.stop()
        self._frame.header = header
        self._broadcaster.sendTransform(self._frame)


def main() -> int:
    """Run the node; return the exit status."""
    return run_node('floor', FloorParams, FloorNode)

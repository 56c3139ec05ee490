"""The RGB-D player node: publishes a sequence folder on the topics of a camera driver, in place of a camera."""
import threading
import time
from pathlib import Path

import rospkg
import rospy
import tf2_ros
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.ros.convert import bgr_to_image
from openpose_ros_pkg.ros.node import run_node
from openpose_ros_pkg.ros.parameters import read_private
from skeleton_extract_3d.depth import cloud_from_depth
from skeleton_extract_3d.node_params import PLAYER_PARAMETERS
from skeleton_extract_3d.rgbd_sequence import RgbdFrame, RgbdSequence
from skeleton_extract_3d.ros import convert

_WORLD_FRAME = 'world'
_DEFAULT_FRAME = 'camera_optical_frame'
_DEFAULT_RATE = 15.0


class RgbdPlayer:
    """Publishes image_color, points, image_depth_rect and camera_info, all with one stamp, and the camera's pose."""

    def __init__(self) -> None:
        self._params, = read_private(*PLAYER_PARAMETERS)
        folder = self._params.folder or str(Path(rospkg.RosPack().get_path('skeleton_extract_3d')) / 'demo' / 'cross')
        self._sequence = RgbdSequence.read(Path(folder))
        self._frame_id = self._params.frame_id or self._sequence.frame_id or _DEFAULT_FRAME
        self._rays = self._sequence.camera.ray_grid()
        self._image_publisher = rospy.Publisher('image_color', Image, queue_size=1)
        self._points_publisher = rospy.Publisher('points', PointCloud2, queue_size=1)
        self._depth_publisher = rospy.Publisher('image_depth_rect', Image, queue_size=1)
        self._info_publisher = rospy.Publisher('camera_info', CameraInfo, queue_size=1)
        self._publish_pose()
        threading.Thread(target=self._run, name='player', daemon=True).start()

    def _publish_pose(self) -> None:
        if self._sequence.T_world_camera is not None:
            self._broadcaster = tf2_ros.StaticTransformBroadcaster()
            self._broadcaster.sendTransform(convert.transform_from_matrix(
                self._sequence.T_world_camera, Header(stamp=rospy.Time.now(), frame_id=_WORLD_FRAME), self._frame_id))

    def _run(self) -> None:
        self._wait_for_subscribers()
        period = 1.0 / (self._params.rate or self._sequence.fps or _DEFAULT_RATE)
        # wall time: a stand-in for hardware does not follow a simulated clock
        next_time = time.monotonic()
        while not rospy.is_shutdown():
            for frame in self._sequence:
                time.sleep(max(0.0, next_time - time.monotonic()))
                next_time = max(next_time + period, time.monotonic())
                if rospy.is_shutdown():
                    return
                self._publish(frame)
            if not self._params.loop:
                rospy.loginfo('end of the sequence')
                rospy.signal_shutdown('end of the sequence')

    def _wait_for_subscribers(self) -> None:
        deadline = time.monotonic() + self._params.wait_for_subscribers
        while time.monotonic() < deadline and not rospy.is_shutdown():
            points = self._points_publisher.get_num_connections() + self._depth_publisher.get_num_connections()
            if points and self._image_publisher.get_num_connections():
                return
            time.sleep(0.01)

    def _publish(self, frame: RgbdFrame) -> None:
        header = Header(stamp=rospy.Time.now(), frame_id=self._frame_id)
        self._image_publisher.publish(bgr_to_image(frame.bgr, header))
        self._info_publisher.publish(convert.camera_to_message(self._sequence.camera, header))
        if self._depth_publisher.get_num_connections() > 0:
            self._depth_publisher.publish(convert.depth_to_message(frame.depth, header))
        if self._points_publisher.get_num_connections() > 0:
            cloud = cloud_from_depth(frame.depth * 0.001, self._sequence.camera, frame.bgr, self._rays)
            self._points_publisher.publish(convert.cloud_to_message(cloud, header))


def main() -> None:
    """Run the player node."""
    run_node('rgbd_player_node', RgbdPlayer)

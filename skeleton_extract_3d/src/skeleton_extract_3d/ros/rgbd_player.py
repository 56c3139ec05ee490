"""The RGB-D player node: publishes a sequence folder on the topics of a camera driver, in place of a camera."""
import math
import time
from pathlib import Path
from typing import Dict, Optional, Set, Tuple

import numpy as np
import rospkg
import rospy
import tf2_ros
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.convert import bgr_to_image
from openpose_ros_pkg.ros.node import run_node
from openpose_ros_pkg.ros.player.playback import Playback
from skeleton_extract_3d.node_params import PlayerParams
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.points.rgbd_sequence import DEFAULT_FRAME, WORLD_FRAME, RgbdFrame, RgbdSequence, play_order
from skeleton_extract_3d.ros import convert

_DEFAULT_RATE = 15.0
_PAUSE = 1.5  # time of black images with playback 'pause' [s]
_KEPT = 40  # frames whose messages stay in memory, 19 MB each at 960 x 540: playing them again costs only sending
_Messages = Tuple[Image, PointCloud2, Image, CameraInfo]


class RgbdPlayer:
    """Publishes image_color, points, image_depth_rect and camera_info, all with one stamp, and the camera's pose.

    ~frame is the stamp of each frame of the sequence, with its index as `seq`; black frames have none.
    """

    def __init__(self, params: PlayerParams) -> None:
        self._params = params
        folder = self._params.folder or str(Path(rospkg.RosPack().get_path('skeleton_extract_3d')) / 'demo' / 'cross')
        self._sequence = RgbdSequence.read(Path(folder))
        self._frame_id = self._params.frame_id or self._sequence.frame_id or DEFAULT_FRAME
        self._rays = self._sequence.camera.ray_grid()
        self._image_publisher = rospy.Publisher('image_color', Image, queue_size=1)
        self._points_publisher = rospy.Publisher('points', PointCloud2, queue_size=1)
        self._depth_publisher = rospy.Publisher('image_depth_rect', Image, queue_size=1)
        self._info_publisher = rospy.Publisher('camera_info', CameraInfo, queue_size=1)
        self._frame_publisher = rospy.Publisher('~frame', Header, queue_size=10)
        self._kept: Dict[Optional[int], _Messages] = {}
        self._unreadable: Set[Optional[int]] = set()
        self._publish_pose()
        self.playback = Playback(folder, self._play)
        self.playback.start()

    def _publish_pose(self) -> None:
        if self._sequence.T_world_camera is not None:
            self._broadcaster = tf2_ros.StaticTransformBroadcaster()
            self._broadcaster.sendTransform(convert.transform_from_matrix(
                self._sequence.T_world_camera, Header(stamp=rospy.Time.now(), frame_id=WORLD_FRAME), self._frame_id))

    def _play(self) -> None:
        self._wait_for_subscribers()
        period = 1.0 / (self._params.rate or self._sequence.fps or _DEFAULT_RATE)
        # wall time: a stand-in for hardware does not follow a simulated clock
        next_time = time.monotonic()
        for index in play_order(len(self._sequence), self._params.playback, math.ceil(_PAUSE / period)):
            messages = self._messages(index)
            time.sleep(max(0.0, next_time - time.monotonic()))
            next_time = max(next_time + period, time.monotonic())
            if rospy.is_shutdown():
                return
            if messages is not None:
                self._publish(index, messages)
        time.sleep(max(0.0, next_time - time.monotonic()))  # the last frame is sent before the topics close

    def _wait_for_subscribers(self) -> None:
        deadline = time.monotonic() + self._params.wait_for_subscribers
        while time.monotonic() < deadline and not rospy.is_shutdown():
            points = self._points_publisher.get_num_connections() + self._depth_publisher.get_num_connections()
            if points and self._image_publisher.get_num_connections():
                return
            time.sleep(0.01)

    def _messages(self, index: Optional[int]) -> Optional[_Messages]:
        """Return image, cloud, depth image and camera info of a frame; None: its files can not be read.

        The first _KEPT frames and a black one are kept. BadInputError: no frame can be read.
        """
        if index in self._kept:
            return self._kept[index]
        camera, header = self._sequence.camera, Header(frame_id=self._frame_id)
        size = (camera.height, camera.width)
        try:
            frame = (RgbdFrame(0.0, np.zeros((*size, 3), np.uint8), np.zeros(size, np.uint16)) if index is None
                     else self._sequence.frame(index))
        except BadInputError as error:
            self.playback.skip(error)
            self._unreadable.add(index)
            if len(self._unreadable) == len(self._sequence):
                raise BadInputError('no frame of the sequence can be read') from error
            return None
        cloud = cloud_from_depth(frame.depth * 0.001, camera, frame.bgr, self._rays)
        messages = (bgr_to_image(frame.bgr, header), convert.cloud_to_message(cloud, header),
                    convert.depth_to_message(frame.depth, header), convert.camera_to_message(camera, header))
        if index is None or len(self._kept) < _KEPT:
            self._kept[index] = messages
        return messages

    def _publish(self, index: Optional[int], messages: _Messages) -> None:
        stamp = rospy.Time.now()
        if index is not None:
            self._frame_publisher.publish(Header(index, stamp, self._frame_id))
        image, points, depth, info = messages
        for publisher, message in ((self._image_publisher, image), (self._info_publisher, info),
                                   (self._depth_publisher, depth), (self._points_publisher, points)):
            if publisher.get_num_connections() > 0:
                message.header.stamp = stamp
                publisher.publish(message)


def main() -> int:
    """Run the player node; return the exit status."""
    return run_node('rgbd_player_node', PlayerParams, RgbdPlayer, lambda player: player.playback.failed)

"""The camera node: publishes a webcam, a video file or a folder of images as a camera driver would."""
import time
from pathlib import Path
from typing import Any, Optional

import rospy
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from openpose_ros_pkg.calibration import read_calibration
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.params.nodes import CameraParams
from openpose_ros_pkg.ros.convert import bgr_to_image, calibration_to_message
from openpose_ros_pkg.ros.node import run_node
from openpose_ros_pkg.ros.player.playback import Playback
from openpose_ros_pkg.stream.video_source import VideoSource


class Camera:
    """Publishes `image_raw` and, with a calibration, `camera_info`."""

    def __init__(self, params: CameraParams) -> None:
        self._params = params
        self._info: Optional[CameraInfo] = None
        key = 'camera_info_file'
        try:
            if params.camera_info_file:
                self._info = calibration_to_message(read_calibration(Path(params.camera_info_file)), Header())
                self._info_publisher = rospy.Publisher('camera_info', CameraInfo, queue_size=1)
            key = 'source'
            self._source = VideoSource(str(Path(params.source).expanduser()), params.width, params.height)
        except BadInputError as error:
            if key == 'source' and params.source.isdigit():
                raise  # a device may come back: respawned, the node tries again
            value = getattr(params, key)
            raise ParameterError(f"parameter '{key}' = {value!r} is not allowed: {error}", key) from error
        self._publisher = rospy.Publisher('image_raw', Image, queue_size=1)
        self.playback = Playback(self._params.source, self._play)
        self.playback.start()

    def _play(self) -> None:
        rate = self._params.rate or (self._source.rate or 10.0)
        deadline = time.monotonic() + self._params.start_delay
        while self._publisher.get_num_connections() == 0 and time.monotonic() < deadline and not rospy.is_shutdown():
            time.sleep(0.01)
        next_time = time.monotonic()
        for bgr in self._source.frames(self._params.loop, self.playback.skip):
            if rospy.is_shutdown():
                return
            # wall time: a stand-in for hardware does not follow a simulated clock
            wait = next_time - time.monotonic()
            if self._source.live:
                if self._params.rate and wait > 0:
                    continue  # a webcam's frames are read at its rate, or their latency grows in its buffer
            else:
                time.sleep(max(0.0, wait))
            next_time = max(next_time + 1.0 / rate, time.monotonic())
            self._publish(bgr)
        time.sleep(max(0.0, next_time - time.monotonic()))  # the last frame is sent before the topics close

    def _publish(self, bgr: Any) -> None:
        message = bgr_to_image(bgr, Header(stamp=rospy.Time.now(), frame_id=self._params.frame_id))
        self._publisher.publish(message)
        if self._info is not None:
            self._info.header = message.header
            self._info_publisher.publish(self._info)


def main() -> int:
    """Run the camera node; return the exit status."""
    return run_node('camera_node', CameraParams, Camera, lambda camera: camera.playback.failed)

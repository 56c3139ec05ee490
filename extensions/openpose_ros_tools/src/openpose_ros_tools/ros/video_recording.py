"""Videos with the methods of `rosbag.Bag` that read: their images, on the topics of the camera node."""
from io import BytesIO
from pathlib import Path
from typing import Any, Collection, Iterator, Optional, Tuple

import genpy
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from openpose_ros_pkg.calibration import read_calibration
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.convert import bgr_to_image, calibration_to_message
from openpose_ros_pkg.stream.video_source import VideoSource
from openpose_ros_tools.ros.ros2_bags import LikeBag, header_of
from skeleton_extract_3d.points.rgbd_folder import DEFAULT_START
from skeleton_extract_3d.points.rgbd_sequence import DEFAULT_FRAME
from skeleton_extract_3d.points.stamps import SECOND

IMAGE, INFO = '/usb_cam/image_raw', '/usb_cam/camera_info'


class VideoRecording(LikeBag):
    """A video; NAME.yaml beside NAME.mp4 is its calibration, as camera_calibration writes it.

    Raises:
        BadInputError: the video or the calibration can not be read, or the video names no rate.
    """

    def __init__(self, path: Path) -> None:
        self.filename, beside = str(path), path.with_suffix('.yaml')
        video = VideoSource(self.filename)
        if video.rate is None:
            raise BadInputError(f'{path} does not say how many images it has per second')
        self._period, count = SECOND / video.rate, max(video.count, 1)
        self._start, self._end = DEFAULT_START, DEFAULT_START + (count - 1) * self._period
        self._calibration = read_calibration(beside) if beside.is_file() else None
        self._topics = {IMAGE: (Image._type, count),
                        **({} if self._calibration is None else {INFO: (CameraInfo._type, 1)})}

    def read_messages(self, topics: Collection[str], start: Optional[genpy.Time], end: Optional[genpy.Time],
                      **_: bool) -> Iterator[Tuple[Any, ...]]:
        """Yield raw messages with headers of connections, as `rosbag.Bag.read_messages` does when it is asked for them.
        """
        for topic, message in self._messages(topics):
            time, buffer = message.header.stamp, BytesIO()
            if end is not None and time > end:
                return
            if start is None or time >= start:
                message.serialize(buffer)
                yield (topic, (message._type, buffer.getvalue(), message._md5sum, None, type(message)), time,
                       header_of(topic, type(message)))

    def _messages(self, topics: Collection[str]) -> Iterator[Tuple[str, Any]]:
        if self._calibration is not None and INFO in topics:
            yield INFO, calibration_to_message(self._calibration, self._header(0))
        if IMAGE in topics:
            for number, bgr in enumerate(VideoSource(self.filename).frames()):
                yield IMAGE, bgr_to_image(bgr, self._header(number))

    def _header(self, number: int) -> Header:
        return Header(number, genpy.Time(0, DEFAULT_START + round(number * self._period)), DEFAULT_FRAME)

"""The topics of a camera: what comes on them, and what the newest message holds."""
import time
from dataclasses import replace
from typing import Any, Dict, List, Mapping

import rospy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2

from openpose_ros_bringup.doctor.snapshot import Arrival, Camera, Stream
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.stream.silent_topic import PublishedTopic
from skeleton_extract_3d.points.camera import calibrated_camera
from skeleton_extract_3d.points.plausibility import NO_DEPTH
from skeleton_extract_3d.ros import convert

_TYPES = {kind._type: kind for kind in (CameraInfo, CompressedImage, Image, PointCloud2)}


class Listener:
    """Notes the arrivals of a topic and keeps its newest message; it listens where the topic has the expected type."""

    def __init__(self, stream: Stream, published: Mapping[str, PublishedTopic]) -> None:
        self.stream = stream
        self.arrivals: List[Arrival] = []
        self.newest: Any = None
        self.keeps = False  # the newest message, whatever comes after it
        self._fault = ''
        there = published.get(stream.topic)
        self.listens = there is not None and there.kind == stream.kind
        if self.listens:
            self._input = InputSubscriber(stream.topic, _TYPES[stream.kind])
            self._input.registerCallback(self._note)
            self._input.on_error = self._damaged
            self._input.subscribe()

    def stop(self) -> None:
        """Let no more messages come."""
        if self.listens:
            self.stream = replace(self.stream, is_connected=self._input.connected)
            self._input.unsubscribe()

    def read(self, info: Any, rectified: bool) -> Stream:
        """Return what is known of the topic; `info`: newest camera info of a depth image; None: none came."""
        message, stream = self.newest, replace(self.stream, arrivals=tuple(self.arrivals), fault=self._fault)
        if message is None:
            return stream
        stream = replace(stream, frame_id=message.header.frame_id, encoding=getattr(message, 'encoding', ''))
        try:
            return _with_content(stream, message, info, rectified)
        except BadInputError as error:
            size = (message.width, message.height) if hasattr(message, 'width') else (0, 0)
            return replace(stream, fault=str(error), size=size)

    def _note(self, message: Any) -> None:
        self.arrivals.append(Arrival(time.monotonic(), rospy.get_time(), message.header.stamp.to_nsec()))
        if not self.keeps:
            self.newest = message

    def _damaged(self, error: Exception) -> None:
        self._fault = str(error)


class CameraListener:
    """Listens to the topics of a camera."""

    def __init__(self, camera: Camera, published: Mapping[str, PublishedTopic]) -> None:
        self._camera = camera
        self._listeners = {key: Listener(getattr(camera, key), published)
                           for key in ('image', 'points', 'info', 'colour_info') if getattr(camera, key) is not None}

    def has(self, messages: int) -> bool:
        """Tell whether so many images and points have come, one of these with depth, as a camera may be covered for a
        moment; or will not, as their topics are not there.
        """
        return self._has_depth() and all(len(listener.arrivals) >= (messages if key in ('image', 'points') else 1)
                                         for key, listener in self._listeners.items() if listener.listens)

    def _has_depth(self) -> bool:
        """Tell whether points are not known to have no depth; those that have depth are kept as the newest ones."""
        if 'points' not in self._listeners:
            return True
        listener = self._listeners['points']
        listener.keeps = listener.newest is not None  # the one that is looked at
        points = listener.read(self._newest_info(), self._camera.rectified)
        lacks_depth = points.doubt is not None and points.doubt.event == NO_DEPTH
        listener.keeps = points.points is not None and not lacks_depth
        return not lacks_depth

    def _newest_info(self) -> Any:
        return self._listeners['info'].newest if 'info' in self._listeners else None

    def stop(self) -> None:
        """Let no more messages come."""
        for listener in self._listeners.values():
            listener.stop()

    def read(self) -> Camera:
        """Return the camera with what came on its topics."""
        info = self._newest_info()
        streams: Dict[str, Any] = {key: listener.read(info, self._camera.rectified)
                                   for key, listener in self._listeners.items()}
        return replace(self._camera, **streams)


def _with_content(stream: Stream, message: Any, info: Any, rectified: bool) -> Stream:
    """Return a stream with what its newest message holds; BadInputError: it can not be used."""
    if stream.kind == CameraInfo._type:
        calibration = convert_2d.calibration_from_message(message)
        calibrated_camera(calibration, rectified)
        return replace(stream, calibration=calibration, size=calibration.image_size)
    if stream.role == 'image':
        bgr = convert_2d.any_image_to_bgr(message)
        return replace(stream, size=(bgr.shape[1], bgr.shape[0]), bgr=bgr, encoding=stream.encoding or message.format)
    if stream.kind == PointCloud2._type:
        points = convert.cloud_from_message(message)
        return replace(stream, points=points, size=(points.width, points.height))
    if stream.kind == CompressedImage._type:
        message = convert_2d.compressed_depth_to_image(message)
    stream = replace(stream, size=(message.width, message.height), encoding=message.encoding)
    if info is None or not any(info.K):  # a fault of the camera info
        return stream
    return replace(stream, points=convert.depth_image_from_messages(message, info, rectified))

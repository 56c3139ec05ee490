"""Points of another camera than that of the images: found by the calibrations of both and tf, and registered."""
import logging
from typing import Optional, Sequence, Tuple

import genpy
import numpy as np
import rosbag
import tf2_py
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.convert import calibration_from_message
from openpose_ros_pkg.ros.topics import CameraTopics
from openpose_ros_tools.ros.bag_files import TF_TOPICS, StampedMessage, deserialized, stamped_messages
from skeleton_extract_3d.points.camera import calibrated_camera
from skeleton_extract_3d.points.depth import registered
from skeleton_extract_3d.points.plausibility import registration_fault
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.points.transform import IDENTITY, Transform, is_same_place
from skeleton_extract_3d.ros.convert import rotation_and_translation

_log = logging.getLogger(__name__)

# Transforms between the cameras of a device are looked for in this time of a recording.
_TF_WITHIN = genpy.Duration(30)


class Registration:
    """Moves the points of each frame onto the pixels of its image, where they are those of another camera.

    Args:
        bags: the recording, and its parts before.
        topics: of the camera, in space.
        rectified: the images are.
    """

    def __init__(self, bags: Sequence[rosbag.Bag], topics: CameraTopics, rectified: bool) -> None:
        self._rectified, self._is_reported = rectified, False
        self._points = topics.points or topics.depth
        self._frame_id, points_frame = (first_message(bags, topic).frame_id for topic in (topics.image, self._points))
        self._calibration = (calibration_from_message(deserialized(first_message(bags, topics.image_info), CameraInfo))
                             if topics.image_info else None)
        self._pose = _pose(bags, self._frame_id, points_frame)
        self._is_elsewhere = self._pose is not None and not is_same_place(*self._pose)
        self._has_two_calibrations = self._calibration is not None and topics.camera_info != topics.image_info
        if topics.depth and (self._pose is None or (self._is_elsewhere and not self._has_two_calibrations)):
            _log.warning("%s is of frame '%s', but %s of '%s': joints are right in space only where the depth images "
                         'are aligned to the images', topics.image, self._frame_id, topics.depth, points_frame)

    def __call__(self, points: PointGrid, header: Header) -> Tuple[PointGrid, Header]:
        """Return the points at the pixels of the image, and their header.

        Raises:
            BadInputError: they are of another camera, and it is not known where that is.
        """
        fault = registration_fault(points, self._calibration)
        if not fault and not (self._is_elsewhere and self._has_two_calibrations):
            return points, header
        fault = f"{self._points}: {fault or 'tf has its camera beside that of the image'}"
        if self._pose is None or self._calibration is None:
            raise BadInputError(f'{fault}, and /tf_static does not tell where its camera is; record the depth that the '
                                'driver aligns to the images, or take the images alone by --only-2d')
        if not self._is_reported:
            self._is_reported = True
            _log.warning('%s; it is registered by both calibrations, %.0f mm between the cameras', fault,
                         1000 * np.linalg.norm(self._pose[1]))
        camera = calibrated_camera(self._calibration, self._rectified)
        return registered(points, camera, self._pose), Header(header.seq, header.stamp, self._frame_id)


def first_message(bags: Sequence[rosbag.Bag], topic: str) -> StampedMessage:
    """Return the first message of a topic in the first of the bags that has one."""
    return next(message for bag in bags for message in stamped_messages(bag, [topic]))


def _pose(bags: Sequence[rosbag.Bag], image: str, points: str) -> Optional[Transform]:
    """Return the transform from the frame of the points to that of the image; None: not known."""
    if image == points:
        return IDENTITY
    known = tf2_py.BufferCore()
    for bag in bags:
        end = genpy.Time.from_sec(bag.get_start_time()) + _TF_WITHIN
        for message in stamped_messages(bag, TF_TOPICS, end=end):
            for transform in deserialized(message, TFMessage).transforms:
                known.set_transform_static(transform, 'bag')  # a camera does not bend
            try:
                return rotation_and_translation(known.lookup_transform_core(image, points, genpy.Time()))
            except tf2_py.TransformException:
                continue
    return None

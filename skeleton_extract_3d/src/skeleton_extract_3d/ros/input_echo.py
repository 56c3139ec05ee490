"""Publish what results were computed from: the image, and the points as a cloud."""
from typing import Any, Tuple

import numpy as np
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.stream.frame_loop import NewestWinsWorker
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.frames import PointsMessage


class InputEcho:
    """Publishes input_rgb and input_pointcloud to their subscribers, in a thread of its own.

    A cloud is passed on as it came. Of a depth image, or of points that were turned, one is made, with the colours of
    the image.
    """

    def __init__(self, namespace: str, health: Health, demand: Demand) -> None:
        self._image_publisher = demand.advertise(f'{namespace}/input_rgb', Image, queue_size=1)
        self._cloud_publisher = demand.advertise(f'{namespace}/input_pointcloud', PointCloud2, queue_size=1)
        self._rays: Tuple[Any, np.ndarray] = (None, np.zeros(0))
        self._worker = NewestWinsWorker(
            self._publish, lambda error: health.warn('input not published', str(error)), 'input echo')

    def submit(self, frame: Frame, message: PointsMessage, header: Header) -> None:
        """Publish a frame if there is a subscriber; its arrays may be read after this call.

        Args:
            frame: its source is the raw image.
            message: cloud or depth image, as it came.
            header: of the points, as they are used.
        """
        if any(each.get_num_connections() > 0 for each in (self._image_publisher, self._cloud_publisher)):
            self._worker.submit((frame, message, header))

    def _publish(self, submitted: Tuple[Frame, PointsMessage, Header]) -> None:
        frame, message, header = submitted
        if self._image_publisher.get_num_connections() > 0:
            self._image_publisher.publish(frame.source)
        if self._cloud_publisher.get_num_connections() > 0 and not frame.is_monocular:
            self._cloud_publisher.publish(self._cloud(frame, message, header))

    def _cloud(self, frame: Frame, message: PointsMessage, header: Header) -> PointCloud2:
        points = frame.grid
        if not isinstance(points, DepthImage):
            camera = None if header is message.header else points.camera_model()
            if camera is None:
                return message
            points = DepthImage(points.patch(np.zeros(2, int), np.array([points.width, points.height]), 1), camera)
        return convert.cloud_to_message(points.coloured_cloud(frame.image, self._rays_of(points.camera)), header)

    def _rays_of(self, camera: CameraModel) -> np.ndarray:
        """Return the rays of all pixels, (H, W, 3) float32, computed again only for another camera."""
        key = (camera.width, camera.height, camera.distortion_model, *camera.matrix.flat, *camera.distortion)
        if key != self._rays[0]:
            self._rays = key, camera.ray_grid().astype(np.float32)
        return self._rays[1]

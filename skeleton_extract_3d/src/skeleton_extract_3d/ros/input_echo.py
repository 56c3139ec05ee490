"""Publish what results were computed from: the image, and the points as a cloud."""
from typing import Any, NamedTuple, Tuple

import numpy as np
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.stream.newest_wins import NewestWinsWorker
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.frames import PointsMessage


class InputFrame(NamedTuple):
    """What a result is computed from."""

    image: Image  # raw
    bgr: np.ndarray  # (H, W, 3) uint8, the same image
    message: PointsMessage  # cloud or depth image, as it came
    points: PointGrid  # those of the message, as they are used
    header: Header  # of these


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

    @property
    def is_wanted(self) -> bool:
        """Whether there is a subscriber."""
        return any(each.get_num_connections() > 0 for each in (self._image_publisher, self._cloud_publisher))

    def submit(self, frame: InputFrame) -> None:
        """Publish a frame if there is a subscriber; its arrays may be read after this call."""
        if self.is_wanted:
            self._worker.submit(frame)

    def _publish(self, frame: InputFrame) -> None:
        if self._image_publisher.get_num_connections() > 0:
            self._image_publisher.publish(frame.image)
        if self._cloud_publisher.get_num_connections() > 0:
            self._cloud_publisher.publish(self._cloud(frame))

    def _cloud(self, frame: InputFrame) -> PointCloud2:
        points = frame.points
        if not isinstance(points, DepthImage):
            camera = None if frame.header is frame.message.header else points.camera_model()
            if camera is None:
                return frame.message
            points = DepthImage(points.patch(np.zeros(2, int), np.array([points.width, points.height]), 1), camera)
        cloud = points.coloured_cloud(frame.bgr, self._rays_of(points.camera))
        return convert.cloud_to_message(cloud, frame.header)

    def _rays_of(self, camera: CameraModel) -> np.ndarray:
        """Return the rays of all pixels, (H, W, 3) float32, computed again only for another camera."""
        key = (camera.width, camera.height, camera.distortion_model, *camera.matrix.flat, *camera.distortion)
        if key != self._rays[0]:
            self._rays = key, camera.ray_grid().astype(np.float32)
        return self._rays[1]

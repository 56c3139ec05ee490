"""Organized cloud to depth image and camera info of the same view."""
import copy
from typing import Optional

from sensor_msgs.msg import CameraInfo, Image, PointCloud2

from openpose_ros_nodelets.depth_image import depth_pixels
from openpose_ros_nodelets.node_params import CloudToDepthParams
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.convert import calibration_from_message
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.stream.frame_loop import NewestWinsWorker
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.ros import convert


class CloudToDepth:
    """Publishes depth_registered/image_rect and depth_registered/camera_info with the header of each cloud."""

    def __init__(self, params: CloudToDepthParams) -> None:
        self._encoding = params.encoding
        self._info: Optional[CameraInfo] = None
        self._health = Health(bad_input='bad clouds')
        demand = Demand(params.lazy, self._health)
        self._images = demand.advertise('depth_registered/image_rect', Image, queue_size=1)
        self._infos = demand.advertise('depth_registered/camera_info', CameraInfo, queue_size=1)
        clouds = InputSubscriber('points', PointCloud2)
        clouds.registerCallback(NewestWinsWorker(self._process, self._health.frame_failed, 'clouds').submit)
        infos = InputSubscriber('camera_info', CameraInfo, optional=True)
        infos.registerCallback(self._store_info)
        demand.read(clouds, infos)
        introduce(demand.inputs)

    def _store_info(self, message: CameraInfo) -> None:
        self._info = message

    def _process(self, message: PointCloud2) -> None:
        cloud = convert.cloud_from_message(message)
        pixels = depth_pixels(cloud, self._encoding)
        info = self._camera_of(cloud, message)
        self._images.publish(convert.depth_to_message(pixels, message.header))
        self._infos.publish(info)
        self._health.frame_done(message.header.stamp)

    def _camera_of(self, cloud: OrganizedCloud, message: PointCloud2) -> CameraInfo:
        """Return the camera info that has come, which has to be rectified, or the one that fits the points."""
        given, size = self._info, (cloud.width, cloud.height)
        if given is not None:
            of_info, frame = calibration_from_message(given).image_size, message.header.frame_id
            if of_info != size or given.header.frame_id != frame:
                raise BadInputError(f"cloud is {size[0]} x {size[1]} in frame '{frame}', but the camera info is of "
                                    f"{of_info[0]} x {of_info[1]} in frame '{given.header.frame_id}'")
            info = copy.copy(given)
            info.header = message.header
            return info
        camera = cloud.camera_model()
        if camera is None:
            raise BadInputError('no camera can be fitted to the cloud: too few of its points are valid')
        return convert.camera_to_message(camera, message.header)


def main() -> int:
    """Run the node; return the exit status."""
    return run_node('cloud_to_depth', CloudToDepthParams, CloudToDepth)

"""The camera info beside an annotated image: that of the input, or one that the caller knows; never an assumed one."""
import copy
from typing import Callable, Optional, Tuple

from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from openpose_ros_pkg.ros.convert import calibration_from_message, turned_info
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber


class CameraInfoPublisher:
    """Publishes NAMESPACE/camera_info with the header of each image, while it has a subscriber and is known.

    Args:
        source: topic of the input's camera info.
        needed: the node does nothing without the camera info of the input.

    Attributes:
        input: subscriber of the input's camera info, for `demand` to read; `newest` is what came.
        degrees: by which the images are turned clockwise.
    """

    def __init__(self, namespace: str, source: str, health: Health, demand: Demand, needed: bool = False) -> None:
        self.newest: Optional[CameraInfo] = None
        self.degrees = 0
        self._health = health
        self._publisher = demand.advertise(f'{namespace}/camera_info', CameraInfo, queue_size=1)
        self.input = InputSubscriber(demand.resolve(source), CameraInfo, optional=not needed)
        self.input.registerCallback(self._store)
        self.source = self.input.resolved_name

    def publish(self, header: Header, size: Tuple[int, int],
                otherwise: Callable[[], Optional[CameraInfo]] = lambda: None) -> None:
        """Publish the camera info of an image of a size (width, height) [px].

        Args:
            otherwise: returns the camera info where the input has none of this image; called if there is a subscriber.
        """
        if self._publisher.get_num_connections() == 0:
            return
        newest = self.newest and turned_info(self.newest, self.degrees)
        of_info = newest and calibration_from_message(newest).image_size
        # K[0] = 0: not calibrated
        info = copy.copy(newest) if newest is not None and newest.K[0] != 0 and of_info == size else otherwise()
        if info is not None:
            info.header = header
            self._publisher.publish(info)
        elif newest is not None:
            self._health.warn('camera info of another image', f'{self.source} has {of_info} px and focal length '
                                                              f'{newest.K[0]:g}, but the image {size} px')

    def _store(self, message: CameraInfo) -> None:
        self.newest = message

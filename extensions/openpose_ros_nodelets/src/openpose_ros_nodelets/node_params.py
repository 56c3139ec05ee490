"""The parameters of the nodes in Python; those of people_cloud are in config/people_cloud.yaml alone."""
from dataclasses import dataclass
from typing import Any, Dict, Type

from openpose_ros_nodelets.floor import FloorParams
from openpose_ros_pkg.params.nodes import DemandParams
from openpose_ros_pkg.params.parameters import parameter


@dataclass(frozen=True)
class CloudToDepthParams(DemandParams):
    """The depth image and its camera."""

    encoding: str = parameter('16UC1', 'Pixels: 16UC1 [mm, up to 65.535 m] or 32FC1 [m].', choices=('16UC1', '32FC1'))
    camera: str = parameter(
        'auto', 'Camera info of the depth image: topic (what comes on camera_info; it must be rectified and of the '
                "cloud's size and frame), fit (the pinhole camera that the points belong to), or auto (fit as long as "
                'none has come).', choices=('auto', 'topic', 'fit'))


# The parameters of each file in config/.
CONFIG_FILES: Dict[str, Type[Any]] = {'cloud_to_depth.yaml': CloudToDepthParams, 'floor.yaml': FloorParams}

"""The parameters of the nodes in Python; those of people_cloud are in config/people_cloud.yaml alone."""
from dataclasses import dataclass
from typing import Any, Dict, Type

from openpose_ros_nodelets.floor import FloorParams
from openpose_ros_pkg.params.nodes import DemandParams
from openpose_ros_pkg.params.parameters import parameter


@dataclass(frozen=True)
class CloudToDepthParams(DemandParams):
    """The depth image."""

    retired = ('camera',)

    encoding: str = parameter('16UC1', 'Pixels: 16UC1 [mm, up to 65.535 m] or 32FC1 [m].', choices=('16UC1', '32FC1'))


# The parameters of each file in config/.
CONFIG_FILES: Dict[str, Type[Any]] = {'cloud_to_depth.yaml': CloudToDepthParams, 'floor.yaml': FloorParams}

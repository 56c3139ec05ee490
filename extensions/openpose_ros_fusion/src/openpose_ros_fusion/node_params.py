"""Which parameters the node of this package reads."""
from dataclasses import dataclass
from typing import Any, Dict, Tuple, Type

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.nodes import DemandParams
from openpose_ros_pkg.params.parameters import parameter


@dataclass(frozen=True)
class FusionParams(DemandParams):
    """Whose people are fused, and in which frame."""

    retired = ('people_topic', 'keypoints_topic', 'camera_info_topic', 'tf_timeout', 'correct_clocks', 'patience')

    cameras: str = parameter('camera1 camera2', 'Cameras with depth: the namespaces of their chains, separated by '
                                                'spaces.')
    rgb_cameras: str = parameter('', 'Cameras without depth: the namespaces of their chains, separated by spaces.')
    rectified: bool = parameter(False, 'The images of cameras without depth are rectified, so use P of the camera info '
                                       'and no distortion.')
    fixed_frame: str = parameter('world', 'Frame in which the people are fused and published, and the cameras stand or '
                                          'move. With rig: the fixed frame of that file.')
    rig: str = parameter('', 'File of calibrate_cameras that says where the cameras stand, and by which time their '
                             'clocks differ; empty: tf says where they stand at the stamp of their people.')

    def __post_init__(self) -> None:
        super().__post_init__()
        names = self.names
        if not names:
            raise ParameterError("parameter 'cameras' = '' names no camera, and 'rgb_cameras' neither", 'cameras')
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ParameterError(f"parameters 'cameras' and 'rgb_cameras' name {twice[0]} twice; allowed: each camera "
                                 'once', 'cameras')

    @property
    def names(self) -> Tuple[str, ...]:
        """Namespaces of all cameras, those with depth first."""
        return (*self.cameras.split(), *self.rgb_cameras.split())


# The parameters of each file in config/; a node loads the file of its name.
CONFIG_FILES: Dict[str, Type[Any]] = {'people_fusion_node.yaml': FusionParams}

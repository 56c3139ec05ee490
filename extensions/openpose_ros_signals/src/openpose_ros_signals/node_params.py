"""Which parameters the node of this package reads."""
from dataclasses import dataclass
from typing import Any, Dict, Type

import numpy as np

from openpose_ros_pkg.params.nodes import DemandParams
from openpose_ros_pkg.params.parameters import Parameters, direction, parameter
from skeleton_extract_3d.points.transform import UPRIGHT


@dataclass(frozen=True)
class UprightParams(Parameters):
    """Where up is."""

    up: str = parameter(
        '0 -1 0', 'Upwards in the frame of the people, where no fixed frame and no plane of the floor says it: three '
                  'numbers.', is_direction=True)

    @property
    def upwards(self) -> np.ndarray:
        """(3,) unit vector of `up`."""
        return direction(self.up, 'up')

    @property
    def level(self) -> bool:
        """Whether that is upwards in the optical frame of a level camera."""
        return np.allclose(self.upwards, UPRIGHT[:, 2])


@dataclass(frozen=True)
class SignalsParams(UprightParams, DemandParams):
    """In which frame signals are read, what people may point at, and zones."""

    retired = ('tf_timeout', 'text_scale', 'facing_length', 'pointing_length', 'signal_lifetime',
               'use_cloud')

    fixed_frame: str = parameter(
        '', 'Frame in which the room stands still, z upwards (map, odom, world): signals are read and published there. '
            'Empty: the camera stands still. Of a level one, FRAME_upright: x forward, y left, z up of its FRAME; with '
            'use_floor, or another up, the frame of the people.')
    use_floor: bool = parameter(
        False, 'Without fixed_frame: upwards is the normal of the plane on ~floor (pcl_msgs/ModelCoefficients in the '
               'frame of the people, as the node floor publishes it).')
    use_landmarks: bool = parameter(
        False, 'Read hands and faces: palms tell stop, faces tell where heads face. These are computed for it then.')
    summary: bool = parameter(
        False, 'Serve get_people, for state machines: the people that are there, since when, and what they do. The '
               'node works then all the time.')
    robot_frame: str = parameter(
        '', 'Frame from which people_summary and get_people have distances and bearings: x forwards (base_link). '
            'Empty: the camera, level.')
    zones: str = parameter(
        '', 'YAML file of volumes of which people_summary and get_people tell whether a part of a person is inside: a '
            'list of name, frame_id (any frame of tf), and box, or polygon and z [m]; empty: no zones.')
    targets: str = parameter(
        '', 'YAML file of what people may point at: a list of name, frame_id (any frame of tf) and position [m]; '
            'empty: no known targets.')


# The parameters of each file in config/; a node loads the file of its name.
CONFIG_FILES: Dict[str, Type[Any]] = {'people_signals_node.yaml': SignalsParams}

"""Which parameters the node of this package reads."""
from dataclasses import dataclass
from typing import Any, Dict, Type

from openpose_ros_pkg.params.parameters import Parameters, parameter


@dataclass(frozen=True)
class ViewParams(Parameters):
    """What RViz shows, and in which frame."""

    retired = ('rviz_config',)

    fixed_frame: str = parameter('', "RViz's fixed frame, z upwards or the optical frame of a camera; empty: `world` "
                                     'with `floor`, else the frame of the people.')
    floor: bool = parameter(False, 'The node floor publishes the frame `world`.')
    dimensions: int = parameter(3, '2: people in the image alone.', choices=(2, 3))
    cameras: str = parameter('', 'Cameras with depth whose people are fused: the namespaces of their chains, separated '
                                 'by spaces; this and rgb_cameras empty: a single chain, in the namespace of this '
                                 'node.')
    rgb_cameras: str = parameter('', 'The same for cameras without depth.')


# The parameters of each file in config/; a node loads the file of its name.
CONFIG_FILES: Dict[str, Type[Any]] = {'view.yaml': ViewParams}

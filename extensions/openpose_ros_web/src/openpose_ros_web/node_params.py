"""Which parameters the node of this package reads."""
from dataclasses import dataclass
from typing import Any, Dict, Type

from openpose_ros_pkg.params.parameters import Parameters, parameter


@dataclass(frozen=True)
class WebParams(Parameters):
    """Where pages are served, and what they show."""

    retired = ('cloud', 'cloud_rate', 'cloud_points', 'jpeg_quality')

    host: str = parameter('localhost', 'Name or address of this computer at which pages are served; localhost: for its '
                                       'own browsers alone, 0.0.0.0: for all of the network.')
    port: int = parameter(8080, 'Port of HTTP and WebSocket.', minimum=0, maximum=65535)
    fixed_frame: str = parameter('', 'Frame in which people are shown, z upwards; empty: `world` where tf knows it, '
                                     'else the frame of the people, turned upright if it is optical.')
    dimensions: int = parameter(3, '2: images alone.', choices=(2, 3))
    cameras: str = parameter('', 'Cameras with depth whose people are fused: the namespaces of their chains, separated '
                                 'by spaces; this and rgb_cameras empty: a single chain, in the namespace of this '
                                 'node.')
    rgb_cameras: str = parameter('', 'The same for cameras without depth.')


# The parameters of each file in config/; a node loads the file of its name.
CONFIG_FILES: Dict[str, Type[Any]] = {'people_web_node.yaml': WebParams}

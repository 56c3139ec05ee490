"""Read a node's private parameters into parameter dataclasses."""
from typing import Any, Tuple, Type

import rospy

from openpose_ros_pkg.params.parameters import Parameters, build


def read_private(*classes: Type[Parameters]) -> Tuple[Any, ...]:
    """Return one instance of each class from the private namespace of this node.

    Raises:
        ParameterError: a private parameter is unknown, of the wrong type or out of range.
    """
    return build(classes, rospy.get_param('~', {}))

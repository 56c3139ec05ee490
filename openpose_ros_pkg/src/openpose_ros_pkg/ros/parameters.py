"""Read a node's private parameters."""
from typing import Type

import rospy

from openpose_ros_pkg.params.parameters import Settings, build


def read_private(kind: Type[Settings]) -> Settings:
    """Return a parameter class or a record with the values in the private namespace of this node.

    Raises:
        ParameterError: a private parameter is unknown, of the wrong type or out of range.
    """
    return build(kind, rospy.get_param('~', {}))

"""Change parameters of a running node through dynamic_reconfigure."""
import dataclasses
from typing import Any, Callable, Dict, Iterable, Sequence

import rospy
from dynamic_reconfigure.server import Server

from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_pkg.params.live import LiveDescription
from openpose_ros_pkg.params.parameters import Parameters, build


class LiveParameters:
    """A dynamic_reconfigure server on the node's private parameters.

    Values out of range are set to the limit. What the parameter classes refuse beyond that is not taken: a warning
    says why, and the values before stay.

    Args:
        current: the node's parameters, one instance of each class.
        names: those that may change.
        apply: called with the instances of all classes after each change; raises OpenposeRosError for values that
            can not be had.
    """

    def __init__(self, current: Sequence[Parameters], names: Iterable[str],
                 apply: Callable[[Sequence[Parameters]], None]) -> None:
        self._classes = tuple(type(params) for params in current)
        self._current = tuple(current)
        self._apply = apply
        self._config: Dict[str, Any] = {}
        self._server = Server(LiveDescription(self._classes, names), self._change)

    def _change(self, config: Dict[str, Any], level: int) -> Dict[str, Any]:
        """Take a new configuration, or return the one before."""
        values = {field.name: getattr(params, field.name) for params in self._current
                  for field in dataclasses.fields(params)}
        values.update((key, value) for key, value in config.items() if key != 'groups')
        try:
            current = build(self._classes, values)
            if current != self._current:
                self._apply(current)
        except OpenposeRosError as error:
            rospy.logwarn('parameters not changed: %s', error)
            return self._config
        self._current, self._config = current, config
        return config

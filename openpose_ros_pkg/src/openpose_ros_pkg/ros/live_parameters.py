"""Change parameters of a running node through dynamic_reconfigure."""
from typing import Any, Callable, Dict, Generic, Iterable

import rospy
from dynamic_reconfigure.server import Server

from openpose_ros_pkg.errors import OpenposeRosError
from openpose_ros_pkg.params.live import LiveDescription
from openpose_ros_pkg.params.parameters import Settings, build, flat_values


class LiveParameters(Generic[Settings]):
    """A dynamic_reconfigure server on the node's private parameters.

    Values out of range are set to the limit. Others that the parameter classes refuse give a warning and are not taken.

    Args:
        current: the node's parameters, a parameter class or a record.
        names: those that may change.
        apply: called with all of them after each change; raises OpenposeRosError for values that can not be used.
    """

    def __init__(self, current: Settings, names: Iterable[str], apply: Callable[[Settings], None]) -> None:
        self._current = current
        self._apply = apply
        self._config: Dict[str, Any] = {}
        self._server = Server(LiveDescription(type(current), names), self._change)

    def _change(self, config: Dict[str, Any], level: int) -> Dict[str, Any]:
        values = {**flat_values(self._current), **{key: value for key, value in config.items() if key != 'groups'}}
        try:
            current = build(type(self._current), values)
            if current != self._current:
                self._apply(current)
        except OpenposeRosError as error:
            rospy.logwarn('parameters not changed: %s', error)
            return self._config
        self._current, self._config = current, config
        return config

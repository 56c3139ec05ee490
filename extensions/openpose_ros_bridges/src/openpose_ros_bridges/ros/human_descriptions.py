"""Robot models of bodies on the parameter server, where hri_rviz looks for them: human_description_ID."""
import re
from typing import Any, Dict, List, Sequence, Tuple

from openpose_ros_bridges.body_model import BodyPose
from openpose_ros_bridges.human_description import Lengths, lengths_of, urdf_of
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.master.calls import CALL_ERRORS, call_master

_PREFIX = '/human_description_'


class HumanDescriptions:
    """Sets the robot model of each body, with the lengths of its bones as they are first seen, and deletes it.

    Args:
        ids: regular expression of the ids of this node's bodies. Those that an earlier run left, as it crashed, are
            deleted.
    """

    def __init__(self, ids: str, health: Health) -> None:
        self._lengths: Dict[str, Lengths] = {}
        self._health = health
        self._delete([name for names in self._call([('getParamNames',)]) for name in names
                      if re.fullmatch(f'{_PREFIX}{ids}', name)])

    def lengths(self, name: str, body: BodyPose) -> Lengths:
        """Return the lengths of the model of a body; the model is there from now on."""
        if name in self._lengths:
            return self._lengths[name]
        lengths = lengths_of(body)
        if self._call([('setParam', _PREFIX + name, urdf_of(name, lengths))]):
            self._lengths[name] = lengths
        return lengths

    def forget(self, names: Sequence[str]) -> None:
        """Delete the models of bodies that have one."""
        self._delete([_PREFIX + name for name in names if self._lengths.pop(name, None) is not None])

    def clear(self) -> None:
        """Delete the models of all bodies."""
        self.forget(list(self._lengths))

    def _delete(self, names: Sequence[str]) -> None:
        if names:
            self._call([('deleteParam', name) for name in names])

    def _call(self, calls: Sequence[Tuple[Any, ...]]) -> List[Any]:
        """Return the values of calls of the master; none where it does not answer."""
        try:
            return [value for _, _, value in call_master(calls)]
        except CALL_ERRORS as error:
            self._health.warn('no human_description', f'the ROS master does not answer ({error})')
            return []

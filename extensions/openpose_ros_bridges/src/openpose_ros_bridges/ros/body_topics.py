"""What comes and goes with bodies: their topics, and their robot models on the parameter server."""
import time
from typing import Any, Callable, Dict, Sequence, Tuple

import genpy
import rospy

from openpose_ros_bridges.body_model import BodyPose
from openpose_ros_bridges.human_description import Lengths, lengths_of, urdf_of
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.master.calls import CALL_ERRORS, call_master

# The topics of a body end when it has not been tracked for this long [s].
_FORGET = 2.0
# hri_rviz looks there for the robot model of a body.
_MODEL = '/human_description_'


class BodyTopics:
    """The topics of bodies, or of persons, which come and go with them; `ended` is called with names that go."""

    def __init__(self, root: str, ended: Callable[[Sequence[str]], None] = lambda names: None) -> None:
        self._root, self._ended = root, ended
        self._publishers: Dict[str, Dict[str, rospy.Publisher]] = {}
        self._seen: Dict[str, float] = {}

    def publish(self, name: str, topic: str, message: genpy.Message, latch: bool = False) -> None:
        """Publish a message on a topic of one that is tracked; of others, nothing."""
        if name not in self._seen:
            return
        own = self._publishers.setdefault(name, {})
        new = topic not in own
        if new:
            own[topic] = rospy.Publisher(f'{self._root}/{name}/{topic}', type(message), queue_size=10, latch=latch)
        if new or not latch:
            own[topic].publish(message)

    def keep(self, names: Sequence[str]) -> None:
        """Take the names that are tracked now, and end the topics of names that were not for a while."""
        now = time.monotonic()
        self._seen.update(dict.fromkeys(names, now))
        self._end([name for name, seen in self._seen.items() if now - seen > _FORGET])

    def clear(self) -> None:
        """End the topics of all."""
        self._end(list(self._seen))

    def _end(self, names: Sequence[str]) -> None:
        for name in names:
            del self._seen[name]
            for publisher in self._publishers.pop(name, {}).values():
                publisher.unregister()
        self._ended(names)


class HumanDescriptions:
    """Sets the robot model of each body, with the lengths of its bones as they are first seen, and deletes it."""

    def __init__(self, health: Health) -> None:
        self._lengths: Dict[str, Lengths] = {}
        self._health = health

    def lengths(self, name: str, body: BodyPose) -> Lengths:
        """Return the lengths of the model of a body; the model is there from now on."""
        if name in self._lengths:
            return self._lengths[name]
        lengths = lengths_of(body)
        if self._call([('setParam', _MODEL + name, urdf_of(name, lengths))]):
            self._lengths[name] = lengths
        return lengths

    def forget(self, names: Sequence[str]) -> None:
        """Delete the models of bodies that have one."""
        calls = [('deleteParam', _MODEL + name) for name in names if self._lengths.pop(name, None) is not None]
        if calls:
            self._call(calls)

    def clear(self) -> None:
        """Delete the models of all bodies."""
        self.forget(list(self._lengths))

    def _call(self, calls: Sequence[Tuple[Any, ...]]) -> bool:
        """Call the master; return whether it answers."""
        try:
            return bool(call_master(calls))
        except CALL_ERRORS as error:
            self._health.warn('no human_description', f'the ROS master does not answer ({error})')
            return False

"""The camera that the parameter `camera` names, or that is there, and the topics of it that a node reads."""
import time
from typing import Dict, NamedTuple, Optional

import rosgraph
import rospy

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.camera_presets import AUTO, CameraPreset, choose_camera, find_preset, read_presets
from openpose_ros_pkg.ros.master.calls import CALL_ERRORS, published_topics
from openpose_ros_pkg.ros.topics import is_within
from openpose_ros_pkg.throttle import Throttle

# Period of looking for a camera with `auto`; of telling that none is there [s].
_LOOK_PERIOD, _LOG_PERIOD = 0.5, 10.0


class Camera(NamedTuple):
    """A camera that a node reads: its preset, and its namespace, which may be another than the preset's.

    Attributes:
        ns: None: one of several cameras of the node, each with its topics in its own namespace.
    """

    preset: CameraPreset
    ns: Optional[str]

    def topic(self, role: str, private: str) -> str:
        """Return the topic of a role, or the private name of it where that is remapped or the camera has none."""
        if rospy.resolve_name(private) != f'{rospy.get_name()}/{private[1:]}':  # remapped
            return private
        relative: str = getattr(self.preset, role)
        return (relative if self.ns is None else self.preset.topic(role, self.ns)) or private


def find_camera(name: str, ns: str, dimensions: int, within: str = '') -> Camera:
    """Return the camera that the parameters `camera` and `camera_ns` name.

    With `auto` it waits until one is published, and logs what it takes and what else there is.

    Args:
        dimensions: 3: the camera has to have depth.
        within: namespace that `auto` looks into; empty: all.

    Raises:
        ParameterError: there is no such camera, or it has no depth.
    """
    if name == AUTO:
        return _wait_for_camera(ns or within, dimensions)
    preset = find_preset(name)
    if preset.dimensions < dimensions:
        raise ParameterError(f"parameter 'camera' = {name!r} has no depth: points_source:=none places people by "
                             'its images alone, openpose_ros_node finds them in these', 'camera')
    return Camera(preset, ns or preset.ns)


def _wait_for_camera(within: str, dimensions: int) -> Camera:
    begin, log, presets = time.monotonic(), Throttle(_LOG_PERIOD), read_presets()
    while True:
        choice = choose_camera(_published(within), dimensions, presets)
        if choice.chosen is not None:
            rospy.loginfo('camera:=auto takes %s; there is also: %s', choice.chosen, choice)
            return Camera(choice.chosen.preset, choice.chosen.ns)
        if time.monotonic() - begin > 1.0 and log.is_due(''):
            rospy.logwarn('camera:=auto waits for a camera%s; there is: %s', f' in {within}' if within else '', choice)
        if rospy.is_shutdown():
            raise rospy.ROSInterruptException('shutdown')
        time.sleep(_LOOK_PERIOD)


def _published(within: str) -> Dict[str, str]:
    """Return the published topics below a namespace, with their types."""
    try:
        return {name: topic.kind for name, topic in published_topics().items()
                if is_within(name, within and rospy.resolve_name(within))}
    except CALL_ERRORS:
        rospy.logwarn_throttle(_LOG_PERIOD, f'the ROS master {rosgraph.get_master_uri()} does not answer')
        return {}

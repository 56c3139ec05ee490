"""What readers of REP-155 make of bodies, re-enacted in Python: their packages are not installed everywhere."""
from typing import Any, Dict, List, Type

import genpy
import rospy
import tf2_ros

from urdf_reader import UrdfModel, parsed_urdf

BODIES = '/humans/bodies'


class RvizSkeletons:
    """The display Skeletons3D of hri_rviz 0.4.2 (BSD), src/hri_skeletons.cpp.

    Lines 253-286, idsCallback: bodies that are not in the list are removed; for others that are new, and only if there
    is a parameter human_description_ID, a robot model is made, once. Lines 138-195, initializeRobot: what is no URDF
    clears the display. Lines 215-235, update: each link is where tf has the frame of its name; rviz 1.14.19,
    src/rviz/robot/tf_link_updater.cpp asks for the newest one, and shows an error if there is none.

    Attributes:
        models: robot models of the bodies that are shown.
        faults: what was wrong.
    """

    def __init__(self, ids: Type[genpy.Message], frames: tf2_ros.Buffer) -> None:
        self.models: Dict[str, UrdfModel] = {}
        self.faults: List[str] = []
        self._frames = frames
        rospy.Subscriber(f'{BODIES}/tracked', ids, self._take, queue_size=1)

    def _take(self, message: Any) -> None:
        for name in set(self.models) - set(message.ids):
            del self.models[name]
        for name in message.ids:
            # in the namespace of RViz, which is the root
            if name not in self.models and rospy.has_param(f'/human_description_{name}'):
                try:
                    self.models[name] = parsed_urdf(rospy.get_param(f'/human_description_{name}'))
                except (SyntaxError, ValueError, KeyError) as error:
                    self.faults.append(f'{name}: {error!r}')

    def links_without_frame(self, fixed_frame: str) -> List[str]:
        """Return the links that are shown nowhere."""
        return [link for model in list(self.models.values()) for link in model.links
                if not self._frames.can_transform(fixed_frame, link, rospy.Time())]

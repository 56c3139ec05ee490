"""What readers of REP-155 make of bodies, re-enacted in Python: their packages are not installed everywhere."""
from functools import partial
from typing import Any, Dict, List, Optional, Type

import genpy
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped

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


class LibhriBodies:
    """The bodies that HRIListener of libhri 0.6.4 (BSD) tells of.

    src/hri.cpp, lines 200-393, onTrackedFeature: those of the newest list, and no others. src/body.cpp, lines 49-62,
    init: subscribes to roi and skeleton2d of each; lines 94-109, transform: where body_ID (include/hri/body.h, line 54)
    is in the reference frame.

    Attributes:
        rois, skeletons: newest of each body.
    """

    def __init__(self, messages: Any, frames: tf2_ros.Buffer, reference_frame: str = 'base_link') -> None:
        self._messages, self._frames, self._reference_frame = messages, frames, reference_frame
        self._subscribers: Dict[str, List[rospy.Subscriber]] = {}
        self.rois: Dict[str, genpy.Message] = {}
        self.skeletons: Dict[str, genpy.Message] = {}
        rospy.Subscriber(f'{BODIES}/tracked', messages.IdsList, self._take, queue_size=1)

    @property
    def names(self) -> List[str]:
        """Ids of the bodies."""
        return sorted(self._subscribers)

    def transform(self, name: str) -> Optional[TransformStamped]:
        """Return where a body is; None: not known."""
        try:
            return self._frames.lookup_transform(self._reference_frame, f'body_{name}', rospy.Time(),
                                                 rospy.Duration(0.01))
        except tf2_ros.TransformException:
            return None

    def _take(self, message: Any) -> None:
        for name in set(self._subscribers) - set(message.ids):
            for subscriber in self._subscribers.pop(name):
                subscriber.unregister()
            self.rois.pop(name, None), self.skeletons.pop(name, None)
        for name in message.ids:
            if name not in self._subscribers:
                self._subscribers[name] = [
                    rospy.Subscriber(f'{BODIES}/{name}/{topic}', kind, partial(told.__setitem__, name), queue_size=1)
                    for topic, kind, told in self._topics()]

    def _topics(self) -> Any:
        return (('roi', self._messages.NormalizedRegionOfInterest2D, self.rois),
                ('skeleton2d', self._messages.Skeleton2D, self.skeletons))

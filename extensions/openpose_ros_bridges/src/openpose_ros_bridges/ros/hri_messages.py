"""The messages of hri_msgs, and people in them: the only place that knows both."""
from typing import Optional

import genpy
import numpy as np
from openpose_ros_msgs.msg import PersonSignals
from std_msgs.msg import Header

from openpose_ros_bridges.body_model import skeleton_2d
from openpose_ros_bridges.located import region_round, reliability_of
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage

PACKAGE = ForeignPackage('hri_msgs', 'https://github.com/ros4hri/hri_msgs (branch master)')
_POINT = {'x': 'float32', 'y': 'float32', 'c': 'float32'}
_HEADER = {'header': 'std_msgs/Header'}
# Gestures that hri_msgs/Gesture knows, by name and arm, those that say most first; it has one at a time.
_BOTH_RAISED = {('raise_hand', 'left'), ('raise_hand', 'right')}
_GESTURES = (('wave', None, 'WAVING'), ('arms_crossed', None, 'ARMS_CROSSED'),
             ('raise_hand', 'left', 'LEFT_HAND_RAISED'), ('raise_hand', 'right', 'RIGHT_HAND_RAISED'))
_POSTURES = {'standing': 'STANDING', 'sitting': 'SITTING', 'crouching': 'CROUCHING', 'lying': 'LAYING'}


class HriMessages:
    """Makes messages of hri_msgs.

    Attributes:
        ids, region, skeleton, posture, gesture: classes of IdsList, NormalizedRegionOfInterest2D, Skeleton2D,
            BodyPosture and Gesture.

    Raises:
        ForeignPackageError: the messages are not found, or are others.
    """

    def __init__(self) -> None:
        self.ids = PACKAGE.message('IdsList', {**_HEADER, 'ids': 'string[]'})
        self.region = PACKAGE.message('NormalizedRegionOfInterest2D', {
            **_HEADER, 'c': 'float32', **dict.fromkeys(('xmin', 'ymin', 'xmax', 'ymax'), 'float32')})
        self._point = PACKAGE.message('NormalizedPointOfInterest2D', _POINT)
        self.skeleton = PACKAGE.message('Skeleton2D', {**_HEADER, 'skeleton': 'hri_msgs/NormalizedPointOfInterest2D[]'})
        self.posture = PACKAGE.message('BodyPosture', {**_HEADER, 'posture': 'uint8'})
        self.gesture = PACKAGE.message('Gesture', {**_HEADER, 'gesture': 'uint8'})

    def region_of(self, people: People2D, row: int, header: Header, margin: float, size: np.ndarray
                  ) -> Optional[genpy.Message]:
        """Return the region of a person in an image of a size (2,) [px]; None: no keypoint was seen.

        Args:
            margin: share of the longer side that is added on each side.
        """
        keypoints = people.keypoints[row]
        if not people.present[row].any():
            return None
        seen = np.where(people.present[row][:, np.newaxis], keypoints[:, :2], np.nan)
        centre, extent = region_round(seen, margin)
        (xmin, ymin), (xmax, ymax) = (np.clip((centre + half * extent / 2) / size, 0.0, 1.0) for half in (-1, 1))
        return self.region(header=header, xmin=xmin, ymin=ymin, xmax=xmax, ymax=ymax, c=reliability_of(keypoints[:, 2]))

    def skeleton_of(self, people: People2D, row: int, header: Header, size: np.ndarray) -> genpy.Message:
        """Return the skeleton of a person in an image of a size (2,) [px]."""
        points = skeleton_2d(people.keypoints[row], people.skeleton, (int(size[0]), int(size[1])))
        return self.skeleton(header=header, skeleton=[self._point(*point) for point in points.tolist()])

    def posture_of(self, person: PersonSignals) -> genpy.Message:
        """Return the posture of a person; what hri_msgs does not know, and what is not known, is OTHER."""
        name = _POSTURES.get(person.posture, 'OTHER')
        return self.posture(header=person.header, posture=getattr(self.posture, name))

    def gesture_of(self, person: PersonSignals) -> Optional[genpy.Message]:
        """Return the gesture of a person; None: there is none that hri_msgs knows."""
        told = {(gesture.name, gesture.arm) for gesture in person.gestures}
        if told >= _BOTH_RAISED:
            return self.gesture(header=person.header, gesture=self.gesture.BOTH_HANDS_RAISED)
        for name, arm, constant in _GESTURES:
            if any(name == found and arm in (None, own) for found, own in told):
                return self.gesture(header=person.header, gesture=getattr(self.gesture, constant))
        return None

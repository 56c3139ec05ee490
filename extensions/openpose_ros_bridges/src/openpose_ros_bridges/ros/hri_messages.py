"""The messages of hri_msgs, and people in them: the only place that knows both."""
from typing import Optional

import genpy
import numpy as np
from openpose_ros_msgs.msg import PersonSignals
from std_msgs.msg import Header

from openpose_ros_bridges.body_model import skeleton_2d
from openpose_ros_bridges.located import region_round, reliability_of
from openpose_ros_bridges.ros.bridge import HEADER, FieldMap
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros.foreign_messages import ForeignPackage

PACKAGE = ForeignPackage('hri_msgs', 'https://github.com/ros4hri/hri_msgs (branch master)')
# Regions are wider than the keypoints by this share of their longer side, on each side.
_MARGIN = 0.1
# Gestures that hri_msgs/Gesture knows, by name and arm, those that say most first; it has one at a time.
_BOTH_RAISED = {('raise_hand', 'left'), ('raise_hand', 'right')}
_GESTURES = (('wave', None, 'WAVING'), ('arms_crossed', None, 'ARMS_CROSSED'),
             ('raise_hand', 'left', 'LEFT_HAND_RAISED'), ('raise_hand', 'right', 'RIGHT_HAND_RAISED'))
_POSTURES = {'standing': 'STANDING', 'sitting': 'SITTING', 'crouching': 'CROUCHING', 'lying': 'LAYING'}


class HriMessages:
    """Makes messages of hri_msgs.

    Raises:
        ForeignPackageError: the messages are not found, or are others.
    """

    def __init__(self) -> None:
        self.ids = FieldMap(PACKAGE, 'IdsList', header=HEADER, ids=('string[]', lambda _, ids: ids))
        self.region = FieldMap(PACKAGE, 'NormalizedRegionOfInterest2D', header=HEADER, **{
            name: ('float32', lambda _, values, place=place: values[place])
            for place, name in enumerate(('xmin', 'ymin', 'xmax', 'ymax', 'c'))})
        point = FieldMap(PACKAGE, 'NormalizedPointOfInterest2D', **{
            name: ('float32', lambda values, place=place: values[place]) for place, name in enumerate('xyc')})
        self.skeleton = FieldMap(PACKAGE, 'Skeleton2D', header=HEADER, skeleton=(
            'hri_msgs/NormalizedPointOfInterest2D[]', lambda _, points: [point(one) for one in points]))
        self.posture = FieldMap(PACKAGE, 'BodyPosture', header=HEADER,
                                posture=('uint8', lambda _, name: getattr(self.posture.kind, name)))
        self.gesture = FieldMap(PACKAGE, 'Gesture', header=HEADER,
                                gesture=('uint8', lambda _, name: getattr(self.gesture.kind, name)))

    def region_of(self, people: People2D, row: int, header: Header, size: np.ndarray) -> Optional[genpy.Message]:
        """Return the region of a person in an image of a size (2,) [px]; None: no keypoint was seen."""
        keypoints, present = people.keypoints[row], people.present[row]
        if not present.any():
            return None
        centre, extent = region_round(np.where(present[:, np.newaxis], keypoints[:, :2], np.nan), _MARGIN)
        corners = (np.clip((centre + half * extent / 2) / size, 0.0, 1.0) for half in (-1, 1))
        return self.region(header, (*np.concatenate(list(corners)), reliability_of(keypoints[:, 2])))

    def skeleton_of(self, people: People2D, row: int, header: Header, size: np.ndarray) -> genpy.Message:
        """Return the skeleton of a person in an image of a size (2,) [px]."""
        points = skeleton_2d(people.keypoints[row], people.skeleton, (int(size[0]), int(size[1])))
        return self.skeleton(header, points.tolist())

    def posture_of(self, person: PersonSignals) -> genpy.Message:
        """Return the posture of a person; what hri_msgs does not know, and what is not known, is OTHER."""
        return self.posture(person.header, _POSTURES.get(person.posture, 'OTHER'))

    def gesture_of(self, person: PersonSignals) -> Optional[genpy.Message]:
        """Return the gesture of a person; None: there is none that hri_msgs knows."""
        found = {(gesture.name, gesture.arm) for gesture in person.gestures}
        if found >= _BOTH_RAISED:
            return self.gesture(person.header, 'BOTH_HANDS_RAISED')
        return next((self.gesture(person.header, constant) for name, arm, constant in _GESTURES
                     if any(name == one and arm in (None, own) for one, own in found)), None)

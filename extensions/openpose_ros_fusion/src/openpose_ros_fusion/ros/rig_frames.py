"""Publish on /tf_static where the cameras of a rig stand, where tf does not say so.

A frame has one parent, and a driver publishes the frames between its camera's mount and the optical frame: then the
frame at the root of these is placed in the fixed frame of the rig, else the optical frame itself.
"""
import time
from typing import Callable, Dict, Mapping, Sequence, Tuple

import numpy as np
import rospy
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from openpose_ros_fusion.rig import RigCamera
from openpose_ros_pkg.ros.threads import repeat
from skeleton_extract_3d.points.transform import IDENTITY
from skeleton_extract_3d.ros.convert import transform_from_matrix
from skeleton_extract_3d.ros.static_frames import frames_above

# Drivers are asked for their frames this often, and have this long before the first transform is published [s].
_PERIOD, _SETTLING = 1.0, 2.0

Links = Mapping[str, TransformStamped]
"""Transforms by their child frames."""


def missing_frames(fixed_frame: str, cameras: Sequence[Tuple[RigCamera, str]], known: Links
                   ) -> Dict[str, TransformStamped]:
    """Return the transforms that tf lacks of a rig, by their child frames.

    Args:
        cameras: each with its optical frame.
        known: what others publish.
    """
    missing: Dict[str, TransformStamped] = {}
    for camera, frame in cameras:
        links = {**known, **missing}
        (root, (turn, shift)), (top, _) = ([(start, IDENTITY), *frames_above(start, links)][-1]
                                           for start in (frame, fixed_frame))
        if root != top:
            rotation, translation = camera.pose
            rotation = rotation @ turn.T
            missing[root] = transform_from_matrix(np.column_stack([rotation, translation - rotation @ shift]),
                                                  Header(frame_id=fixed_frame), root)
    return missing


class RigBroadcaster:
    """Publishes the cameras of a rig, and looks again while drivers come and go.

    Args:
        frame_of: returns the optical frame that a camera's people have; empty before the first.
    """

    def __init__(self, fixed_frame: str, cameras: Sequence[RigCamera], frame_of: Callable[[str], str]) -> None:
        self._fixed_frame, self._cameras, self._frame_of = fixed_frame, cameras, frame_of
        self._known: Dict[str, TransformStamped] = {}
        self._sent: Dict[str, TransformStamped] = {}
        self._publisher = rospy.Publisher('/tf_static', TFMessage, queue_size=1, latch=True)
        self._inputs = [rospy.Subscriber(topic, TFMessage, self._store) for topic in ('/tf', '/tf_static')]
        self._begin = time.monotonic() + _SETTLING
        repeat(self._publish, 'rig', _PERIOD)

    def _store(self, message: TFMessage) -> None:
        if message._connection_header['callerid'] != rospy.get_name():
            self._known.update({one.child_frame_id.strip('/'): one for one in message.transforms})

    def _publish(self) -> None:
        if time.monotonic() < self._begin:
            return
        cameras = [(camera, self._frame_of(camera.name) or camera.frame_id) for camera in self._cameras]
        missing = missing_frames(self._fixed_frame, cameras, dict(self._known))
        if missing != self._sent:
            self._publisher.publish(TFMessage(list(missing.values())))
        if set(missing) != set(self._sent):
            rospy.loginfo('frames that the rig places in %s: %s', self._fixed_frame, ', '.join(missing) or 'none')
        self._sent = missing

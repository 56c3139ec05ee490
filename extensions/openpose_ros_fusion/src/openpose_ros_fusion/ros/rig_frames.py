"""Publish on /tf_static where the cameras of a rig stand, where tf does not say so.

A frame has one parent, and a driver publishes the frames between its camera's mount and the optical frame: then the
frame at the root of these is placed in the fixed frame of the rig, else the optical frame itself.
"""
import time
from typing import Callable, Dict, Mapping, NamedTuple, Sequence, Tuple

import numpy as np
import rospy
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from openpose_ros_fusion.rig import RigCamera
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.threads import repeat
from skeleton_extract_3d.points.transform import Transform, rotation_of
from skeleton_extract_3d.ros.convert import transform_from_matrix
from skeleton_extract_3d.ros.static_frames import frames_above

# Drivers are asked for their frames this often, and have this long before the first transform is published [s].
_PERIOD, _SETTLING = 1.0, 2.0
# Greater differences between tf and the rig are named [m, rad].
_APART, _TURNED = 0.1, np.radians(5)

Links = Mapping[str, TransformStamped]
"""Transforms by their child frames."""


class RigFrames(NamedTuple):
    """What tf lacks of a rig, and where it says something else.

    Attributes:
        lacking: transforms to publish, by their child frames.
        apart: distance [m] and angle [rad] between rig and tf, by camera that tf places as well.
    """

    lacking: Dict[str, TransformStamped]
    apart: Dict[str, Tuple[float, float]]


def rig_frames(fixed_frame: str, cameras: Sequence[Tuple[RigCamera, str]], known: Links) -> RigFrames:
    """Compare a rig with what others publish on tf.

    Args:
        cameras: each with its optical frame.
        known: what others publish.
    """
    lacking: Dict[str, TransformStamped] = {}
    apart = {}
    for camera, frame in cameras:
        links = {**known, **lacking}
        root, (turn, shift) = _root(frame, links)
        top, (top_turn, top_shift) = _root(fixed_frame, links)
        rotation, translation = camera.pose
        if root == top:
            turn, shift = top_turn.T @ turn, top_turn.T @ (shift - top_shift)
            apart[camera.name] = (float(np.linalg.norm(shift - translation)),
                                  float(np.linalg.norm(rotation_of(turn.T @ rotation).as_rotvec())))
            continue
        matrix = np.eye(4)
        matrix[:3, :3] = rotation @ turn.T
        matrix[:3, 3] = translation - matrix[:3, :3] @ shift
        lacking[root] = transform_from_matrix(matrix, Header(frame_id=fixed_frame), root)
    return RigFrames(lacking, apart)


class RigBroadcaster:
    """Publishes the cameras of a rig, and looks again while drivers come and go.

    Args:
        frame_of: returns the optical frame that a camera's people have; empty before the first.
    """

    def __init__(self, fixed_frame: str, cameras: Sequence[RigCamera], frame_of: Callable[[str], str], health: Health
                 ) -> None:
        self._fixed_frame, self._cameras, self._frame_of = fixed_frame, cameras, frame_of
        self._known: Dict[str, TransformStamped] = {}
        self._sent: Dict[str, TransformStamped] = {}
        self._fault = ''
        health.show_lasting(lambda: self._fault)
        self._publisher = rospy.Publisher('/tf_static', TFMessage, queue_size=1, latch=True)
        self._inputs = [rospy.Subscriber(topic, TFMessage, self._store) for topic in ('/tf', '/tf_static')]
        self._begin = time.monotonic() + _SETTLING
        repeat(self._look, 'rig', _PERIOD)

    def _store(self, message: TFMessage) -> None:
        if message._connection_header['callerid'] != rospy.get_name():
            self._known.update({one.child_frame_id.strip('/'): one for one in message.transforms})

    def _look(self) -> None:
        if time.monotonic() < self._begin:
            return
        cameras = [(camera, self._frame_of(camera.name) or camera.frame_id) for camera in self._cameras]
        found = rig_frames(self._fixed_frame, cameras, dict(self._known))
        if found.lacking != self._sent:
            self._publisher.publish(TFMessage(list(found.lacking.values())))
        if set(found.lacking) != set(self._sent):
            rospy.loginfo('frames that the rig places in %s: %s', self._fixed_frame, ', '.join(found.lacking) or 'none')
        self._sent = found.lacking
        fault = '; '.join(f'tf and the rig place {name} {distance:.2f} m and {np.degrees(angle):.0f} degrees apart'
                          for name, (distance, angle) in found.apart.items() if distance > _APART or angle > _TURNED)
        if fault and not self._fault:
            rospy.logwarn('%s; people are fused by the rig', fault)
        self._fault = fault


def _root(frame: str, links: Links) -> Tuple[str, Transform]:
    """Return the frame at the root of a frame's tree, and the transform from the frame to it."""
    above = frames_above(frame, links)
    return above[-1] if above else (frame, (np.eye(3), np.zeros(3)))

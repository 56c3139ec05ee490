"""Frames of tf: those that have to be known, and those that may be missing."""
from typing import Optional, Set

import rospy
from std_msgs.msg import Header

from openpose_ros_pkg.errors import NoTransformError
from skeleton_extract_3d.points.transform import IDENTITY, Transform
from skeleton_extract_3d.ros.convert import rotation_and_translation
from skeleton_extract_3d.ros.transforms import Transforms

# A transform is waited for so long [s].
_TIMEOUT = 0.1


class Frames:
    """Transforms of the frames that a node needs; without any but '', tf is not read.

    Attributes:
        lost: frames that `known` asked for, and that tf does not know.
    """

    def __init__(self, *frames: str) -> None:
        self._transforms = Transforms(_TIMEOUT) if any(frames) else None
        self.lost: Set[str] = set()

    def to(self, frame: str, header: Header) -> Transform:
        """Return what takes points of a message to a frame; '': its own.

        Raises:
            NoTransformError: tf does not know it in time.
        """
        return IDENTITY if self._transforms is None else self._transforms.pose(frame, header)

    def known(self, frame: str, header: Header) -> Optional[Transform]:
        """Return what takes points of a frame to that and the time of a header; None, with a warning: not known."""
        if frame == header.frame_id:
            return IDENTITY
        if self._transforms is None:
            return None
        try:
            # what was not there is not waited for, as that would hold up each frame
            moved = self._transforms.lookup(header.frame_id, frame, header.stamp, 0.0 if frame in self.lost else None)
        except NoTransformError as error:
            if frame not in self.lost:
                rospy.logwarn('the frame %s is not known: %s', frame, error.__cause__ or error)
            self.lost.add(frame)
            return None
        self.lost.discard(frame)
        return rotation_and_translation(moved)

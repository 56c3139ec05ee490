"""What tf tells, for bridges whose outputs share it."""
from typing import Optional, Set

import numpy as np
import rospy
from std_msgs.msg import Header

from openpose_ros_pkg.errors import NoTransformError
from skeleton_extract_3d.points.transform import IDENTITY, Transform
from skeleton_extract_3d.ros.convert import rotation_and_translation
from skeleton_extract_3d.ros.transforms import Transforms


class PlanningFrames:
    """Transforms to the frames of a planner, for several threads.

    Args:
        timeout: how long to wait for one [s].
        frames: those that are asked for; without any but '', tf is not read.
    """

    def __init__(self, timeout: float, *frames: str) -> None:
        self._transforms = Transforms(timeout) if any(frames) else None
        self._lost: Set[str] = set()

    def to(self, frame: str, header: Header) -> Transform:
        """Return what takes points of a message to a frame; '': its own.

        Raises:
            NoTransformError: tf does not know it in time.
        """
        if self._transforms is None:
            return IDENTITY
        return self._transforms.pose(frame, header)

    def origin_of(self, link: str, header: Header) -> Optional[np.ndarray]:
        """Return where the origin of a link is in the frame and at the time of a header, (3,) [m]; None: not known."""
        if self._transforms is None:
            return None
        try:
            # what was not there is not waited for, as that would hold up each frame
            moved = self._transforms.lookup(header.frame_id, link, header.stamp, 0.0 if link in self._lost else None)
        except NoTransformError as error:
            if link not in self._lost:
                rospy.logwarn('the link %s is not known: %s', link, error.__cause__ or error)
            self._lost.add(link)
            return None
        self._lost.discard(link)
        return rotation_and_translation(moved)[1]

"""The frame that pages show, and where other frames are in it."""
import threading
import time
from typing import Dict, Optional, Set, Tuple

import numpy as np
from std_msgs.msg import Header

from openpose_ros_pkg.errors import BadInputError, NoTransformError
from skeleton_extract_3d.points.transform import LEVEL, TURNED, Transform
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.transforms import Transforms

WORLD = 'world'
# Transforms are waited for at the begin of listening, for this long, so that a page does not see two frames [s].
_PATIENCE, _LOOK_PERIOD = 0.5, 0.02
_STILL = np.eye(3), np.zeros(3)


class Room:
    """Finds where frames are; listens to tf from the first question until it rests.

    Args:
        fixed_frame: that is shown; empty: `world` where tf knows it.

    Attributes:
        optical: names of the frames of cameras.
    """

    def __init__(self, fixed_frame: str) -> None:
        self._fixed_frame = fixed_frame
        self._lock = threading.Lock()
        self._transforms: Optional[Transforms] = None
        self.optical: Set[str] = set()
        self._connected: Dict[str, bool] = {}
        self._deadline = 0.0

    def fault(self) -> str:
        """Return what is wrong, in words; empty: nothing is."""
        missing = [frame for frame, connected in sorted(self._connected.copy().items()) if not connected]
        return f"tf does not connect '{self._fixed_frame}' with '{', '.join(missing)}', shown in its place" if (
            missing and self._fixed_frame) else ''

    def place(self, header: Header) -> Tuple[str, Transform]:
        """Return the frame that is shown, and where the frame of a header is in it.

        Without a transform at the stamp the newest is taken; without any, the frame itself is shown, turned upright if
        it is optical.
        """
        own = header.frame_id
        target = self._fixed_frame or WORLD
        pose = _STILL if target == own else self._pose(target, header)
        self._connected[own] = pose is not None
        if pose is not None:
            return target, pose
        if not own.endswith(TURNED) and ('optical' in own or own in self.optical):
            return own + TURNED, LEVEL
        return own, _STILL

    def rest(self) -> None:
        """Listen to tf no more, until the next question."""
        with self._lock:
            if self._transforms is not None:
                self._transforms.stop()
                self._transforms = None
        self._connected = {}

    def _pose(self, target: str, header: Header) -> Optional[Transform]:
        with self._lock:
            if self._transforms is None:
                self._transforms = Transforms(0.0)
                self._deadline = time.monotonic() + _PATIENCE
            transforms = self._transforms
        while True:
            for find in (lambda: transforms.lookup(target, header.frame_id, header.stamp),
                         lambda: transforms.newest(target, header.frame_id)):
                try:
                    return convert.rotation_and_translation(find())
                except (NoTransformError, BadInputError):
                    continue
            if time.monotonic() >= self._deadline:
                return None
            time.sleep(_LOOK_PERIOD)

"""What tf knows of the frames that are asked for."""
import time
from typing import Dict, Iterable, Tuple

import rospy
import tf2_ros
import yaml

from openpose_ros_bringup.doctor.snapshot import Lookup
from openpose_ros_pkg.errors import BadInputError, NoTransformError
from skeleton_extract_3d.ros.convert import rotation_and_translation
from skeleton_extract_3d.ros.transforms import check_stamp

# Transforms for a stamp come a little later [s].
_PATIENCE, _PERIOD = 1.0, 0.02


class FrameListener:
    """Listens to tf."""

    def __init__(self) -> None:
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer)

    def stop(self) -> None:
        """Listen no more."""
        self._listener.unregister()

    def parents(self) -> Dict[str, str]:
        """Return the parent of each frame."""
        frames = yaml.safe_load(self._buffer.all_frames_as_yaml()) or {}
        return {child: values['parent'] for child, values in frames.items()}

    def lookups(self, wanted: Iterable[Tuple[str, str, rospy.Time]]) -> Dict[Tuple[str, str], Lookup]:
        """Return transforms by target and source frame, at a stamp, as soon as they are there or will not be."""
        deadline, found = time.monotonic() + _PATIENCE, {}
        for target, source, stamp in wanted:
            found[target, source] = self._lookup(target, source, stamp)
            while found[target, source].error and time.monotonic() < deadline:
                time.sleep(_PERIOD)
                found[target, source] = self._lookup(target, source, stamp)
        return found

    def _lookup(self, target: str, source: str, stamp: rospy.Time) -> Lookup:
        try:
            check_stamp(stamp)
            return Lookup(*rotation_and_translation(self._buffer.lookup_transform(target, source, stamp)))
        except (tf2_ros.TransformException, NoTransformError, BadInputError) as error:
            return Lookup(error=str(error))

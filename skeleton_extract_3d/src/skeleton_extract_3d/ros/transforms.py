"""Transforms of tf, waited for in wall time: with a simulated clock that stops, tf2 itself would wait without end."""
import time
from typing import Dict, Optional

import genpy
import rospy
import tf2_ros
import yaml
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Header

from openpose_ros_pkg.errors import NoTransformError
from openpose_ros_pkg.stream.pairing import PAIRING
from skeleton_extract_3d.points.transform import IDENTITY, Transform
from skeleton_extract_3d.ros.convert import rotation_and_translation

# Period of looking [s].
_LOOK_PERIOD = 0.005
# A transform whose newest time is nearer to a stamp may still come for that stamp [s].
_ON_ITS_WAY = 1.0
# tf2_py ends the process where it would return a later stamp, in 2038 [s].
_LAST_STAMP = 2 ** 31 - 1


def check_stamp(stamp: genpy.Time) -> None:
    """Raise NoTransformError for a stamp at which tf2_py must not look up a transform."""
    if stamp.secs > _LAST_STAMP:
        raise NoTransformError(f'the frame is dropped: its stamp is {stamp.secs} s, and tf knows none after 2038')


class _Buffer(tf2_ros.Buffer):
    """Forgets all but static transforms when the stamps of a frame jump back.

    They do where a recording is played again without a simulated clock; tf2 would take them for outdated.
    """

    def __init__(self) -> None:
        super().__init__(debug=False)  # without a service of its own
        self._newest: Dict[str, int] = {}  # stamp of each child frame [ns]

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        stamp, frame = transform.header.stamp.to_nsec(), transform.child_frame_id
        if stamp < self._newest.get(frame, stamp) - PAIRING.reset_backstep:
            self.clear()
            self._newest.clear()
        self._newest[frame] = max(stamp, self._newest.get(frame, stamp))
        super().set_transform(transform, authority)


class Transforms:
    """What tf knows; `timeout` is how long to wait for a transform [s]. For all threads."""

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self._buffer = _Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer)

    def stop(self) -> None:
        """Listen no more."""
        self._listener.unregister()

    def parents(self) -> Dict[str, str]:
        """Return the parent of each frame."""
        frames = yaml.safe_load(self._buffer.all_frames_as_yaml()) or {}
        return {child: values['parent'] for child, values in frames.items()}

    def may_come(self, target: str, source: str, stamp: rospy.Time) -> bool:
        """Return whether tf connects the frames shortly before a stamp, so that waiting for it is of use."""
        try:
            newest = self._buffer.get_latest_common_time(target, source)
        except (tf2_ros.TransformException, TypeError):  # the latter of such a time, see `check_stamp`
            return False
        return bool(abs((stamp - newest).to_sec()) <= _ON_ITS_WAY)

    def pose(self, target: str, header: Header) -> Transform:
        """Return what takes points of a message to the frame `target`; '': its own. As `lookup`.

        Raises:
            NoTransformError: it did not come in time.
            BadInputError: its numbers are not finite.
        """
        if target in ('', header.frame_id):
            return IDENTITY
        return rotation_and_translation(self.lookup(target, header.frame_id, header.stamp))

    def newest(self, target: str, source: str) -> TransformStamped:
        """Return the newest transform that takes points of the frame `source` to `target`, without waiting.

        Its stamp is 0 where it does not change.

        Raises:
            NoTransformError: there is none.
        """
        try:
            return self._buffer.lookup_transform(target, source, self._buffer.get_latest_common_time(target, source))
        except (tf2_ros.TransformException, TypeError) as error:
            raise NoTransformError(str(error)) from error

    def lookup(self, target: str, source: str, stamp: rospy.Time, timeout: Optional[float] = None
               ) -> TransformStamped:
        """Return the transform that takes points of the frame `source` to `target`; for one thread at a time.

        Args:
            timeout: how long to wait this time [s]; None: as always.

        Raises:
            NoTransformError: it did not come in time.
        """
        check_stamp(stamp)
        deadline = time.monotonic() + (self._timeout if timeout is None else timeout)
        while True:
            try:
                return self._buffer.lookup_transform(target, source, stamp)
            except tf2_ros.TransformException as error:
                if time.monotonic() >= deadline or rospy.is_shutdown():
                    raise NoTransformError(f'the frame is dropped: {error}') from error
            time.sleep(_LOOK_PERIOD)

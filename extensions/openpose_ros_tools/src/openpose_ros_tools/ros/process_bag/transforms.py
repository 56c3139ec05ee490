"""The transforms of a bag, read on as its frames come."""
import itertools
from typing import Dict, List, Optional, Sequence

import genpy
import rosbag
import tf2_py
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from openpose_ros_pkg.errors import NoTransformError
from openpose_ros_pkg.stream.pairing import PAIRING
from openpose_ros_tools.ros.bag_files import TF_TOPICS, deserialized, stamped_messages
from skeleton_extract_3d.ros.transforms import check_stamp

# Transforms are read ahead of the frame by this time [ns], as they may be recorded later than the image; and kept for
# this time.
_AHEAD, _KEPT = 3_000_000_000, genpy.Duration(30)
_BACKSTEP = PAIRING.reset_backstep


class RecordedTransforms:
    """The transforms of a bag, read on as the frames come.

    Where stamps jump back, as in recordings of a simulation that was restarted and of a bag that was played in a loop,
    all but static transforms are forgotten.

    Args:
        bag: open; this is its only reader meanwhile.
        earlier: the parts of its recording before, whose static transforms hold and whose last ones may still count.
    """

    def __init__(self, bag: rosbag.Bag, *earlier: rosbag.Bag) -> None:
        ends = [genpy.Time.from_sec(max(part.get_end_time() - 1e-9 * _AHEAD, 0)) for part in earlier]
        self._messages = itertools.chain(
            *(stamped_messages(part, ('/tf_static', 'tf_static')) for part in earlier),
            *(stamped_messages(part, ('/tf', 'tf'), start) for part, start in zip(earlier, ends)),
            stamped_messages(bag, TF_TOPICS))
        self._ahead = next(self._messages, None)
        self._static: Dict[str, TransformStamped] = {}  # by child frame
        # what tf says since the last reset of the clock, and the newest stamp of each child frame [ns]
        self._buffer, self._newest = tf2_py.BufferCore(_KEPT), {}  # type: ignore[var-annotated]
        self._next: Optional[List[TransformStamped]] = None  # since transforms step back, read ahead of the frames
        self._next_began = self._stamp = 0  # time of recording, and newest stamp of the frames [ns]

    def read_until(self, time: genpy.Time, stamp: genpy.Time) -> None:
        """Read what was recorded until a while after this time, at which the frame with this stamp was recorded."""
        now = time.to_nsec()
        while self._ahead is not None and self._ahead.time <= now + _AHEAD:
            transforms = deserialized(self._ahead, TFMessage).transforms
            if self._ahead.topic.endswith('tf_static'):
                self._static.update({one.child_frame_id: one for one in transforms})
                for one in transforms:
                    self._buffer.set_transform_static(one, 'bag')
            else:
                steps_back = any(one.header.stamp.to_nsec() < self._newest.get(one.child_frame_id, 0) - _BACKSTEP
                                 for one in transforms)
                if steps_back and self._next is None:
                    self._next, self._next_began = [], self._ahead.time
                if self._next is not None:
                    self._next.extend(transforms)
                if not steps_back:
                    self._add(transforms)
            self._ahead = next(self._messages, None)
        is_first = not self._stamp and self._next is not None and self._next_began <= now
        if is_first or stamp.to_nsec() < self._stamp - _BACKSTEP:
            self._buffer, self._newest, self._stamp = tf2_py.BufferCore(_KEPT), {}, 0
            for one in self._static.values():
                self._buffer.set_transform_static(one, 'bag')
            self._add(self._next or ())
            self._next = None
        elif self._next is not None and self._next_began + _AHEAD < now:
            self._next = None  # the frames did not jump: it was an old transform
        self._stamp = max(stamp.to_nsec(), self._stamp)

    def _add(self, transforms: Sequence[TransformStamped]) -> None:
        for one in transforms:
            self._newest[one.child_frame_id] = one.header.stamp.to_nsec()
            self._buffer.set_transform(one, 'bag')

    def lookup(self, target: str, source: str, stamp: genpy.Time) -> TransformStamped:
        """Return the transform from `source` to `target` at a time, that of the frame for which was read.

        Raises:
            NoTransformError: there is none.
        """
        check_stamp(stamp)
        try:
            return self._buffer.lookup_transform_core(target, source, stamp)
        except tf2_py.TransformException as error:
            raise NoTransformError(str(error)) from error

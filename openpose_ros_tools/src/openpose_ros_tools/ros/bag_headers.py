"""Stamps of a bag's messages, without reading what is in the messages."""
import struct
from typing import Any, Iterator, NamedTuple, Optional, Sequence

import rosbag

from openpose_ros_pkg.errors import BadInputError

# std_msgs/Header as it is serialized: seq, stamp.secs, stamp.nsecs, length of frame_id.
_HEADER = struct.Struct('<4I')


class StampedMessage(NamedTuple):
    """A message that is not deserialized.

    Attributes:
        topic: as in the bag.
        kind: class of the message.
        stamp: header.stamp [ns]; None where the message does not begin with a header.
        frame_id: of the header.
        time: of the recording [ns].
        data: the serialized message.
    """

    topic: str
    kind: Any
    stamp: Optional[int]
    frame_id: str
    time: int
    data: bytes


def stamped_messages(bag: rosbag.Bag, topics: Sequence[str], start: Any = None,
                     end: Any = None) -> Iterator[StampedMessage]:
    """Yield the messages of topics in the order of their recording; one at a time is held in memory.

    Args:
        start, end: genpy.Time of the recording, None: all.

    Raises:
        BadInputError: the bag is damaged.
    """
    if not topics:
        return  # rosbag would read all
    messages = bag.read_messages(list(topics), start, end, raw=True)
    while True:
        try:
            topic, (_, data, _, _, kind), time = next(messages)
            stamp, frame_id = None, ''
            if kind._slot_types[:1] == ['std_msgs/Header']:
                _, seconds, nanoseconds, length = _HEADER.unpack_from(data)
                stamp = 1000000000 * seconds + nanoseconds
                frame_id = data[_HEADER.size:_HEADER.size + length].decode(errors='replace')
        except StopIteration:
            return
        except (rosbag.ROSBagException, struct.error, EOFError, OSError, ValueError, RuntimeError) as error:
            raise BadInputError(f'{bag.filename} is damaged ({error}); `rosbag reindex` may save the rest') from error
        yield StampedMessage(topic, kind, stamp, frame_id, time.to_nsec(), data)

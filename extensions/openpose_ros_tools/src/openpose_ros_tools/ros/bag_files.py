"""Opening and reading bags, with helpful errors."""
import re
import struct
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Type

import genpy
import rosbag
import rosbag.bag
from geometry_msgs.msg import TransformStamped
from roslib.message import get_message_class
from tf2_msgs.msg import TFMessage

from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.output.files import naming
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_tools.recording_paths import is_ros2
from openpose_ros_tools.ros.ros2_bags import MENDING, McapFile, Ros2Recording, header_of, joined_types

COMPRESSIONS = (rosbag.Compression.NONE, rosbag.Compression.LZ4, rosbag.Compression.BZ2)
"""Compressions of bags, as the command line names them."""

TF_TOPIC = '/tf_static'
"""Topic of static transforms."""

# A line of a definition, or a type: genmsg takes `int32 a; import os; b=1` for a constant.
_DEFINITION = re.compile(r'={80}|string\s+\w+\s*=.*|[\w/:[\]\s]*(=[-+.\w\s]*)?(#.*)?', re.ASCII)
# Names of the parts of a recording, as `rosbag record --split` gives them: NAME_0, NAME_2026-11-28-10-00-00_0; and the
# longest time from the end of one to the begin of the next [s].
_PART = re.compile(r'(.*?)(?:_\d{4}(?:-\d\d){5})?_(\d+)')
_PART_PAUSE = 5.0
# std_msgs/Header as it is serialized: seq, stamp.secs, stamp.nsecs, length of frame_id.
_HEADER = struct.Struct('<4I')


class StampedMessage(NamedTuple):
    """A message that is not deserialized."""

    topic: str  # as in the bag
    # as `rosbag.Bag.write` takes it: type, serialized message, checksum of the definition, place, class
    raw: Tuple[Any, ...]
    stamp: Optional[int]  # header.stamp [ns]; None where the message does not begin with a header
    frame_id: str  # of the header
    time: int  # of the recording [ns]
    connection: Dict[str, Any]  # header of the connection


@contextmanager
def open_bag(path: Path) -> Iterator[rosbag.Bag]:
    """Open a bag to read it, or a recording of ROS 2, which is then like a bag.

    Raises:
        BadInputError: it is not there, is no bag, or has no index.
    """
    if is_ros2(path):
        yield Ros2Recording(path)
        return
    try:
        bag = rosbag.Bag(str(path))
    except rosbag.ROSBagUnindexedException:
        raise BadInputError(f'{path} has no index, as recordings have that were cut off or damaged; mend it with: '
                            f'rosbag reindex {path}') from None
    except Exception as error:  # as in `messages_of`
        if isinstance(error, OSError) and error.filename:  # it can not even be opened
            raise BadInputError(f'{path}: {error.strerror}') from error
        raise BadInputError(f'{path} is not a bag, or is damaged ({error}); `rosbag reindex` and `rosbag fix` may mend '
                            'a damaged one') from error
    with bag:
        yield bag


def parts_of_recordings(paths: Sequence[Path]) -> List[List[Path]]:
    """Return the parts of each recording: bags that follow each other by name and time, as of rosbag record --split."""
    recordings: List[List[Path]] = []
    for path in paths:
        if recordings and _follows(recordings[-1][-1], path):
            recordings[-1].append(path)
        else:
            recordings.append([path])
    return recordings


def _follows(before: Path, path: Path) -> bool:
    names = [_PART.fullmatch(each.name.partition('.')[0]) for each in (before, path)]
    if not (names[0] and names[1] and before.parent == path.parent and names[0][1] == names[1][1]
            and int(names[0][2]) + 1 == int(names[1][2])):
        return False
    with suppress(BadInputError, rosbag.ROSBagException), open_bag(before) as first, open_bag(path) as second:
        return bool(abs(second.get_start_time() - first.get_end_time()) < _PART_PAUSE)
    return False  # damaged, or empty


@contextmanager
def new_bag(path: Path, compression: str = 'none', mcap: bool = False) -> Iterator[rosbag.Bag]:
    """Yield a bag to write; it is complete when the block has ended.

    Args:
        compression: one of COMPRESSIONS.
        mcap: write a file for Foxglove and ROS 2 instead.

    Raises:
        ParameterError: this compression is not available.
        OSError: it can not be written, with its name.
    """
    with naming(path), path.open('w+b') as file:  # which is closed alone after an error: a bag would write on
        try:
            bag = McapFile(file, compression) if mcap else rosbag.Bag(file, 'w', compression=compression)
        except (ValueError, rosbag.ROSBagException) as error:
            raise ParameterError(f'--compression {compression} is not available: {error}') from error
        yield bag
        bag.close()


def write_static_transforms(bag: rosbag.Bag, transforms: Sequence[TransformStamped], time: genpy.Time, program: str
                            ) -> None:
    """Write static transforms as a broadcaster has latched them: later subscribers get them as well."""
    bag.write(TF_TOPIC, TFMessage(list(transforms)), time,
              connection_header={**header_of(TF_TOPIC, TFMessage), 'callerid': f'/{program}'})


def topic_types(bag: rosbag.Bag) -> Dict[str, str]:
    """Return the type of each topic in a bag, of a topic with messages of several types all of them: 'A and B'.

    Topics whose messages are all lost, as after a reindex, are left out.
    """
    topics = bag.get_type_and_topic_info().topics
    if isinstance(bag, Ros2Recording):
        return {topic: one.msg_type for topic, one in topics.items()}
    found: List[Tuple[str, str]] = []
    next(bag.read_messages(connection_filter=lambda topic, kind, *_: found.append((topic, kind))), None)
    return joined_types((topic, kind) for topic, kind in found if topics[topic].message_count)


def messages_of(bag: rosbag.Bag, topics: Sequence[str], *span: Optional[genpy.Time], **options: bool
                ) -> Iterator[Any]:
    """Yield what `bag.read_messages` gives.

    Raises:
        BadInputError: the bag is damaged, or messages of these topics are defined by what is no definition.
    """
    messages = bag.read_messages([*topics], *span, connection_filter=_is_defined, **options)
    while topics:  # without any, rosbag would read all
        try:
            message = next(messages)
        except StopIteration:
            return
        except BadInputError:
            raise
        except Exception as error:  # rosbag lets through what its parsers of definitions and messages raise
            mending = MENDING if isinstance(bag, Ros2Recording) else '`rosbag reindex` may save the rest'
            raise BadInputError(f'{bag.filename} is damaged, or defines its types in part: messages on '
                                f'{" or ".join(topics)} can not be read ({error}); {mending}') from error
        yield message


def _is_defined(topic: str, kind: str, checksum: str, definition: str, _: Any) -> bool:
    """Tell rosbag that it may make code of a definition, which it runs; errors as `messages_of`."""
    for line in (kind, *definition.split('\n')):
        if not _DEFINITION.fullmatch(line.strip()):
            raise BadInputError(f'the definition of messages on {topic} has a line that is no field: {line[:100]!r}')
    installed = get_message_class(kind)
    if installed is not None and installed._md5sum == checksum:  # whose definition may be incomplete in the bag
        rosbag.bag._message_types[checksum] = installed
    return True


def stamped_messages(bag: rosbag.Bag, topics: Sequence[str], start: Optional[genpy.Time] = None,
                     end: Optional[genpy.Time] = None) -> Iterator[StampedMessage]:
    """Yield the messages of topics in the order of their recording; one at a time is held in memory.

    Args:
        start, end: of the recording, None: all.

    Raises:
        BadInputError: the bag is damaged.
    """
    for topic, raw, time, connection in messages_of(bag, topics, start, end, raw=True, return_connection_header=True):
        stamp, frame_id = None, ''
        if raw[4]._slot_types[:1] == ['std_msgs/Header']:
            if len(raw[1]) < _HEADER.size:
                raise BadInputError(f'{bag.filename} is damaged: a message of {topic} has {len(raw[1])} bytes')
            _, seconds, nanoseconds, length = _HEADER.unpack_from(raw[1])
            stamp = 1000000000 * seconds + nanoseconds
            frame_id = frame_name(raw[1][_HEADER.size:_HEADER.size + length].decode(errors='replace'))
        yield StampedMessage(topic, raw, stamp, frame_id, time.to_nsec(), connection)


def deserialized(message: StampedMessage, kind: Optional[Type[genpy.Message]] = None) -> Any:
    """Return the message.

    Args:
        kind: class by which this project knows the type; None: the one that the bag defines.

    Raises:
        BadInputError: the bag has another definition, or the message is damaged.
    """
    name, data, checksum, _, defined = message.raw
    if kind is not None and checksum != kind._md5sum:
        raise BadInputError(f'messages of type {name} in the bag have another definition than {kind._type} here')
    try:
        found = (kind or defined)().deserialize(data)
        if message.stamp is not None:
            getattr(found, found.__slots__[0]).frame_id = message.frame_id
        return found
    except genpy.DeserializationError as error:
        raise BadInputError(f'the bag is damaged: a {name} on {message.topic}: {error}') from error

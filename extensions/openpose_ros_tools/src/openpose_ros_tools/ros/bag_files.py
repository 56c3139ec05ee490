"""Opening and reading bags, with helpful errors."""
import re
import struct
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Type

import genpy
import rosbag
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.output.files import naming
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.ros.topics import TopicFinder
from openpose_ros_tools.recording_paths import MCAP_SUFFIX, is_ros2, is_video
from openpose_ros_tools.ros.ros2_bags import MENDING, McapFile, Ros2Recording, header_of
from openpose_ros_tools.ros.video_recording import VideoRecording

COMPRESSIONS = (rosbag.Compression.NONE, rosbag.Compression.LZ4, rosbag.Compression.BZ2)
"""Compressions of bags, as the command line names them."""

TF_TOPIC = '/tf_static'
"""Topic of static transforms."""
TF_TOPICS = ('/tf', '/tf_static', 'tf', 'tf_static')
"""Topics of transforms in bags."""

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
    """Open a bag to read it, or a recording of ROS 2 or a video, which is then like a bag.

    Raises:
        BadInputError: it is not there, is no bag, or has no index.
    """
    if is_ros2(path) or is_video(path):
        yield Ros2Recording(path) if is_ros2(path) else VideoRecording(path)
        return
    try:
        bag = rosbag.Bag(str(path))
    except rosbag.ROSBagUnindexedException:
        raise BadInputError(f'{path} has no index, as recordings have that were cut off or damaged; mend it with: '
                            f'rosbag reindex {path}') from None
    except Exception as error:  # as in `stamped_messages`
        if isinstance(error, OSError) and error.filename:  # it can not even be opened
            raise BadInputError(f'{path}: {error.strerror}') from error
        raise BadInputError(f'{path} is not a bag, or is damaged ({error}); `rosbag reindex` and `rosbag fix` may mend '
                            'a damaged one') from error
    with bag:
        if bag.version < 200:  # rosbag opens it, and can not read its messages
            major, minor = divmod(bag.version, 100)
            raise BadInputError(f'{path} is a bag of format {major}.{minor}, from before 2010: record it anew while '
                                '`rosbag play` plays it')
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
    if is_video(before) or is_video(path):  # without a time of their own
        return False
    with suppress(BadInputError, rosbag.ROSBagException), open_bag(before) as first, open_bag(path) as second:
        return bool(abs(second.get_start_time() - first.get_end_time()) < _PART_PAUSE)
    return False  # damaged, or empty


@contextmanager
def new_bag(path: Path, compression: str = 'none') -> Iterator[rosbag.Bag]:
    """Yield a bag to write, or where the name says so a file for Foxglove and ROS 2; complete when the block has ended.

    Args:
        path: of the file, or its part.
        compression: one of COMPRESSIONS.

    Raises:
        ParameterError: this compression is not available.
        OSError: it can not be written, with its name.
    """
    is_mcap = path.name.endswith((MCAP_SUFFIX, f'{MCAP_SUFFIX}.part'))
    with naming(path), path.open('w+b') as file:  # which is closed alone after an error: a bag would write on
        try:
            bag = McapFile(file, compression) if is_mcap else rosbag.Bag(file, 'w', compression=compression)
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
    """Return the type of each topic in a bag; topics whose messages are lost, as after a reindex, are left out."""
    topics = bag.get_type_and_topic_info().topics
    return {topic: one.msg_type for topic, one in topics.items() if one.message_count}


def message_count(bag: rosbag.Bag, topic: str) -> int:
    """Return the number of messages of a topic that is in a bag; a video that does not state its images has one."""
    return int(bag.get_type_and_topic_info().topics[topic].message_count)


def topic_finder(bag: rosbag.Bag, namespace: str = '') -> TopicFinder:
    """Return the finder of the topics of a camera in a bag, of those in a namespace."""
    return TopicFinder(topic_types(bag), lambda topic: deserialized(next(stamped_messages(bag, [topic]))),
                       str(bag.filename), namespace)


def stamped_messages(bag: rosbag.Bag, topics: Sequence[str], start: Optional[genpy.Time] = None,
                     end: Optional[genpy.Time] = None) -> Iterator[StampedMessage]:
    """Yield the messages of topics in the order of their recording; one at a time is held in memory.

    Args:
        start, end: of the recording, None: all.

    Raises:
        BadInputError: the bag is damaged, or defines these messages in part.
    """
    messages = bag.read_messages([*topics], start, end, raw=True, return_connection_header=True)
    while topics:  # without any, rosbag would read all
        try:
            topic, raw, time, connection = next(messages)
        except StopIteration:
            return
        except Exception as error:  # rosbag lets through what its parsers of definitions and messages raise
            mending = MENDING if isinstance(bag, Ros2Recording) else '`rosbag reindex` may save the rest'
            raise BadInputError(f'{bag.filename} is damaged, or defines its types in part: messages on '
                                f'{" or ".join(topics)} can not be read ({error}); {mending}') from error
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

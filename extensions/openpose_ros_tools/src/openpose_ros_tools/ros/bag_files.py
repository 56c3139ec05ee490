"""Opening and reading bags, with helpful errors."""
import bz2
import io
import os
import re
import struct
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Type, TypeVar

import genpy
import rosbag
import rosbag.bag
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.output.files import naming
from openpose_ros_tools.recording_paths import is_ros2
from openpose_ros_tools.ros.bag_definitions import TYPE_NAME, harmless_definition
from openpose_ros_tools.ros.ros2_bags import MENDING, McapFile, Ros2Recording, joined_types

Item = TypeVar('Item')

COMPRESSIONS = (rosbag.Compression.NONE, rosbag.Compression.LZ4, rosbag.Compression.BZ2)
"""Compressions of bags, as the command line names them."""

TF_TOPIC = '/tf_static'
"""Topic of static transforms."""

# What rosbag raises for damaged files.
_DAMAGE = (rosbag.ROSBagException, genpy.DeserializationError, struct.error, EOFError, OSError, ValueError, KeyError,
           IndexError, TypeError, AttributeError, RuntimeError, SyntaxError, genpy.generator.MsgGenerationException)
# Versions before it define types on the way; 200 is 2.0.
_LEAST_VERSION = 200
# A chunk, when it is decompressed, has at most as many bytes: those of the largest message that roscpp takes.
_LARGEST_CHUNK = 1 << 30
# Of LZ4, as many compressed bytes at a time; they become 255 times as many at most.
_LZ4_PIECE = 1 << 16
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


class _BagFile(io.BufferedReader):
    """Reads no more bytes than the file has: a damaged length would take up to 4 GB of memory."""

    def read(self, size: Optional[int] = -1) -> bytes:
        """See `io.BufferedReader.read`."""
        if size is not None and size > io.DEFAULT_BUFFER_SIZE:
            size = min(size, max(os.fstat(self.fileno()).st_size - self.tell(), 0))
        return super().read(size)


class _BoundedReader(rosbag.bag._BagReader200):
    """Reads compressed chunks up to the size in their header; rosbag has no limit: a megabyte may become gigabytes."""

    decompressed_chunk_pos: Optional[int]

    def seek_and_read_message_data_record(self, position: Tuple[int, int], *options: bool) -> Any:
        """See the base class, which finds the chunk decompressed."""
        chunk = self.bag._chunk_headers.get(position[0])
        if chunk and chunk.compression != rosbag.Compression.NONE and self.decompressed_chunk_pos != position[0]:
            self.bag._file.seek(chunk.data_pos)
            data = self.bag._encryptor.decrypt_chunk(self.bag._file.read(chunk.compressed_size))
            self.decompressed_chunk_io = io.BytesIO(_decompressed(data, chunk))
            self.decompressed_chunk_pos = position[0]
        return super().seek_and_read_message_data_record(position, *options)


def _decompressed(data: bytes, chunk: rosbag.bag._ChunkHeader) -> bytes:
    """Decompress a chunk; raises ROSBagException where it is too large, or has another size than its header says."""
    size = chunk.uncompressed_size
    if size > _LARGEST_CHUNK:
        raise rosbag.ROSBagException(f'a chunk has {size} bytes when decompressed, expected at most {_LARGEST_CHUNK}')
    if chunk.compression == rosbag.Compression.BZ2:
        content = bz2.BZ2Decompressor().decompress(data, size + 1)
    elif chunk.compression == rosbag.Compression.LZ4:
        decompressor, content = rosbag.bag.roslz4.LZ4Decompressor(), b''
        for start in range(0, len(data), _LZ4_PIECE):
            content += decompressor.decompress(data[start:start + _LZ4_PIECE])
            if len(content) > size:
                break
    else:
        raise rosbag.ROSBagException(f'unsupported compression type: {chunk.compression}')
    if len(content) != size:
        raise rosbag.ROSBagException(f'a chunk has {"more" if len(content) > size else "less"} than the {size} bytes '
                                     'that its header says')
    return content


@contextmanager
def open_bag(path: Path) -> Iterator[rosbag.Bag]:
    """Open a bag to read it, or a recording of ROS 2, which is then like a bag.

    Raises:
        BadInputError: it is not there, is no bag, has no index, or defines messages by what is no definition.
    """
    if is_ros2(path):
        yield Ros2Recording(path)
        return
    try:
        bag = rosbag.Bag(_BagFile(io.FileIO(str(path))))
        bag._filename = str(path)  # which it does not know of a file that is open
    except rosbag.ROSBagUnindexedException:
        raise BadInputError(f'{path} has no index, as recordings have that were cut off or damaged; mend it with: '
                            f'rosbag reindex {path}') from None
    except _DAMAGE as error:
        if isinstance(error, OSError) and error.filename:  # it can not even be opened
            raise BadInputError(f'{path}: {error.strerror}') from error
        raise BadInputError(f'{path} is not a bag, or is damaged ({error}); `rosbag reindex` and `rosbag fix` may mend '
                            'a damaged one') from error
    with bag:
        _make_harmless(bag)
        bag._reader = _BoundedReader(bag)
        yield bag


def _make_harmless(bag: rosbag.Bag) -> None:
    """See `harmless_definition`. The headers of the connections, which go into copies of a bag, stay as they are."""
    if bag.version < _LEAST_VERSION:
        raise BadInputError(f'{bag.filename} has version {bag.version / 100:.1f}, expected 2.0 or later, as all have '
                            'since 2010')
    for connection in bag._get_connections():
        if not re.fullmatch(TYPE_NAME, connection.datatype, re.ASCII):
            raise BadInputError(f'{bag.filename} has messages of a type that is no name: {connection.datatype[:100]!r}')
        connection.msg_def = harmless_definition(connection.msg_def)


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
        return bool(abs(second.get_start_time() - end_time(first)) < _PART_PAUSE)
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
    with naming(path):
        try:
            bag = McapFile(path, compression) if mcap else rosbag.Bag(str(path), 'w', compression=compression)
        except (ValueError, rosbag.ROSBagException) as error:
            raise ParameterError(f'--compression {compression} is not available: {error}') from error
        file = bag._file  # for after an error, as the bag would write on while it closes
        try:
            yield bag
            bag.close()
        except BaseException:
            with suppress(OSError):
                file.close()
            raise


def write_static_transforms(bag: rosbag.Bag, transforms: Sequence[TransformStamped], time: genpy.Time, program: str
                            ) -> None:
    """Write static transforms as a broadcaster has latched them: later subscribers get them as well."""
    connection = {'topic': TF_TOPIC, 'type': TFMessage._type, 'md5sum': TFMessage._md5sum,
                  'message_definition': TFMessage._full_text, 'callerid': f'/{program}', 'latching': '1'}
    bag.write(TF_TOPIC, TFMessage(list(transforms)), time, connection_header=connection)


def end_time(bag: rosbag.Bag) -> float:
    """Return the time of the last message [s]; rosbag takes the last chunk for the newest, which it need not be."""
    if isinstance(bag, Ros2Recording):
        return bag.get_end_time()
    return max((float(chunk.end_time.to_sec()) for chunk in bag._chunks), default=0.0)


def topic_types(bag: rosbag.Bag) -> Dict[str, str]:
    """Return the type of each topic in a bag, of a topic with messages of several types all of them: 'A and B'.

    Topics whose messages are all lost, as after a reindex, are left out.
    """
    if isinstance(bag, Ros2Recording):
        return {topic: one.msg_type for topic, one in bag.get_type_and_topic_info().topics.items()}
    return joined_types((one.topic, one.datatype) for one in bag._get_connections()
                        if bag._connection_indexes.get(one.id))


def undamaged(bag: rosbag.Bag, messages: Iterator[Item]) -> Iterator[Item]:
    """Yield what `bag.read_messages` gave.

    Raises:
        BadInputError: the bag is damaged.
    """
    while True:
        try:
            message = next(messages)
        except StopIteration:
            return
        except _DAMAGE as error:
            raise BadInputError(f'{bag.filename} is damaged ({error}); {MENDING}' if isinstance(bag, Ros2Recording) else
                                f'{bag.filename} is damaged, near byte {bag._file.tell()} ({error}); `rosbag reindex` '
                                'may save the rest') from error
        yield message


def stamped_messages(bag: rosbag.Bag, topics: Sequence[str], start: Optional[genpy.Time] = None,
                     end: Optional[genpy.Time] = None) -> Iterator[StampedMessage]:
    """Yield the messages of topics in the order of their recording; one at a time is held in memory.

    Args:
        start, end: of the recording, None: all.

    Raises:
        BadInputError: the bag is damaged.
    """
    if not topics:
        return  # rosbag would read all
    for topic, raw, time, connection in undamaged(bag, bag.read_messages(
            list(topics), start, end, raw=True, return_connection_header=True)):
        stamp, frame_id = None, ''
        if raw[4]._slot_types[:1] == ['std_msgs/Header']:
            if len(raw[1]) < _HEADER.size:
                raise BadInputError(f'{bag.filename} is damaged: a message of {topic} has {len(raw[1])} bytes')
            _, seconds, nanoseconds, length = _HEADER.unpack_from(raw[1])
            stamp = 1000000000 * seconds + nanoseconds
            frame_id = raw[1][_HEADER.size:_HEADER.size + length].decode(errors='replace')
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
        return (kind or defined)().deserialize(data)
    except genpy.DeserializationError as error:
        raise BadInputError(f'the bag is damaged: a {name} on {message.topic}: {error}') from error

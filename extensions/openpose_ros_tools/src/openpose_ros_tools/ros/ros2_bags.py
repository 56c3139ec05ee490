"""Recordings of ROS 2 with the methods of `rosbag.Bag`: rosbags reads them, mcap writes files for Foxglove and ROS 2.

The bytes of a message are converted between CDR and the serialization of ROS 1; ROS 2 has no `seq` in headers.
"""
from importlib import import_module
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any, BinaryIO, Collection, Dict, Iterator, List, Optional, Tuple, Type

import genpy
import genpy.dynamic
import rosbag
from roslib.message import get_message_class

from openpose_ros_pkg.errors import BadInputError, ParameterError

MENDING = '`ros2 bag reindex` and `mcap recover` may mend it'
"""What may help where a recording is damaged."""

_HEADER = 'MSG: std_msgs/Header\n'
# Types that are messages in ROS 2, and part of the language or of other fields in ROS 1.
_BUILT_IN = ('std_msgs/msg/Header', 'builtin_interfaces/msg/Time', 'builtin_interfaces/msg/Duration')
# Latched topics: keep the last message, reliable, transient local; rosbag2_transport/qos.cpp.
_LATCHED = {'offered_qos_profiles': (
    '- {history: 1, depth: 1, reliability: 1, durability: 1, deadline: {sec: 0, nsec: 0}, lifespan: {sec: 0, nsec: 0}, '
    'liveliness: 1, liveliness_lease_duration: {sec: 0, nsec: 0}, avoid_ros_namespace_conventions: false}')}


class LikeBag:
    """What `rosbag.Bag` tells without its messages.

    Attributes:
        filename: path.
    """

    filename: str
    _topics: Dict[str, Tuple[str, int]]  # type and number of messages
    _start: float  # time of the first message [ns]
    _end: float  # of the last one

    def get_type_and_topic_info(self) -> Any:
        """Return `topics`: type and number of messages."""
        return SimpleNamespace(topics={topic: SimpleNamespace(msg_type=kind, message_count=count)
                                       for topic, (kind, count) in self._topics.items()})

    def get_start_time(self) -> float:
        """Return the time of the first message [s]."""
        return float(self._start / 1e9)

    def get_end_time(self) -> float:
        """Return the time of the last message [s]."""
        return float(self._end / 1e9)


class Ros2Recording(LikeBag):
    """A recording of ROS 2 with the methods of `rosbag.Bag` that read.

    Raises:
        BadInputError: it can not be read, or rosbags is not installed.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._ros2 = path, _foxy('read recordings of ROS 2')
        self.filename = str(path)
        self._kinds: Dict[str, Tuple[Type[genpy.Message], Any]] = {}
        try:
            with self._reader() as reader:
                self._store, self._start, self._end = reader.typestore, reader.start_time, reader.end_time
                self._topics = {one.topic: (_ros1_name(one.msgtype), one.msgcount) for one in _connections(reader)}
        except Exception as error:  # rosbags lets through what its parsers of YAML, SQLite and MCAP raise
            raise BadInputError(f'{path} is no recording of ROS 2, or is damaged or unfinished ({error}); {MENDING}'
                                ) from error

    def read_messages(self, topics: Collection[str], start: Optional[genpy.Time], end: Optional[genpy.Time],
                      **_: bool) -> Iterator[Tuple[Any, ...]]:
        """Yield raw messages with headers of connections, as `rosbag.Bag.read_messages` does when it is asked for them.

        Raises:
            ROSBagException: it is damaged.
        """
        span = None if start is None else start.to_nsec(), None if end is None else end.to_nsec() + 1
        try:
            with self._reader() as reader:
                wanted = [one for one in _connections(reader) if one.topic in topics]
                for connection, time, data in reader.messages(wanted, *span) if wanted else ():
                    kind, store = self._kind_of(connection.msgtype)
                    content = bytes(store.cdr_to_ros1(data, connection.msgtype))
                    yield (connection.topic, (kind._type, content, kind._md5sum, None, kind), genpy.Time(0, time),
                           header_of(connection.topic, kind))
        except Exception as error:  # as above
            raise rosbag.ROSBagException(f'{type(error).__name__}: {error}') from error

    def _reader(self) -> Any:
        """Return a reader; each belongs to one thread, as SQLite's connections do."""
        return import_module('rosbags.highlevel').AnyReader([self._path], default_typestore=self._ros2)

    def _kind_of(self, name: str) -> Tuple[Type[genpy.Message], Any]:
        """Return the class of ROS 1 of a type, the installed one where it has the same fields, and what encodes it."""
        if name not in self._kinds:
            ros1_name, store = _ros1_name(name), self._store
            installed = get_message_class(ros1_name)
            if name not in _definitions(store):  # recordings before ROS 2 Iron define no types
                if installed is None:
                    raise rosbag.ROSBagException(f'type {name} is neither defined in the recording nor installed')
                store = _store_of(installed, self._ros2)
            if installed is None or not _is_same(installed, store):
                text = store.generate_msgdef(name, ros_version=1)[0].replace(_HEADER, f'{_HEADER}uint32 seq\n')
                installed = genpy.dynamic.generate_dynamic(ros1_name, text)[ros1_name]
            self._kinds[name] = installed, store
        return self._kinds[name]


class McapFile:
    """A file for Foxglove and ROS 2 with the methods of `rosbag.Bag` that write.

    Raises:
        ParameterError: this compression is not available.
        BadInputError: rosbags or mcap is not installed.
    """

    def __init__(self, file: BinaryIO, compression: str) -> None:
        mcap, self._ros2 = _library('mcap.writer', 'write MCAP'), _foxy('write MCAP')
        kinds = {'none': mcap.CompressionType.NONE, 'lz4': mcap.CompressionType.LZ4}
        if compression not in kinds:
            raise ParameterError(f'--compression {compression} is not available for MCAP, expected none or lz4')
        self._writer = mcap.Writer(file, compression=kinds[compression])
        self._writer.start(profile='ros2', library='openpose_ros')
        # by topic and type: number of the channel, and what encodes the type
        self._channels: Dict[Tuple[str, str], Tuple[int, Any]] = {}

    def write(self, topic: str, message: Any, time: genpy.Time, raw: bool = False,
              connection_header: Optional[Dict[str, Any]] = None) -> None:
        """Write a message as `rosbag.Bag.write` does."""
        if raw:
            _, content, _, _, kind = message
        else:
            buffer, kind = BytesIO(), type(message)
            message.serialize(buffer)
            content = buffer.getvalue()
        name = kind._type.replace('/', '/msg/')
        if (topic, name) not in self._channels:
            store = _store_of(kind, self._ros2)
            definition = store.generate_msgdef(name, ros_version=2)[0]
            schema = self._writer.register_schema(name, 'ros2msg', definition.encode())
            qos = _LATCHED if (connection_header or {}).get('latching') in ('1', b'1') else {}
            self._channels[topic, name] = self._writer.register_channel(topic, 'cdr', schema, qos), store
        channel, store = self._channels[topic, name]
        self._writer.add_message(channel, time.to_nsec(), bytes(store.ros1_to_cdr(content, name)), time.to_nsec())

    def close(self) -> None:
        """Finish the file."""
        self._writer.finish()


def _library(name: str, purpose: str) -> Any:
    try:
        return import_module(name)
    except ImportError as error:
        package = name.partition('.')[0]
        raise BadInputError(f"the library {package} is needed to {purpose}: './run setup' installs it, or 'python3 -m "
                            f"pip install {package}' ({error})") from None


def _foxy(purpose: str) -> Any:
    typesys = _library('rosbags.typesys', purpose)
    return typesys.get_typestore(typesys.Stores.ROS2_FOXY)


def _connections(reader: Any) -> List[Any]:
    """Return the topics of a reader, without services and actions."""
    return [one for one in reader.connections if '/msg/' in one.msgtype]


def _ros1_name(name: str) -> str:
    return name.replace('/msg/', '/')


def _definitions(store: Any) -> Dict[str, Any]:
    """Return the types of a store: FIELDDEFS in rosbags 0.9, the last one for Python 3.8 and 3.9, fielddefs later."""
    return getattr(store, 'fielddefs', None) or getattr(store, 'FIELDDEFS', {})


def _types_of(kind: Type[genpy.Message]) -> Dict[str, Any]:
    """Return the definitions of a type of ROS 1 and of those in it, without those that are built into ROS 1."""
    parsed = import_module('rosbags.typesys').get_types_from_msg(kind._full_text, kind._type.replace('/', '/msg/'))
    return {name: definition for name, definition in parsed.items() if name not in _BUILT_IN}


def _is_same(kind: Type[genpy.Message], store: Any) -> bool:
    """Return whether the fields of a type have the same types in a store; names may differ: CameraInfo has K and k."""
    known = _definitions(store)
    return all(name in known and [field[1] for field in known[name][1]] == [field[1] for field in definition[1]]
               for name, definition in _types_of(kind).items())


def _store_of(kind: Type[genpy.Message], ros2: Any) -> Any:
    """Return what encodes a type: the store of ROS 2 where it has the same fields, else one of its own."""
    if _is_same(kind, ros2):
        return ros2
    typesys = import_module('rosbags.typesys')
    store = typesys.get_typestore(typesys.Stores.EMPTY)
    store.register({**_types_of(kind), **{name: _definitions(ros2)[name] for name in _BUILT_IN}})
    return store


def header_of(topic: str, kind: Type[genpy.Message]) -> Dict[str, str]:
    """Return the header of a connection of ROS 1."""
    return {'topic': topic, 'type': kind._type, 'md5sum': kind._md5sum, 'message_definition': kind._full_text,
            **({'latching': '1'} if topic.endswith('tf_static') else {})}

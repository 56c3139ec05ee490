"""Recordings of ROS 2, read and written as if they were bags of ROS 1.

A message of ROS 2 becomes one of ROS 1 by its bytes: the same fields in another encoding (CDR), but for `seq` of
headers. The library rosbags reads the files and encodes the bytes; mcap writes files for Foxglove and ROS 2.
"""
from contextlib import ExitStack, contextmanager
from importlib import import_module
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import get_ident
from types import ModuleType, SimpleNamespace
from typing import Any, Collection, Dict, Iterable, Iterator, List, NamedTuple, Optional, Set, Tuple, Type

import genpy
import genpy.dynamic
import rosbag
import yaml
from rosbag.bag import BagMessage, BagMessageWithConnectionHeader
from roslib.message import get_message_class

from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_tools.recording_paths import MCAP_SUFFIX, METADATA
from openpose_ros_tools.ros.bag_definitions import harmless_definition

MENDING = '`ros2 bag reindex` and `mcap recover` may mend it'
"""What may help where a recording is damaged."""

# The newest metadata that rosbags reads before its 0.10.
_OLD_VERSION = 8
# Types that ROS 2 has as its own, and ROS 1 as part of its language.
_HEADER = 'MSG: std_msgs/Header\n'
_BUILT_IN = ('std_msgs/msg/Header', 'builtin_interfaces/msg/Time', 'builtin_interfaces/msg/Duration')
# Of latched topics: keep the last message, reliable, transient local.
# https://github.com/ros2/rosbag2/blob/rolling/docs/message_definition_encoding.md and rosbag2_transport/qos.cpp
_LATCHED = yaml.safe_dump([{
    'history': 1, 'depth': 1, 'reliability': 1, 'durability': 1, 'deadline': {'sec': 0, 'nsec': 0},
    'lifespan': {'sec': 0, 'nsec': 0}, 'liveliness': 1, 'liveliness_lease_duration': {'sec': 0, 'nsec': 0},
    'avoid_ros_namespace_conventions': False}])


class Ros2Recording:
    """A recording of ROS 2 with those methods of `rosbag.Bag` that read.

    Attributes:
        filename: path.

    Raises:
        BadInputError: it can not be read, or the library that reads it is not there.
    """

    def __init__(self, path: Path) -> None:
        self._rosbags = rosbags = _library('rosbags', 'read recordings of ROS 2')
        self.filename, self._thread = str(path), get_ident()
        self._stack = ExitStack()
        self._ros2 = rosbags.typesys.get_typestore(rosbags.typesys.Stores.ROS2_FOXY)
        self._kinds: Dict[str, Tuple[Type[genpy.Message], Any]] = {}
        try:
            self._source = self._stack.enter_context(_readable(path))
            self._reader = self._stack.enter_context(self._opened())
        except Exception as error:  # rosbags lets through what its parsers of YAML, SQLite and MCAP raise
            self.close()
            raise BadInputError(f'{path} is no recording of ROS 2, or is damaged or unfinished ({error}); {MENDING}'
                                ) from error
        self._connections = _connections(self._reader)

    def __enter__(self) -> 'Ros2Recording':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close it."""
        self._stack.close()

    def get_type_and_topic_info(self) -> Any:
        """Return `topics`: type and number of messages of each topic."""
        topics: Dict[str, Any] = {}
        for one in self._connections:
            known = topics.setdefault(one.topic, SimpleNamespace(msg_type=_ros1_name(one.msgtype), message_count=0))
            known.message_count += one.msgcount
        return SimpleNamespace(topics=topics)

    def types(self) -> Dict[str, str]:
        """Return the type of each topic that has messages, see `joined_types`."""
        return joined_types((one.topic, _ros1_name(one.msgtype)) for one in self._connections if one.msgcount)

    def get_message_count(self, topic: str) -> int:
        """Return the number of messages of a topic."""
        return sum(one.msgcount for one in self._connections if one.topic == topic)

    def get_start_time(self) -> float:
        """Return the time of the first message [s]."""
        return float(self._reader.start_time / 1e9)

    def get_end_time(self) -> float:
        """Return the time of the last message [s]."""
        return float(self._reader.end_time / 1e9)

    def read_messages(self, topics: Optional[Collection[str]] = None, start_time: Optional[genpy.Time] = None,
                      end_time: Optional[genpy.Time] = None, raw: bool = False,
                      return_connection_header: bool = False) -> Iterator[Tuple[Any, ...]]:
        """Yield messages as `rosbag.Bag.read_messages` does; raises ROSBagException where it is damaged."""
        start = None if start_time is None else start_time.to_nsec()
        stop = None if end_time is None else end_time.to_nsec() + 1
        with ExitStack() as stack:
            # SQLite of Python, with which rosbags before 0.10 reads, belongs to the thread that has opened it
            is_own = self._thread == get_ident()
            reader = self._reader if is_own else stack.enter_context(self._opened())
            wanted = [one for one in _connections(reader) if topics is None or one.topic in topics]
            messages = reader.messages(wanted, start, stop) if wanted else iter(())
            yield from self._converted(messages, raw, return_connection_header)

    def _opened(self) -> Any:
        return self._rosbags.highlevel.AnyReader([self._source], default_typestore=self._ros2)

    def _converted(self, messages: Iterator[Tuple[Any, int, bytes]], raw: bool, with_header: bool
                   ) -> Iterator[Tuple[Any, ...]]:
        while True:
            try:
                found = next(messages, None)
                if found is None:
                    return
                connection, time, data = found
                kind, store = self._kind_of(connection.msgtype)
                content = bytes(store.cdr_to_ros1(data, connection.msgtype))
            except Exception as error:  # as above
                raise rosbag.ROSBagException(f'{type(error).__name__}: {error}') from error
            message = (kind._type, content, kind._md5sum, None, kind) if raw else kind().deserialize(content)
            stamp = genpy.Time(0, time)
            if with_header:
                header = _header_of(connection.topic, kind)
                yield BagMessageWithConnectionHeader(connection.topic, message, stamp, header)
            else:
                yield BagMessage(connection.topic, message, stamp)

    def _kind_of(self, name: str) -> Tuple[Type[genpy.Message], Any]:
        """Return the class of ROS 1 of a type, the installed one where it has the same fields, and what encodes it."""
        if name not in self._kinds:
            ros1_name, store = _ros1_name(name), self._reader.typestore
            installed = get_message_class(ros1_name)
            if name not in _definitions(store):  # older recordings do not tell
                if installed is None:
                    raise rosbag.ROSBagException(f'type {name} is neither defined in the recording nor installed')
                store = _store_of(installed, self._ros2)
            if installed is None or not _is_same(installed, store):
                text = store.generate_msgdef(name, ros_version=1)[0].replace(_HEADER, f'{_HEADER}uint32 seq\n')
                installed = genpy.dynamic.generate_dynamic(ros1_name, harmless_definition(text))[ros1_name]
            self._kinds[name] = installed, store
        return self._kinds[name]


class _Channel(NamedTuple):
    """A topic of a file that is written: number of its channel, name of its type, and what encodes it."""

    number: int
    kind: str
    store: Any


class McapFile:
    """A file for Foxglove and ROS 2, with those methods of `rosbag.Bag` that write.

    Raises:
        ParameterError: this compression is not available.
        BadInputError: a library that writes it is not there.
        OSError: it can not be written.
    """

    def __init__(self, path: Path, compression: str) -> None:
        rosbags, mcap = (_library(name, 'write MCAP') for name in ('rosbags', 'mcap'))
        kinds = {'none': mcap.writer.CompressionType.NONE, 'lz4': mcap.writer.CompressionType.LZ4}
        if compression not in kinds:
            raise ParameterError(f'--compression {compression} is not available for MCAP, expected '
                                 + ' or '.join(kinds))
        self._ros2 = rosbags.typesys.get_typestore(rosbags.typesys.Stores.ROS2_FOXY)
        self._file = path.open('wb')
        self._writer = mcap.writer.Writer(self._file, compression=kinds[compression])
        self._writer.start(profile='ros2', library='openpose_ros')
        self._channels: Dict[Tuple[str, str], _Channel] = {}  # by topic and type, of which a topic may have several
        self._schemas: Dict[str, int] = {}

    def write(self, topic: str, message: Any, time: genpy.Time, raw: bool = False,
              connection_header: Optional[Dict[str, Any]] = None) -> None:
        """Write a message as `rosbag.Bag.write` does."""
        if raw:
            _, content, _, _, kind = message
        else:
            buffer, kind = BytesIO(), type(message)
            message.serialize(buffer)
            content = buffer.getvalue()
        channel = self._channel(topic, kind, (connection_header or {}).get('latching') in ('1', b'1'))
        data = channel.store.ros1_to_cdr(content, channel.kind)
        self._writer.add_message(channel.number, time.to_nsec(), bytes(data), time.to_nsec())

    def close(self) -> None:
        """Finish the file."""
        self._writer.finish()
        self._file.close()

    def _channel(self, topic: str, kind: Type[genpy.Message], latched: bool) -> _Channel:
        key = topic, kind._type
        if key not in self._channels:
            name, store = _ros2_name(kind._type), _store_of(kind, self._ros2)
            if name not in self._schemas:
                text, _ = store.generate_msgdef(name, ros_version=2)
                self._schemas[name] = self._writer.register_schema(name, 'ros2msg', text.encode())
            qos = {'offered_qos_profiles': _LATCHED} if latched else {}
            number = self._writer.register_channel(topic, 'cdr', self._schemas[name], qos)
            self._channels[key] = _Channel(number, name, store)
        return self._channels[key]


def joined_types(found: Iterable[Tuple[str, str]]) -> Dict[str, str]:
    """Return the type of each topic; of one with messages of several types all of them, which no reader expects.

    Args:
        found: topics and types, in any order.
    """
    types: Dict[str, Set[str]] = {}
    for topic, kind in found:
        types.setdefault(topic, set()).add(kind)
    return {topic: ' and '.join(sorted(kinds)) for topic, kinds in types.items()}


def _library(name: str, purpose: str) -> ModuleType:
    """Return a library with its modules that are used here.

    Raises:
        BadInputError: it is not there.
    """
    modules = {'rosbags': ('rosbags.highlevel', 'rosbags.rosbag2', 'rosbags.typesys'),
               'mcap': ('mcap.reader', 'mcap.writer')}
    try:
        for module in modules[name]:
            import_module(module)
    except ImportError as error:
        raise BadInputError(f"the library {name} is needed to {purpose}: './run setup' installs it, or 'python3 -m pip "
                            f"install {name}' ({error})") from None
    return import_module(name)


def _connections(reader: Any) -> List[Any]:
    """Return the topics of a reader, without services and actions."""
    return [one for one in reader.connections if '/msg/' in one.msgtype]


def _ros1_name(name: str) -> str:
    """Return pkg/Type of pkg/msg/Type."""
    return name.replace('/msg/', '/')


def _ros2_name(name: str) -> str:
    """Return pkg/msg/Type of pkg/Type."""
    return name.replace('/', '/msg/')


def _definitions(store: Any) -> Dict[str, Any]:
    """Return the types that a store knows; the attribute has got another name with version 0.10 of rosbags."""
    return store.fielddefs if hasattr(store, 'fielddefs') else store.FIELDDEFS


def _types_of(kind: Type[genpy.Message]) -> Dict[str, Any]:
    """Return the definitions of a type of ROS 1 and of those in it, without those that are built into ROS 1."""
    parsed = _library('rosbags', '').typesys.get_types_from_msg(kind._full_text, _ros2_name(kind._type))
    return {name: definition for name, definition in parsed.items() if name not in _BUILT_IN}


def _is_same(kind: Type[genpy.Message], store: Any) -> bool:
    """Return whether a type of ROS 1 has the same fields as the one that a store knows; CameraInfo has K and k."""
    known = _definitions(store)
    return all(name in known and [field[1] for field in known[name][1]] == [field[1] for field in definition[1]]
               for name, definition in _types_of(kind).items())


def _store_of(kind: Type[genpy.Message], ros2: Any) -> Any:
    """Return what encodes a type: that of ROS 2 where it has the type with the same fields."""
    if _is_same(kind, ros2):
        return ros2
    typesys = _library('rosbags', '').typesys
    store = typesys.get_typestore(typesys.Stores.EMPTY)
    store.register({**_types_of(kind), **{name: _definitions(ros2)[name] for name in _BUILT_IN}})
    return store


def _header_of(topic: str, kind: Type[genpy.Message]) -> Dict[str, str]:
    """Return the header of a connection of ROS 1."""
    latched = {'latching': '1'} if topic.endswith('tf_static') else {}
    return {'topic': topic, 'type': kind._type, 'md5sum': kind._md5sum, 'message_definition': kind._full_text,
            **latched}


@contextmanager
def _readable(path: Path) -> Iterator[Path]:
    """Yield what rosbags reads: before 0.10 only folders, with metadata up to version 8; such a one is made then."""
    folder = path if path.is_dir() else path.parent
    if MCAP_SUFFIX in _library('rosbags', '').rosbag2.Reader.STORAGE_PLUGINS:
        yield path
        return
    if path.is_dir():
        metadata = yaml.safe_load((path / METADATA).read_text())
        if not _make_old(metadata['rosbag2_bagfile_information']):
            yield path
            return
    else:
        metadata = _metadata_of(path)
    with TemporaryDirectory() as made:
        for name in metadata['rosbag2_bagfile_information']['relative_file_paths']:
            if Path(name).name != name or name in ('', '..'):  # it would be a link somewhere else
                raise ValueError(f'{METADATA} names the file {name!r}, expected a name without folders')
            Path(made, name).symlink_to(folder.absolute() / name)
        Path(made, METADATA).write_text(yaml.safe_dump(metadata))
        yield Path(made)


def _make_old(information: Dict[str, Any]) -> bool:
    """Make metadata of version 9, that of ROS 2 Jazzy, those of version 8; return whether they were."""
    if information['version'] != _OLD_VERSION + 1:
        return False
    information['version'] = _OLD_VERSION
    for topic in information['topics_with_message_count']:
        topic['topic_metadata']['offered_qos_profiles'] = ''  # a list before, which is not read here
    return True


def _metadata_of(path: Path) -> Dict[str, Any]:
    """Return the metadata of rosbag2 for a single file."""
    if path.suffix != MCAP_SUFFIX:
        raise ValueError(f'name its folder, which holds {METADATA}')
    with path.open('rb') as file:
        summary = _library('mcap', 'read single files of MCAP').reader.make_reader(file).get_summary()
    if summary is None or summary.statistics is None:
        raise ValueError('it has no summary')
    figures = summary.statistics
    topics = [{'message_count': figures.channel_message_counts.get(number, 0), 'topic_metadata': {
        'name': channel.topic, 'type': summary.schemas[channel.schema_id].name,
        'serialization_format': channel.message_encoding}} for number, channel in summary.channels.items()]
    return {'rosbag2_bagfile_information': {
        'version': _OLD_VERSION, 'storage_identifier': 'mcap', 'relative_file_paths': [path.name],
        'message_count': figures.message_count,
        'starting_time': {'nanoseconds_since_epoch': figures.message_start_time},
        'duration': {'nanoseconds': figures.message_end_time - figures.message_start_time},
        'topics_with_message_count': topics, 'compression_format': '', 'compression_mode': ''}}

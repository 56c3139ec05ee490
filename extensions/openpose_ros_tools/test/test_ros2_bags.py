"""Recordings of ROS 2 give what the same recordings of ROS 1 give; results can be files for Foxglove and ROS 2."""
import csv
import sqlite3
from importlib import import_module
from io import BytesIO

import genpy
import numpy as np
import pytest
import rosbag
import yaml
from geometry_msgs.msg import TransformStamped
from known_recording import FRAME_ID, IMAGE, known_people, stamp_of, write_recording
from mcap.reader import make_reader
from openpose_ros_msgs.msg import PersonSignalsArray
from rosbags.rosbag2 import Reader, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from openpose_ros_tools.ros.bag_files import deserialized, message_count, open_bag, stamped_messages, topic_types
from openpose_ros_tools.ros.keypoints.keypoints_to_csv import main as keypoints_to_csv
from openpose_ros_tools.ros.keypoints.plot_keypoints import main as plot_keypoints
from openpose_ros_tools.ros.process_bag.program import main

KEYPOINTS = '/openpose_ros/skeleton_3d/detected_poses_keypoints_3d'
# The last rosbags for Python 3.8 and 3.9 reads folders only, and writes no MCAP.
NEW_LIBRARY = '.mcap' in Reader.STORAGE_PLUGINS
needs_files = pytest.mark.skipif(not NEW_LIBRARY, reason='rosbags before 0.10 reads folders only')
STORAGES = ['sqlite3', pytest.param('mcap', marks=needs_files)]


def writer_of(path, storage):
    """Return the writer of rosbags for a folder."""
    if not NEW_LIBRARY:
        return Writer(path)
    plugin = import_module('rosbags.rosbag2').StoragePlugin[storage.upper()]
    return Writer(path, version=9, storage_plugin=plugin)


def to_ros2(bag, path, storage='sqlite3'):
    """Write the messages of a bag as a recording of ROS 2, with the definitions of ROS 2."""
    store = get_typestore(Stores.ROS2_FOXY)
    with rosbag.Bag(str(bag)) as source, writer_of(path, storage) as target:
        connections = {}
        for topic, raw, time in source.read_messages(raw=True):
            kind = raw[0].replace('/', '/msg/')
            if topic not in connections:
                connections[topic] = target.add_connection(topic, kind, typestore=store)
            target.write(connections[topic], time.to_nsec(), bytes(store.ros1_to_cdr(raw[1], kind)))
    return path


def write_one(path, message, definition=''):
    """Write a recording of ROS 2 with one message of ROS 1; `definition`: of its type, if ROS 2 does not have it."""
    store, kind = get_typestore(Stores.ROS2_FOXY), message._type.replace('/', '/msg/')
    if definition:
        store.register(get_types_from_msg(definition, kind))
    buffer = BytesIO()
    message.serialize(buffer)
    with writer_of(path, 'sqlite3') as target:
        connection = target.add_connection('/topic', kind, typestore=store)
        target.write(connection, 7_000_000_001, bytes(store.ros1_to_cdr(buffer.getvalue(), kind)))
    return path


def all_of(path):
    with open_bag(path) as bag:
        return [(one.topic, deserialized(one), one.time) for one in stamped_messages(bag, [*topic_types(bag)])]


def process(source, output, *arguments):
    assert main([str(source), '-o', str(output), *map(str, arguments)], known_people) == 0
    return output


def static_transform(bag):
    connection = {'topic': '/tf_static', 'type': TFMessage._type, 'md5sum': TFMessage._md5sum,
                  'message_definition': TFMessage._full_text, 'latching': '1'}
    transform = TransformStamped(header=Header(stamp=stamp_of(0), frame_id='world'), child_frame_id=FRAME_ID)
    transform.transform.rotation.w, transform.transform.translation.z = 1.0, 1.2
    bag.write('/tf_static', TFMessage([transform]), stamp_of(0), connection_header=connection)


@pytest.fixture(scope='module')
def recording(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp('recording') / 'walk.bag', others=static_transform)


@pytest.fixture(scope='module')
def results(recording, tmp_path_factory):
    """People of the bag of ROS 1, as a bag, as MCAP, and as a table."""
    folder = tmp_path_factory.mktemp('results')
    process(recording, folder / 'people.bag', '--csv', folder / 'people.csv', '--signals', '--copy', '/tf_static')
    process(recording, folder / 'people.mcap', '--signals', '--copy', '/tf_static')
    return folder


@pytest.mark.parametrize('storage', STORAGES)
def test_people_are_those_of_the_bag_of_ros_1(recording, results, tmp_path, storage):
    folder = to_ros2(recording, tmp_path / 'walk', storage)
    with open_bag(folder) as found, open_bag(recording) as true:
        assert topic_types(found) == topic_types(true)
        assert message_count(found, IMAGE) == message_count(true, IMAGE) > 0
        assert found.get_start_time() == true.get_start_time()
    process(folder, tmp_path / 'out.bag', '--csv', tmp_path / 'out.csv', '--signals')
    assert (tmp_path / 'out.csv').read_bytes() == (results / 'people.csv').read_bytes()
    assert len((tmp_path / 'out.csv').read_text().splitlines()) > 10


@needs_files
def test_mcap_gives_the_tables_of_the_bag(results, tmp_path, capsys):
    tables = []
    for name in ('people.bag', 'people.mcap'):
        assert keypoints_to_csv([str(results / name), '-o', str(tmp_path / f'{name}.csv')]) == 0
        with (tmp_path / f'{name}.csv').open() as file:
            tables.append([{key: value for key, value in row.items() if not key.endswith('header.seq')}
                           for row in csv.DictReader(file)])
    assert tables[0] == tables[1]
    assert len(tables[0]) > 10
    assert keypoints_to_csv([str(results / 'people.mcap'), '--signals', '-o', str(tmp_path / 'signals.csv')]) == 0
    assert 'standing' in (tmp_path / 'signals.csv').read_text()
    assert plot_keypoints([str(results / 'people.mcap'), '-o', str(tmp_path / 'plots')]) == 0
    assert (tmp_path / 'plots/trajectory_nose.png').is_file()


def test_mcap_is_what_foxglove_and_ros_2_read(results):
    with (results / 'people.mcap').open('rb') as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert reader.get_header().profile == 'ros2'
        schemas = {channel.topic: summary.schemas[channel.schema_id] for channel in summary.channels.values()}
        assert {channel.message_encoding for channel in summary.channels.values()} == {'cdr'}
        assert {schema.encoding for schema in schemas.values()} == {'ros2msg'}
        assert schemas[KEYPOINTS].name == 'openpose_ros_msgs/msg/PersonDetection_3d'
        static, = (channel for channel in summary.channels.values() if channel.topic == '/tf_static')
        assert yaml.safe_load(static.metadata['offered_qos_profiles'])[0]['durability'] == 1  # transient local
        _, _, stored = next(iter(reader.iter_messages([KEYPOINTS])))
    kind, store = schemas[KEYPOINTS].name, get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schemas[KEYPOINTS].data.decode(), kind))
    person = store.deserialize_cdr(stored.data, kind)
    with open_bag(results / 'people.bag') as bag:
        _, true, time = next(bag.read_messages([KEYPOINTS]))
    assert stored.log_time == time.to_nsec()
    assert (person.header.frame_id, person.person_ID) == (true.header.frame_id, true.person_ID)
    assert person.nose.x == pytest.approx(true.nose.x) and np.isfinite(true.nose.x)


def test_definitions_that_a_recording_lacks_are_those_of_ros_2_and_the_installed_ones(tmp_path):
    folder = write_one(tmp_path / 'signals', PersonSignalsArray(header=Header(frame_id='map')),
                       PersonSignalsArray._full_text.replace('uint32 seq\n', ''))
    file, = folder.glob('*.db3')
    with sqlite3.connect(file) as database:
        database.execute('DELETE FROM message_definitions')  # as recordings before ROS 2 Iron
    (_, message, time), = all_of(folder)
    assert isinstance(message, PersonSignalsArray) and message.header.frame_id == 'map' and time == 7_000_000_001


def test_a_type_with_other_fields_than_the_installed_one_is_read_as_it_is(tmp_path):
    text = f'std_msgs/Header header\nfloat64 value\n{"=" * 80}\nMSG: std_msgs/Header\ntime stamp\nstring frame_id\n'
    kind = genpy.dynamic.generate_dynamic('openpose_ros_msgs/PersonSignalsArray', text.replace(
        'time stamp', 'uint32 seq\ntime stamp'))['openpose_ros_msgs/PersonSignalsArray']
    (_, message, _), = all_of(write_one(tmp_path / 'other', kind(Header(frame_id='map'), 1.5), text))
    assert (message.header.frame_id, message.value) == ('map', 1.5)


@pytest.mark.parametrize('name, content', [('cut.mcap', None), ('empty.mcap', b''), ('no.db3', b'nonsense' * 100)])
def test_a_file_that_is_no_recording_is_refused(results, tmp_path, capsys, name, content):
    whole = (results / 'people.mcap').read_bytes()
    path = tmp_path / name
    path.write_bytes(whole[:len(whole) // 2] if content is None else content)
    assert keypoints_to_csv([str(path), '-o', str(tmp_path / 'out.csv')]) == 2
    assert f'{path} is no recording of ROS 2, or is damaged' in capsys.readouterr().err

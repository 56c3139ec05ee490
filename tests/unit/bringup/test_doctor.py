"""The doctor's checks on known facts: each mistake is found by its check, and what is right is not blamed."""
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from openpose_ros_bringup.doctor.findings import RIGHT, UNKNOWN, WRONG, Finding
from openpose_ros_bringup.doctor.report import CHECKS, diagnose, faults, report
from openpose_ros_bringup.doctor.snapshot import (
    Arrival,
    Camera,
    ChainNode,
    Clock,
    Lookup,
    Machine,
    Master,
    People,
    Snapshot,
    Stream,
    Tf,
)
from openpose_ros_pkg.calibration import pinhole_calibration
from openpose_ros_pkg.stream.silent_topic import PublishedTopic
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.cloud import OrganizedCloud
from skeleton_extract_3d.points.depth import DepthImage, cloud_from_depth

ROOT = Path(__file__).parents[3]
LAUNCH = (ROOT / 'extensions/openpose_ros_bringup/launch/people.launch').read_text()
ARGUMENTS = re.findall(r'<arg name="(\w+)" default=', LAUNCH)
IMAGE, CLOUD, INFO = 'sensor_msgs/Image', 'sensor_msgs/PointCloud2', 'sensor_msgs/CameraInfo'
OPTICAL, NODE = 'camera_optical', '/skeleton_extract_3d_node'
WIDTH, HEIGHT, FOCAL = 64, 48, 56.0
V, U = np.mgrid[:HEIGHT, :WIDTH]
METRES = (2 + 0.01 * U + 0.2 * np.sin(V / 8)).astype(np.float32)
# Rotations from an optical frame to one with z up: as mounted, and forgotten.
MOUNTED, FORGOTTEN = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]), np.eye(3)


def model(focal=FOCAL):
    return CameraModel(WIDTH, HEIGHT, np.array([[focal, 0, 31.5], [0, focal, 23.5], [0, 0, 1]]))


def calibration(focal=FOCAL):
    return pinhole_calibration(WIDTH, HEIGHT, (focal, focal), (31.5, 23.5))


def arrivals(rate=20.0, count=30, age=0.05, begin=1000.0):
    times = begin + np.arange(count) / rate
    return tuple(Arrival(time - begin, time, int((time - age) * 1e9)) for time in times.tolist())


def xyz(metres=METRES):
    cloud = cloud_from_depth(metres, model(), np.zeros((HEIGHT, WIDTH, 3), np.uint8))
    return [cloud[axis] for axis in 'xyz']


SEEN = {'arrivals': arrivals(), 'frame_id': OPTICAL, 'size': (WIDTH, HEIGHT)}
COLOUR = Stream('image', '/cam/color/image', IMAGE, encoding='rgb8', **SEEN)
DEPTH = Stream('depth', '/cam/depth_registered/image', IMAGE, encoding='16UC1', points=DepthImage(METRES, model()),
               **SEEN)
POINTS = Stream('points', '/cam/depth_registered/points', CLOUD, points=OrganizedCloud(*xyz()), **SEEN)
DEPTH_INFO = Stream('camera_info', '/cam/depth_registered/camera_info', INFO, calibration=calibration(), **SEEN)
COLOUR_INFO = Stream('', '/cam/color/camera_info', INFO, calibration=calibration(), **SEEN)
CAMERA = Camera(COLOUR, DEPTH, DEPTH_INFO, COLOUR_INFO, node=NODE)
WITH_CLOUD = Camera(COLOUR, POINTS, None, COLOUR_INFO, node=NODE)
WORKING = ChainNode(NODE, text='19.8 Hz', values={'rate [Hz]': '19.8', 'age of the result, median [s]': '0.06'},
                    parameters={'target_rate': 30.0}, results='/openpose_ros/skeleton_3d/detected_poses_3d')
MOUNT = Tf('base', {OPTICAL: 'base'}, {('base', OPTICAL): Lookup(MOUNTED, np.zeros(3))})


def published(*streams, **others):
    return {**{stream.topic: PublishedTopic(stream.kind, ['/driver']) for stream in streams},
            **{name: PublishedTopic(kind, ['/other']) for name, kind in others.items()}}


WELL = Snapshot(Master('http://localhost:11311'), published=published(COLOUR, DEPTH, DEPTH_INFO, COLOUR_INFO),
                cameras=[CAMERA], tf=MOUNT, nodes=[WORKING], machine=Machine(1.0, 4, 8000.0), people=People(60, 2))
CLOUD_WELL = replace(WELL, cameras=[WITH_CLOUD], published=published(COLOUR, POINTS, COLOUR_INFO))


def with_camera(seen=WELL, **changes):
    """Return a snapshot whose camera has other streams."""
    return replace(seen, cameras=[replace(seen.cameras[0], **changes)])


def with_published(seen=WELL, without=(), **others):
    """Return a snapshot with other published topics; dots of the names of arguments are slashes."""
    kept = {name: there for name, there in seen.published.items() if name not in without}
    return replace(seen, published={**kept, **others})


def wrong(seen, name):
    found = [finding for finding in diagnose(seen)[name] if finding.state == WRONG]
    for finding in found:
        arguments = re.findall(r'(\w+):=', finding.line.partition('people.launch')[2])
        assert set(arguments) <= set(ARGUMENTS), finding.line
    return found


@pytest.mark.parametrize('seen', [WELL, CLOUD_WELL, replace(WELL, cameras=[Camera(COLOUR, node=NODE)]),
                                  replace(WELL, tf=Tf())], ids=['depth', 'cloud', '2D', 'no fixed frame'])
def test_where_all_is_well_each_check_says_so(seen):
    findings = diagnose(seen)
    assert list(findings) == list(CHECKS) and len(CHECKS) == 10
    assert {finding.state for found in findings.values() for finding in found} == {RIGHT}
    assert faults(findings) == 0 and report(findings).endswith('nothing is wrong\n')


def test_the_page_has_a_line_for_each_check():
    page = (ROOT / 'docs/nothing_in_rviz.md').read_text()
    assert [name.lower() for name in re.findall(r'^\d+\. \*\*(\w+)\.', page, re.MULTILINE)] == list(CHECKS)


def test_without_a_master_nothing_else_is_checked():
    findings = diagnose(Snapshot(Master('http://robot:11311', is_online=False)))
    assert [(name, finding.state) for name, found in findings.items() for finding in found] == [
        (name, WRONG if name == 'master' else UNKNOWN) for name in CHECKS]
    assert findings['master'][0].line == 'roscore'


def test_without_a_camera_and_without_a_chain():
    findings = diagnose(Snapshot(Master('http://localhost:11311')))
    assert {name for name, found in findings.items() if found[0].state == WRONG} == {'topics', 'subscribers'}
    assert findings['topics'][0].line.endswith('camera:=NAME driver:=true')


@pytest.mark.parametrize('master, text, line', [
    ({'fault': "ROS_IP is '10.0.0.1', which is another machine", 'address': '10.0.0.7'}, 'another machine',
     'export ROS_IP=10.0.0.7'),
    ({'unreachable': {'/driver': 'http://robot:4000'}}, '/driver is registered at http://robot:4000',
     'rosnode cleanup'),
    ({'sim_time': True}, 'nothing comes on /clock', 'rosbag play --clock'),
    ({'clock': Clock(300, 100.0)}, 'use_sim_time is false', 'rosparam set use_sim_time true')])
def test_master(master, text, line):
    found, = wrong(replace(WELL, master=Master('', **master)), 'master')
    assert text in found.text and line in found.line


@pytest.mark.parametrize('ticks, fault', [(0, 'stands still at 100.000 s'), (1, 'stands still'), (300, None)])
def test_clock_of_a_bag(ticks, fault):
    seen = with_published(replace(WELL, master=Master('', sim_time=True, clock=Clock(ticks, 100.0))),
                          **{'/clock': PublishedTopic('rosgraph_msgs/Clock', ['/play'])})
    found = wrong(seen, 'master')
    assert fault in found[0].text if fault else not found


@pytest.mark.parametrize('missing, others, text, line', [
    (COLOUR, {'/cam/rgb/image': IMAGE, '/cam/depth/image': IMAGE}, 'no node publishes it', 'image:=/cam/rgb/image'),
    (COLOUR, {COLOUR.topic: CLOUD}, 'published as sensor_msgs/PointCloud2', 'driver:=true'),
    (COLOUR, {f'{COLOUR.topic}/compressed': 'sensor_msgs/CompressedImage'}, 'below it there is',
     'image_transport:=compressed'),
    (DEPTH, {f'{DEPTH.topic}/compressedDepth': 'sensor_msgs/CompressedImage'}, 'below it there is',
     'depth_transport:=compressedDepth'),
    (DEPTH, {DEPTH.topic: CLOUD}, 'published as sensor_msgs/PointCloud2',
     f'points_source:=point_cloud points:={DEPTH.topic}'),
    (DEPTH, {'/cam/depth/raw': IMAGE}, 'no node publishes it', 'depth:=/cam/depth/raw'),
    (DEPTH, {'/cam/depth/raw': IMAGE, '/other/aligned_depth': IMAGE}, 'no node', 'depth:=/other/aligned_depth'),
    (DEPTH_INFO, {}, 'no node publishes it', 'camera_info:=/cam/color/camera_info')])
def test_topics(missing, others, text, line):
    seen = with_published(without=[missing.topic],
                          **{name: PublishedTopic(kind, ['/other']) for name, kind in others.items()})
    found, = wrong(seen, 'topics')
    assert text in found.text and line in found.line
    assert [each.state for each in diagnose(seen)['rates']].count(UNKNOWN) == 1  # no second complaint


def test_a_cloud_that_is_missing_beside_a_depth_image():
    seen = with_published(CLOUD_WELL, [POINTS.topic], **{'/cam/depth/image': PublishedTopic(IMAGE, ['/driver'])})
    line = wrong(seen, 'topics')[0].line
    assert line.endswith('points_source:=depth_image depth:=/cam/depth/image camera_info:=/cam/color/camera_info')
    beside = with_published(seen, **{'/cam/depth/camera_info': PublishedTopic(INFO, ['/driver'])})
    assert wrong(beside, 'topics')[0].line.endswith('camera_info:=/cam/depth/camera_info')


def test_a_transport_that_is_not_published():
    stream = replace(COLOUR, topic='/cam/color/image/compressed', kind='sensor_msgs/CompressedImage')
    found, = wrong(with_camera(image=stream), 'topics')
    assert 'image:=/cam/color/image ' in found.line and found.line.endswith(' image_transport:=raw')


@pytest.mark.parametrize('changes, text, line', [
    ({'arrivals': ()}, 'which sends nothing', 'rosnode info /driver'),
    ({'arrivals': (), 'is_connected': False}, 'there is no connection', 'rosnode ping /driver'),
    ({'arrivals': arrivals(count=1)}, 'one message in 5 s', 'rostopic bw'),
    ({'arrivals': arrivals(rate=1.5, count=6)}, '1.5 Hz, expected 2 Hz', 'rostopic bw')])
def test_rates(changes, text, line):
    found, = wrong(with_camera(points=replace(DEPTH, **changes)), 'rates')
    assert text in found.text and line in found.line


@pytest.mark.parametrize('depth, line', [
    ('/cam/depth/image_rect_raw', 'roslaunch realsense2_camera'), ('/cam/aligned_depth/image', 'depth:=/cam/aligned')])
def test_where_the_driver_is_known_no_depth_that_is_not_registered_is_proposed(depth, line):
    driver = 'roslaunch realsense2_camera rs_camera.launch align_depth:=true'
    there = with_published(with_camera(driver=driver), [DEPTH.topic], **{depth: PublishedTopic(IMAGE, ['/driver'])})
    damaged = with_published(with_camera(driver=driver, points=replace(DEPTH, points=None, fault='it is damaged')),
                             **{depth: PublishedTopic(IMAGE, ['/driver'])})
    assert [line in wrong(*seen)[0].line for seen in ((there, 'topics'), (damaged, 'encodings'))] == [True, True]
    info = with_published(with_camera(driver=driver), [DEPTH_INFO.topic])
    assert wrong(info, 'topics')[0].line == driver


def test_a_known_driver_is_started_again():
    seen = with_camera(points=replace(DEPTH, arrivals=()), driver='roslaunch astra astra.launch')
    assert wrong(seen, 'rates')[0].line == 'roslaunch astra astra.launch'


@pytest.mark.parametrize('changes, text, line', [
    ({'image': replace(COLOUR, encoding='16UC1')}, 'is a depth image (16UC1)', 'rostopic echo'),
    ({'image': replace(COLOUR, fault="unknown image encoding 'x'")}, 'unknown image encoding', 'rostopic echo'),
    ({'points': replace(DEPTH, fault="depth image has encoding 'rgb8'", points=None)}, "encoding 'rgb8'",
     'rostopic echo'),
    ({'points': replace(DEPTH, fault='compressed depth image can not be decoded', points=None)}, 'can not be decoded',
     'format png'),
    ({'points': replace(DEPTH, points=DepthImage(1000 * METRES, model()))}, 'is it in millimetres?', 'REP 118'),
    ({'points': replace(DEPTH, points=DepthImage(0 * METRES, model()))}, '0 % of the points are valid',
     'rostopic echo'),
    ({'info': replace(DEPTH_INFO, fault='camera is not calibrated')}, 'not calibrated', 'cameracalibrator.py')])
def test_encodings(changes, text, line):
    found, = wrong(with_camera(**changes), 'encodings')
    assert text in found.text and line in found.line


def test_a_flat_cloud_has_a_depth_image_beside_it():
    seen = with_published(with_camera(CLOUD_WELL, points=replace(POINTS, points=None, fault='cloud is not organized')),
                          **{'/cam/depth/image': PublishedTopic(IMAGE, ['/driver'])})
    assert 'points_source:=depth_image depth:=/cam/depth/image' in wrong(seen, 'encodings')[0].line


@pytest.mark.parametrize('stamps, text, line', [
    (arrivals(age=-3.5), '3.5 s ahead of the clock', 'chronyc'),
    (arrivals(age=3.5), '3.5 s behind the clock', 'chronyc'),
    (arrivals(age=-0.3), '0.3 s ahead of the clock', 'chronyc'),
    (arrivals(age=900.0), '900 s behind', 'chronyc'),
    (arrivals(age=9000.0), 'played without its own', 'rosparam set use_sim_time true && rosbag play --clock'),
    (tuple(each._replace(stamp=0) for each in arrivals()), '30 of 30 messages have stamp 0', '/header'),
    (tuple(each._replace(stamp=10**12 + number // 2) for number, each in enumerate(arrivals())),
     '15 of 30 stamps are not newer', 'rostopic echo')])
def test_stamps(stamps, text, line):
    found = wrong(with_camera(points=replace(DEPTH, arrivals=stamps)), 'stamps')
    assert text in found[0].text and line in found[0].line


def test_stamps_of_a_recording_are_those_of_its_clock():
    playing = replace(WELL, master=Master('', sim_time=True, clock=Clock(300, 1000.0)))
    late = {'image': replace(COLOUR, arrivals=arrivals(age=3.5)), 'points': replace(DEPTH, arrivals=arrivals(age=3.5))}
    assert not wrong(with_camera(playing, **late), 'stamps')
    again = arrivals(begin=1000.0) + arrivals(begin=990.0)
    assert not wrong(with_camera(playing, image=replace(COLOUR, arrivals=again)), 'stamps')
    live = with_camera(playing, image=replace(COLOUR, arrivals=arrivals(age=-1e6)))
    assert '/driver takes another time' in wrong(live, 'stamps')[0].text


def test_two_nodes_that_publish_one_topic_are_named():
    stamps = tuple(each._replace(stamp=each.stamp - number % 2 * 10**8) for number, each in enumerate(arrivals()))
    seen = with_published(with_camera(image=replace(COLOUR, arrivals=stamps)),
                          **{COLOUR.topic: PublishedTopic(IMAGE, ['/driver', '/other_driver'])})
    found = wrong(seen, 'stamps')
    assert '/driver, /other_driver' in found[0].text and found[0].line == 'rosnode kill /other_driver'


def test_pairs_by_the_slop_of_the_node():
    late = with_camera(image=replace(COLOUR, arrivals=arrivals(2, 4)), points=replace(DEPTH, arrivals=arrivals(
        2, 4, age=0.25)))
    found, = wrong(late, 'stamps')
    assert found.text.startswith('no pairs: the nearest stamps of') and found.line.startswith(
        "echo 'skeleton_extract_3d_node: {slop: 0.3}' > pairs.yaml && roslaunch ")
    node = replace(WORKING, parameters={'slop': 0.3})
    assert not wrong(replace(late, nodes=[node]), 'stamps')


@pytest.mark.parametrize('changes, text', [
    ({'points': replace(DEPTH, points=DepthImage(METRES, model(40.0))), 'info': replace(
        DEPTH_INFO, calibration=calibration(40.0))}, 'points miss their pixels'),
    ({'points': replace(DEPTH, frame_id='camera_depth')}, "frame 'camera_depth', but the image in 'camera_optical'"),
    ({'image': replace(COLOUR, size=(1280, 720)), 'colour_info': None}, 'the aspect ratios differ')])
def test_registration(changes, text):
    found, = wrong(with_camera(**changes), 'registration')
    assert text in found.text
    assert 'depth_image_proc/register' in found.line or changes.get('colour_info', 0) is None
    aligned = with_published(with_camera(**changes), **{'/cam/aligned_depth/image': PublishedTopic(IMAGE, ['/driver'])})
    line = wrong(aligned, 'registration')[0].line
    assert 'depth:=/cam/aligned_depth/image ' in line and ' camera_info:=' in line


def test_frames_with_two_names_at_one_place_are_registered():
    same = Lookup(np.eye(3), np.zeros(3))
    seen = with_camera(points=replace(DEPTH, frame_id='camera_depth'))
    assert not wrong(replace(seen, tf=Tf('', {}, {(OPTICAL, 'camera_depth'): same})), 'registration')


def test_what_the_node_says_of_registration():
    node = replace(WORKING, level=1, text='people do not fit the depth: 12 of 30')
    assert '12 of 30' in wrong(replace(WELL, nodes=[node]), 'registration')[0].text


@pytest.mark.parametrize('tf, text, line', [
    (Tf('base'), 'nothing comes on /tf', f'static_transform_publisher 0 0 1.35 -1.5708 0 -1.5708 base {OPTICAL}'),
    (Tf('base', {'base': 'odom', OPTICAL: 'camera_link'}), 'tf has base, camera_link',
     'static_transform_publisher 0 0 1.35 0 0 0 base camera_link'),
    (Tf('base', {'base': 'odom', OPTICAL: 'depth_optical'}), 'tf has', '1.35 -1.5708 0 -1.5708 base depth_optical'),
    (Tf('map', {OPTICAL: 'base'}), "tf does not connect 'map'",
     'static_transform_publisher 0 0 0 0 0 0 map base'),
    (Tf('base_lnk', {'base_link': 'odom'}), "tf does not know 'base_lnk'", 'fixed_frame:=base_link'),
    (Tf('base', {OPTICAL: 'base'}, {('base', OPTICAL): Lookup(error='extrapolation into the future'
                                                                                     )}),
     'not at the stamp of the points: extrapolation', f'tf_monitor base {OPTICAL}')])
def test_tf(tf, text, line):
    found, = wrong(replace(WELL, tf=tf), 'tf')
    assert text in found.text and line in found.line


def test_no_frame_id():
    assert 'has no frame_id' in wrong(with_camera(points=replace(DEPTH, frame_id='')), 'tf')[0].text


def test_frames_that_the_node_is_told():
    node = replace(WORKING, parameters={'target_frame': '/map'})  # tf2 refuses leading slashes
    assert "'map'" in wrong(replace(WELL, nodes=[node]), 'tf')[0].text


@pytest.mark.parametrize('rotation, text', [
    (FORGOTTEN, 'looks straight up'), (MOUNTED @ np.diag([-1, -1, 1]), 'is upside down'),
    (np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]), 'lies on its side')])
def test_a_camera_that_tf_turns_wrongly(rotation, text):
    seen = replace(WELL, tf=replace(MOUNT, lookups={('base', OPTICAL): Lookup(rotation, np.zeros(3))}))
    found, = wrong(seen, 'frames')
    assert text in found.text and found.line.endswith(f'0 0 0 -1.5708 0 -1.5708 base {OPTICAL}')


@pytest.mark.parametrize('rotation, turn', [(MOUNTED @ np.diag([-1, -1, 1]), 180),
                                            (np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]), 90),
                                            (np.array([[0, 0, 1], [0, -1, 0], [1, 0, 0]]), 270)])
@pytest.mark.parametrize('changes', [
    {'people': People(60, 0)}, {'people': None}, {'nodes': []},
    {'nodes': [replace(WORKING, level=1, text='the camera seems to be turned: 2 of 2')]}, 'rotate_image'], ids=str)
def test_a_camera_that_is_mounted_as_tf_says_is_right(rotation, turn, changes):
    if changes == 'rotate_image':
        changes = {'nodes': [replace(WORKING, parameters={'rotate_image': turn})]}
    turned = replace(MOUNT, lookups={('base', OPTICAL): Lookup(rotation, np.zeros(3))})
    finding, = diagnose(replace(WELL, tf=turned, **changes))['frames']
    assert finding.state == RIGHT and f'rotate_image:={turn}' in finding.text


def test_the_proposed_transforms_put_a_person_ahead_ahead():
    """Of rosrun tf2_ros static_transform_publisher: x y z, then yaw about z, pitch about y, roll about x."""
    for tf in (Tf('base'), replace(MOUNT, lookups={('base', OPTICAL): Lookup(FORGOTTEN, np.zeros(3))})):
        line = wrong(replace(WELL, tf=tf), 'tf' if tf == Tf('base') else 'frames')[0].line
        x, y, z, *angles = map(float, re.findall(r'publisher (.*?) base', line)[0].split())
        ahead = Rotation.from_euler('ZYX', angles).apply((0, 0, 3)) + np.array((x, y, z))
        assert ahead == pytest.approx((3, 0, z), abs=1e-3)


def test_cameras_that_look_down_or_into_their_own_frame_are_right():
    down = replace(MOUNT, lookups={('base', OPTICAL): Lookup(np.diag([1, -1, -1]), np.zeros(3))})
    own = Tf('other_optical', {OPTICAL: 'x'}, {('other_optical', OPTICAL): Lookup(np.eye(3), np.zeros(3))})
    assert not wrong(replace(WELL, tf=down), 'frames') and not wrong(replace(WELL, tf=own), 'frames')


def test_a_cloud_that_is_not_in_an_optical_frame():
    x, y, z = xyz()
    found, = wrong(with_camera(CLOUD_WELL, points=replace(POINTS, points=OrganizedCloud(z, -x, 1.2 - y))), 'frames')
    assert 'x points forward and z up' in found.text
    found, = wrong(with_camera(CLOUD_WELL, points=replace(POINTS, points=OrganizedCloud(x, -y, -z))), 'frames')
    assert 'negative z' in found.text


@pytest.mark.parametrize('node, machine, text, line', [
    ({'values': {'rate [Hz]': '6.1'}, 'skipped': 13.7}, {}, '6.1 results per second of 20.0', 'mode:=fast'),
    ({}, {'memory': 120.0}, '120 MB of memory', 'top')])
def test_load(node, machine, text, line):
    seen = replace(WELL, nodes=[replace(WORKING, **node)], machine=WELL.machine._replace(**machine), people=None)
    found, = wrong(seen, 'load')
    assert text in found.text and line in found.line


@pytest.mark.parametrize('age, clock, delay', [(0.86, 0.0, '0.81'), (60.15, 60.1, ''), (-59.14, -60.0, '0.81')])
def test_load_is_told_from_the_clock_of_a_camera_and_from_an_earlier_stream(age, clock, delay):
    values = {**WORKING.values, 'age of the result, median [s]': '3600.0'}  # over 5 s
    seen = replace(with_camera(image=replace(COLOUR, arrivals=arrivals(age=0.05 + clock))), people=People(
        60, 2, {WORKING.results: age}), nodes=[replace(WORKING, values=values)])
    found = wrong(seen, 'load')
    assert bool(found) == bool(delay) and all(f'{delay} s after' in each.text for each in found)


@pytest.mark.parametrize('recorder, state, line', [
    ((0, 'records into /a', '/a'), RIGHT, ''), ((2, 'has ended', '/a b'), WRONG, "df -h '/a b'")])
def test_a_recorder(recorder, state, line):
    assert Finding(state, recorder[1], line) in diagnose(replace(WELL, recorders=[recorder]))['subscribers']


def test_load_that_is_asked_for():
    slow = replace(WORKING, values={'rate [Hz]': '9.8'}, parameters={'target_rate': 10.0})
    assert not wrong(replace(WELL, nodes=[slow], people=None), 'load')
    began = replace(WORKING, values={'rate [Hz]': '3.8'})
    assert not wrong(replace(WELL, nodes=[began], people=People(95, 2)), 'load')
    resting = replace(WORKING, text='idle: no subscriber', values={'rate [Hz]': '0.0'})
    assert not wrong(replace(WELL, nodes=[resting]), 'load')


@pytest.mark.parametrize('changes, text, line', [
    ({'text': 'idle: no subscriber'}, 'rests', 'rostopic hz /openpose_ros/skeleton_3d/detected_poses_3d'),
    ({'text': 'disabled'}, 'is disabled', f'rosservice call {NODE}/enable true'),
    ({'level': 1, 'text': 'bad input: x'}, 'bad input: x', f'rosnode info {NODE}')])
def test_subscribers(changes, text, line):
    found, = wrong(replace(WELL, nodes=[replace(WORKING, **changes)]), 'subscribers')
    assert text in found.text and line in found.line


def test_a_chain_that_does_not_run_or_reads_other_topics():
    found, = wrong(replace(WELL, nodes=[]), 'subscribers')
    assert found.line.endswith('points_source:=depth_image rviz:=true')
    found, = wrong(with_camera(node='', preset='astra'), 'subscribers')
    assert 'reads other topics' in found.text and found.line.endswith('camera:=astra')
    found, = wrong(replace(WELL, nodes=[], unresponsive=[NODE]), 'subscribers')
    assert 'no status' in found.text
    found, = wrong(replace(WELL, nodes=[], starting=[NODE]), 'subscribers')
    assert 'is not ready' in found.text and '/rosout_agg' in found.line


def test_a_bag_that_begins_again_is_normal():
    assert not wrong(replace(WELL, nodes=[replace(WORKING, level=1, text='time jumped back: a bag')]), 'subscribers')


def test_rviz_without_what_draws_people():
    markers = '/openpose_ros/skeleton_3d/visualization_markers'
    waiting = replace(WELL, subscribed={markers: ['/rviz']})
    found, = wrong(waiting, 'subscribers')
    assert '/rviz waits' in found.text and 'visualization_node' in found.line
    assert not wrong(with_published(waiting, **{markers: PublishedTopic('x', ['/v'])}), 'subscribers')


def test_no_people_is_said_but_not_wrong():
    found = diagnose(replace(WELL, people=People(40, 0)))['subscribers']
    assert found[0].state == RIGHT and 'is anyone in view?' in found[0].text


def test_report_has_a_line_to_type_below_what_is_wrong():
    text = report(diagnose(with_camera(points=replace(DEPTH, arrivals=()))), './run shell ')
    lines = text.splitlines()
    place = next(number for number, line in enumerate(lines) if 'WRONG' in line)
    assert any('-> ./run shell rosnode info /driver' in line for line in lines[place:place + 3])
    assert all(len(line) <= 120 for line in lines)
    several = {'stamps': [Finding(WRONG, 'old', 'rosparam set x 1 && rosbag play x || echo ros')]}
    assert '-> ./run rosparam set x 1 && ./run rosbag play x || echo ros\n' in report(several, './run ')
    assert lines[-1] == '1 wrong: docs/nothing_in_rviz.md'

"""The doctor's checks on known facts: each mistake is found by its check, and what is right is not blamed."""
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from openpose_ros_bringup.doctor.findings import RIGHT, UNKNOWN, WRONG, Finding
from openpose_ros_bringup.doctor.report import CHECKS, diagnose, faults, report
from openpose_ros_bringup.doctor.snapshot import Arrival, Camera, ChainNode, Master, Snapshot, Stream
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


def published(*streams):
    return {stream.topic: PublishedTopic(stream.kind, ['/driver']) for stream in streams}


WELL = Snapshot(Master('http://localhost:11311'), published=published(COLOUR, DEPTH, DEPTH_INFO, COLOUR_INFO),
                cameras=[CAMERA], fixed_frame='base', parents={OPTICAL: 'base'}, nodes=[WORKING], people=[2] * 60,
                lookups={('base', OPTICAL): (MOUNTED, np.zeros(3))})
CLOUD_WELL = replace(WELL, cameras=[WITH_CLOUD], published=published(COLOUR, POINTS, COLOUR_INFO))


def with_camera(seen=WELL, **changes):
    """Return a snapshot whose camera has other streams."""
    return replace(seen, cameras=[replace(seen.cameras[0], **changes)])


def with_published(others, seen=WELL, without=()):
    """Return a snapshot with other published topics, by name and type."""
    kept = {name: there for name, there in seen.published.items() if name not in without}
    return replace(seen, published={**kept, **{name: PublishedTopic(kind, ['/other'])
                                               for name, kind in others.items()}})


def wrong(seen, name):
    found = [finding for finding in diagnose(seen)[name] if finding.state == WRONG]
    for finding in found:
        arguments = re.findall(r'(\w+):=', finding.line.partition('people.launch')[2])
        assert set(arguments) <= set(ARGUMENTS), finding.line
    return found


def with_master(**changes):
    return replace(WELL, master=Master('', **changes))


def with_node(seen=WELL, **changes):
    return replace(seen, nodes=[replace(WORKING, **changes)], people=None)


def with_points(**changes):
    return with_camera(points=replace(DEPTH, **changes))


def without_depth(**others):
    return with_published(others, without=[DEPTH.topic])


COMPRESSED, DRIVER = 'sensor_msgs/CompressedImage', 'roslaunch astra astra.launch'
OWN_INFO = 'camera_info: /cam/color/camera_info'
FLAT = with_camera(CLOUD_WELL, points=replace(POINTS, points=None, fault='cloud is not organized'))
BESIDE = {'/depth/image': IMAGE, '/depth/camera_info': INFO}
HALF = tuple(each._replace(stamp=10**12 + number // 2) for number, each in enumerate(arrivals()))
PLAYING = with_master(sim_time=True, ticks=300, clock=1000.0)


def with_tf(parents, fixed_frame='base', **lookups):
    """Return a snapshot with other frames of tf; `lookups` by target."""
    return replace(WELL, fixed_frame=fixed_frame, parents=parents,
                   lookups={(target, OPTICAL): found for target, found in lookups.items()})


@pytest.mark.parametrize('seen', [WELL, CLOUD_WELL, replace(WELL, cameras=[Camera(COLOUR, node=NODE)]),
                                  replace(WELL, fixed_frame='')], ids=['depth', 'cloud', '2D', 'no fixed frame'])
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
    seen = Snapshot(Master('http://localhost:11311'))
    findings = diagnose(seen)
    assert {name for name, found in findings.items() if found[0].state == WRONG} == {'topics', 'subscribers'}
    assert findings['topics'][0].line.endswith('camera:=NAME driver:=true')
    other = with_published({'/eye/image': IMAGE, '/eye/depth': IMAGE}, seen)
    assert 'doctor --image /eye/image ' in diagnose(other)['topics'][0].line


@pytest.mark.parametrize('check, seen, text, line', [
    ('master', with_master(unreachable={'/driver': 'http://robot:4000'}), '/driver is registered at http://robot:4000',
     'rosnode cleanup'),
    ('master', with_master(sim_time=True), 'nothing comes on /clock', 'rosbag play --clock'),
    ('master', with_master(ticks=300, clock=100.0), 'use_sim_time is false', 'rosparam set use_sim_time true'),
    ('master', with_published({'/clock': 'rosgraph_msgs/Clock'}, with_master(sim_time=True, ticks=1, clock=100.0)),
     'stands still at 100.000 s', 'rosbag play --clock'),
    ('topics', with_published({'/cam/rgb/image': IMAGE, '/cam/depth/image': IMAGE}, without=[COLOUR.topic]),
     'no node publishes it', 'image:=/cam/rgb/image'),
    ('topics', with_published({COLOUR.topic: CLOUD}, without=[COLOUR.topic]), 'published as sensor_msgs/PointCloud2',
     'driver:=true'),
    ('topics', with_published({f'{COLOUR.topic}/compressed': COMPRESSED}, without=[COLOUR.topic]), 'below it there is',
     "'skeleton_extract_3d_node: {image_transport: compressed}' > config.yaml && roslaunch"),
    ('topics', without_depth(**{f'{DEPTH.topic}/compressedDepth': COMPRESSED}), 'below it there is',
     '{depth_transport: compressedDepth}'),
    ('topics', with_camera(image=replace(COLOUR, topic=f'{COLOUR.topic}/compressed', kind=COMPRESSED)), 'no node',
     '{image_transport: raw}'),
    ('topics', with_camera(with_published({'/cam/rgb/image/compressed': COMPRESSED}, without=[COLOUR.topic]),
                           image=replace(COLOUR, topic='/cam/picture/compressed', kind=COMPRESSED)),
     'no node publishes it', "{image_transport: compressed}' > config.yaml && "
     'roslaunch openpose_ros_bringup people.launch image:=/cam/rgb/image depth:='),
    ('topics', without_depth(), 'no node publishes it', f'image:={COLOUR.topic} points:=none'),
    ('topics', without_depth(**{'/cam/depth/raw': IMAGE}), 'no node publishes it',
     f'depth: /cam/depth/raw, {OWN_INFO}'),
    ('topics', without_depth(**{'/cam/depth/raw': IMAGE, '/other/aligned_depth': IMAGE}), 'no node',
     'depth: /other/aligned_depth'),
    ('topics', with_published({}, without=[DEPTH_INFO.topic]), 'no node publishes it', OWN_INFO),
    ('topics', with_published(BESIDE, CLOUD_WELL, [POINTS.topic]), 'no node',
     f'people.launch image:={COLOUR.topic} depth:=/depth/image'),
    ('rates', with_points(arrivals=()), 'which sends nothing', 'rosnode info /driver'),
    ('rates', with_points(arrivals=(), is_connected=False), 'there is no connection', 'rosnode ping /driver'),
    ('rates', with_points(arrivals=arrivals(count=1)), 'one message in 5 s', 'rostopic bw'),
    ('rates', with_points(arrivals=arrivals(rate=1.5, count=6)), '1.5 Hz, expected 2 Hz', 'rostopic bw'),
    ('rates', with_camera(points=replace(DEPTH, arrivals=()), driver=DRIVER), 'sends nothing', DRIVER),
    ('encodings', with_camera(image=replace(COLOUR, encoding='16UC1')), 'is a depth image (16UC1)', 'rostopic echo'),
    ('encodings', with_camera(image=replace(COLOUR, fault="unknown image encoding 'x'")), 'unknown image encoding',
     'rostopic echo'),
    ('encodings', with_points(fault='compressed depth image can not be decoded', points=None), 'can not be decoded',
     'format png'),
    ('encodings', with_points(points=DepthImage(1000 * METRES, model())), 'is it in millimetres?', 'REP 118'),
    ('encodings', with_points(points=DepthImage(0 * METRES, model())), '0 % of the points are valid', 'rostopic echo'),
    ('encodings', with_camera(info=replace(DEPTH_INFO, fault='camera is not calibrated')), 'not calibrated',
     'cameracalibrator.py'),
    ('encodings', with_published(BESIDE, FLAT), 'not organized',
     'depth:=/depth/image'),
    ('stamps', with_points(arrivals=arrivals(age=-3.5)), '3.5 s ahead of the clock', 'chronyc'),
    ('stamps', with_points(arrivals=arrivals(age=900.0)), '900 s behind', 'chronyc'),
    ('stamps', with_points(arrivals=arrivals(age=9000.0)), 'played without its own',
     'rosparam set use_sim_time true && rosbag play --clock'),
    ('stamps', with_points(arrivals=tuple(each._replace(stamp=0) for each in arrivals())),
     '30 of 30 messages have stamp 0', '/header'),
    ('stamps', with_points(arrivals=HALF), '15 of 30 stamps are not newer', 'rostopic echo'),
    ('stamps', replace(with_points(arrivals=HALF), published={
        **WELL.published, DEPTH.topic: PublishedTopic(IMAGE, ['/driver', '/other_driver'])}), '/driver, /other_driver',
     'rosnode kill /other_driver'),
    ('stamps', with_camera(PLAYING, image=replace(COLOUR, arrivals=arrivals(age=-1e6))), '/driver takes another time',
     'use_sim_time false'),
    ('stamps', with_camera(PLAYING, points=replace(DEPTH, arrivals=arrivals(age=-2.0))), ' s ahead of those of',
     'rostopic delay'),
    ('registration', with_camera(points=replace(DEPTH, points=DepthImage(METRES, model(40.0))), info=replace(
        DEPTH_INFO, calibration=calibration(40.0))), 'points miss their pixels', ''),
    ('registration', with_published({'/cam/aligned_depth/image': IMAGE}, with_points(frame_id='camera_depth')),
     "frame 'camera_depth', but the image in 'camera_optical'", 'depth: /cam/aligned_depth/image'),
    ('registration', with_points(size=(64, 64)), 'aspect ratios differ', ''),
    ('registration', with_node(level=1, text='people do not fit the depth: 12 of 30'), '12 of 30', ''),
    ('tf', with_tf({}), 'nothing comes on /tf',
     f'static_transform_publisher 0 0 1.35 -1.5708 0 -1.5708 base {OPTICAL}'),
    ('tf', with_tf({'base': 'odom', OPTICAL: 'camera_link'}), 'tf has base, camera_link',
     'static_transform_publisher 0 0 1.35 0 0 0 base camera_link'),
    ('tf', with_tf({OPTICAL: 'base'}, base='extrapolation into the future'),
     'not at the stamp of the points: extrapolation',
     f'tf_monitor base {OPTICAL}'),
    ('tf', with_points(frame_id=''), 'has no frame_id', ''),
    ('tf', with_node(parameters={'target_frame': '/map'}), "'map'", ''),  # tf2 refuses leading slashes
    ('frames', with_tf({OPTICAL: 'base'}, base=(FORGOTTEN, np.zeros(3))),
     'looks straight up', f'0 0 0 -1.5708 0 -1.5708 base {OPTICAL}'),
    ('frames', with_camera(CLOUD_WELL, points=replace(POINTS, points=OrganizedCloud(
        *(axis * sign for axis, sign in zip(xyz(), (1, -1, -1)))))), 'negative z', ''),
    ('load', with_node(values={'rate [Hz]': '6.1'}), '6.1 results per second of 20.0', 'mode:=fast'),
    ('load', replace(WELL, memory=120.0), '120 MB of memory', 'top'),
    ('subscribers', with_node(text='idle: no subscriber'), 'rests',
     'rostopic hz /openpose_ros/skeleton_3d/detected_poses_3d'),
    ('subscribers', with_node(text='disabled'), 'is disabled', f'rosservice call {NODE}/enable true'),
    ('subscribers', with_node(level=1, text='bad input: x'), 'bad input: x', f'rosnode info {NODE}'),
    ('subscribers', with_node(with_points(points=DepthImage(0 * METRES, model())), level=1, text='no depth: 0 %'),
     'no depth', ''),
    ('subscribers', replace(with_node(level=1, text='no depth: 0 %'), cameras=[]), 'no depth', ''),
    ('subscribers', replace(WELL, nodes=[]), 'does not run', f'depth:={DEPTH.topic} rviz:=true'),
    ('subscribers', with_camera(node='', preset='astra'), 'reads other topics', 'camera:=astra'),
    ('subscribers', with_camera(node='', preset='astra', namespace='left'), 'reads other topics',
     "{camera_ns: left}' > config.yaml && roslaunch openpose_ros_bringup people.launch camera:=astra config:="),
    ('subscribers', replace(WELL, nodes=[], unresponsive=[NODE]), 'no status', 'rosnode ping'),
    ('subscribers', replace(WELL, nodes=[], starting=[NODE]), 'is not ready', '/rosout_agg'),
    ('subscribers', replace(WELL, subscribed={'/s/visualization_markers': ['/rviz']}), '/rviz waits',
     'visualization_node')])
def test_each_mistake_is_found_by_its_check(check, seen, text, line):
    found = wrong(seen, check)
    assert len(found) == 1 and text in found[0].text and line in found[0].line


SAME = {(OPTICAL, 'camera_depth'): (np.eye(3), np.zeros(3))}
LATE = replace(COLOUR, arrivals=arrivals(age=3.5))
AGAIN = replace(COLOUR, arrivals=arrivals(begin=1000.0) + arrivals(begin=990.0))


@pytest.mark.parametrize('check, seen', [
    ('master', with_published({'/clock': 'rosgraph_msgs/Clock'}, PLAYING)),
    ('stamps', with_camera(PLAYING, image=LATE, points=replace(DEPTH, arrivals=LATE.arrivals))),
    ('stamps', with_camera(PLAYING, image=AGAIN)),
    ('registration', replace(with_points(frame_id='camera_depth'), lookups=SAME)),
    ('frames', with_tf({}, base=(np.diag([1, -1, -1]), np.zeros(3)))),
    ('load', with_node(values={'rate [Hz]': '9.8'}, parameters={'target_rate': 10.0})),
    ('load', replace(with_node(values={'rate [Hz]': '3.8'}), people=[2] * 95)),
    ('load', with_node(text='idle: no subscriber', values={'rate [Hz]': '0.0'})),
    ('subscribers', with_node(level=1, text='time jumped back: a bag')),
    ('subscribers', with_node(level=1, text='no depth: 0 % of the points are valid')),  # it was covered, and is not
    ('subscribers', with_published({'/s/visualization_markers': 'x'}, replace(
        WELL, subscribed={'/s/visualization_markers': ['/rviz']})))])
def test_what_is_right_is_not_blamed(check, seen):
    assert not wrong(seen, check)


@pytest.mark.parametrize('depth, line', [
    ('/cam/depth/image_rect_raw', DRIVER), ('/cam/aligned_depth/image', 'depth: /cam/aligned_depth/image')])
def test_where_the_driver_is_known_no_depth_that_is_not_registered_is_proposed(depth, line):
    known = with_published({depth: IMAGE}, with_camera(driver=DRIVER), [DEPTH.topic])
    assert line in wrong(known, 'topics')[0].line


def test_no_people_is_said_but_not_wrong():
    found = diagnose(replace(WELL, people=[0] * 40))['subscribers']
    assert found[0].state == RIGHT and 'are people in view?' in found[0].text


def test_report_has_a_line_to_type_below_what_is_wrong():
    text = report(diagnose(with_points(arrivals=())), './run shell ')
    lines = text.splitlines()
    place = next(number for number, line in enumerate(lines) if 'WRONG' in line)
    assert any('-> ./run shell rosnode info /driver' in line for line in lines[place:place + 3])
    assert all(len(line) <= 120 for line in lines)
    several = {'stamps': [Finding(WRONG, 'old', 'rosparam set x 1 && rosbag play x || echo ros')]}
    assert '-> ./run rosparam set x 1 && ./run rosbag play x || echo ros\n' in report(several, './run ')
    assert lines[-1] == '1 wrong: docs/nothing_in_rviz.md'

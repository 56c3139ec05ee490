"""time_report on bags: topics and namespaces, depth, several cameras, bags that are not live, damaged ones."""
import csv
import json

import genpy
import pytest
import rosbag
from genpy.dynamic import generate_dynamic
from openpose_ros_msgs.msg import PersonDetection, PersonDetection_3dArray, PersonDetectionArray
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header, String
from visualization_msgs.msg import Marker

from openpose_ros_tools.ros.time_report import main, read_recording

BEGIN = 1700000000 * 10 ** 9
MS = 10 ** 6
SPACE = '/openpose_ros/skeleton_3d'
# Messages of a frame: topic, type, fields, delay [ms].
CHAIN = (('/camera/color/image_raw', Image, {'encoding': 'rgb8'}, 4),
         ('/camera/depth/image_raw', Image, {'encoding': '16UC1'}, 9),
         ('/camera/depth/points', PointCloud2, {}, 21),
         (f'{SPACE}/input_rgb', Image, {'encoding': 'rgb8'}, 30),
         (f'{SPACE}/detected_poses', PersonDetectionArray, {}, 100),
         (f'{SPACE}/detected_poses_keypoints', PersonDetection, {}, 101),
         (f'{SPACE}/detected_poses_3d', PersonDetection_3dArray, {}, 106),
         (f'{SPACE}/visualization_markers', Marker, {}, 109),
         (f'{SPACE}/visualization_markers', Marker, {}, 110),
         (f'{SPACE}/detected_poses_image', Image, {'encoding': 'bgr8'}, 125))


def time(nanoseconds):
    return genpy.Time(nanoseconds // 10 ** 9, nanoseconds % 10 ** 9)


def write_bag(path, frames=10, chain=CHAIN, prefix='', frame_id='camera', offset=0, delay=None, mode='w'):
    """Write a recording of frames at 10 Hz.

    Args:
        prefix: of all topics.
        offset: of all stamps [ns].
        delay: of all messages [ms]; None: that of the chain.
    """
    with rosbag.Bag(str(path), mode) as bag:
        for number in range(frames):
            stamp = BEGIN + offset + 100 * number * MS
            for topic, kind, fields, own in chain:
                message = kind(header=Header(stamp=time(stamp), frame_id=frame_id), **fields)
                bag.write(prefix + topic, message, time(stamp + MS * (own if delay is None else delay)))
    return path


def read_summary(folder):
    return json.loads((folder / 'summary.json').read_text())['chains']


def test_empty_bag(tmp_path, capsys):
    path = tmp_path / 'empty.bag'
    rosbag.Bag(str(path), 'w').close()
    assert main([str(path)]) == 2
    error = capsys.readouterr().err
    assert 'no results of the nodes' in error and 'its topics: none' in error and error.count('\n') == 1


def test_report_of_a_chain(tmp_path, capsys):
    path = write_bag(tmp_path / 'live.bag')
    assert main([str(path), '-o', str(tmp_path / 'report')]) == 0
    chain, = read_summary(tmp_path / 'report')
    assert chain['live'] and chain['counted_from'] == 'stamp' and chain['notes'] == [] and chain['frames'] == 10
    medians = {stage['topic']: (stage['stage'], stage['delay_ms']['median'], stage['share'])
               for stage in chain['stages']}
    assert medians == {
        '/camera/color/image_raw': ('image', 4.0, 1.0), '/camera/depth/image_raw': ('depth', 9.0, 1.0),
        '/camera/depth/points': ('cloud', 21.0, 1.0), f'{SPACE}/input_rgb': ('taken', 30.0, 1.0),
        f'{SPACE}/detected_poses': ('people_2d', 100.0, 1.0),
        f'{SPACE}/detected_poses_keypoints': ('people_2d', 101.0, 1.0),
        f'{SPACE}/detected_poses_3d': ('people_3d', 106.0, 1.0),
        f'{SPACE}/visualization_markers': ('markers', 110.0, 1.0),
        f'{SPACE}/detected_poses_image': ('drawn', 125.0, 1.0)}
    assert [(step['from'], step['to'], step['step_ms']['median']) for step in chain['steps']] == [
        ('camera', 'taken', 9.0), ('taken', 'people_2d', 70.0), ('people_2d', 'people_3d', 6.0),
        ('people_3d', 'markers', 4.0), ('people_3d', 'drawn', 19.0)]
    text = capsys.readouterr().out
    written = (tmp_path / 'report' / 'time_report.md').read_text()
    assert written.startswith(text) and '![delays_over_time](delays_over_time.png)' in written
    with (tmp_path / 'report' / 'delays.csv').open() as handle:
        rows = list(csv.DictReader(handle))
    assert len(rows) == 90 and rows[0]['stamp_ns'] == str(BEGIN) and float(rows[0]['delay_ms']) == 4.0
    assert sorted(path.name for path in (tmp_path / 'report').iterdir()) == [
        'delay_distribution.png', 'delays.csv', 'delays_over_time.png', 'summary.json', 'time_report.md']


def test_a_report_is_replaced_only_when_asked_for(tmp_path, capsys):
    path, folder = write_bag(tmp_path / 'live.bag'), tmp_path / 'report'
    folder.mkdir()
    (folder / 'notes').write_text('of the user')
    (folder / 'summary.json').write_text('of another tool')
    assert main([str(path), '-o', str(folder)]) == 2
    assert f"{folder / 'summary.json'} is there already" in capsys.readouterr().err
    assert (folder / 'summary.json').read_text() == 'of another tool'
    for options in ((), ('--format', 'svg')):
        assert main([str(path), '-o', str(folder), '--overwrite', *options]) == 0
    assert sorted(path.name for path in folder.iterdir()) == [
        'delay_distribution.svg', 'delays.csv', 'delays_over_time.svg', 'notes', 'summary.json', 'time_report.md']


def test_part_of_a_bag(tmp_path):
    recording = read_recording(write_bag(tmp_path / 'live.bag'), 0.25, 0.65)
    camera = recording.cameras[0]
    # recorded 4 ms after their stamps, of which the first is 4 ms before the beginning of the bag
    assert ((camera.stamps - BEGIN) // MS).tolist() == [300, 400, 500, 600]


def test_compressed_images_and_2d(tmp_path):
    chain = (('/usb_cam/image_raw/compressed', CompressedImage, {'format': 'jpeg'}, 3),
             ('/depth/image/compressedDepth', CompressedImage, {'format': '16UC1; compressedDepth'}, 5),
             ('/usb_cam/camera_info', CameraInfo, {}, 1),
             ('/openpose_ros/detected_poses', PersonDetectionArray, {}, 60),
             ('/openpose_ros/detected_poses_image/compressed', CompressedImage, {'format': 'jpeg'}, 80))
    recording = read_recording(write_bag(tmp_path / 'live.bag', 3, chain))
    assert {stage.topic: stage.role for stage in recording.cameras} == {
        '/usb_cam/image_raw/compressed': 'image', '/depth/image/compressedDepth': 'depth'}
    assert {stage.topic: stage.role for stage in recording.results['/openpose_ros']} == {
        '/openpose_ros/detected_poses': 'people_2d', '/openpose_ros/detected_poses_image/compressed': 'drawn'}


@pytest.mark.parametrize('people, namespace', [('/lab/people', '/lab'), ('/people', '/')])
def test_remapped_results_are_found_by_their_type(tmp_path, people, namespace):
    chain = (('/image', Image, {'encoding': 'rgb8'}, 4), (people, PersonDetection_3dArray, {}, 100))
    recording = read_recording(write_bag(tmp_path / 'live.bag', 3, chain))
    assert list(recording.results) == [namespace] and recording.cameras[0].topic == '/image'


def test_two_robots(tmp_path):
    chain = [CHAIN[0], CHAIN[6]]
    path = write_bag(tmp_path / 'live.bag', 10, chain, prefix='/robot_1', frame_id='camera_1')
    write_bag(path, 5, chain, prefix='/robot_2', frame_id='camera_2', offset=33 * MS, mode='a')
    assert main([str(path), '-o', str(tmp_path / 'report'), '--format', 'svg']) == 0
    one, two = read_summary(tmp_path / 'report')
    assert (one['namespace'], one['frames']) == (f'/robot_1{SPACE}', 10)
    assert (two['namespace'], two['frames']) == (f'/robot_2{SPACE}', 5)
    assert all(stage['topic'].startswith('/robot_2/') for stage in two['stages'])
    assert (tmp_path / 'report' / 'delays_over_time_robot_2_openpose_ros_skeleton_3d.svg').exists()


def test_camera_topic_can_be_chosen(tmp_path, capsys):
    path = write_bag(tmp_path / 'live.bag')
    recording = read_recording(path, cameras=['/camera/color/image_raw'])
    assert [stage.topic for stage in recording.cameras] == ['/camera/color/image_raw']
    assert main([str(path), '--camera', '/none']) == 2
    assert 'no camera topic /none; it has: /camera/color/image_raw, ' in capsys.readouterr().err


def test_bag_that_a_program_wrote(tmp_path, capsys):
    path = write_bag(tmp_path / 'processed.bag', delay=0)
    assert main([str(path), '-o', str(tmp_path / 'report')]) == 0
    assert 'Note: No live recording' in capsys.readouterr().out
    chain, = read_summary(tmp_path / 'report')
    assert not chain['live'] and chain['steps'] == []
    assert all(stage['delay_ms']['median'] is None and stage['share'] == 1.0 for stage in chain['stages'])
    assert not list((tmp_path / 'report').glob('*.png'))


def test_simulated_clock(tmp_path):
    path = write_bag(tmp_path / 'live.bag')
    with rosbag.Bag(str(path), 'a') as bag:
        bag.write('/clock', Clock(time(BEGIN)), time(BEGIN))
    assert read_recording(path).simulated


def test_topic_of_another_type(tmp_path, capsys):
    path = tmp_path / 'other.bag'
    with rosbag.Bag(str(path), 'w') as bag:
        bag.write('/openpose_ros/detected_poses_keypoints', String('not of this project'), time(BEGIN))
    assert main([str(path)]) == 2
    assert '/openpose_ros/detected_poses_keypoints (std_msgs/String)' in capsys.readouterr().err


def test_messages_of_the_original_have_no_stamps(tmp_path, capsys):
    kind = 'openpose_ros_msgs/PersonDetection'
    original = generate_dynamic(kind, 'uint32 num_people_detected\nuint32 person_ID\n')[kind]
    path = tmp_path / 'original.bag'
    with rosbag.Bag(str(path), 'w') as bag:
        bag.write('/openpose_ros/detected_poses_keypoints', original(1, 0), time(BEGIN))
    assert main([str(path)]) == 2
    assert 'have no header, as those of the original project' in capsys.readouterr().err


def test_files_that_are_no_bags(tmp_path, capsys):
    text = tmp_path / 'text.bag'
    text.write_text('no bag')
    cut = tmp_path / 'cut.bag'
    cut.write_bytes(write_bag(tmp_path / 'live.bag').read_bytes()[:9000])
    for path, word in ((tmp_path / 'none.bag', 'No such file'), (text, 'not a bag'), (cut, 'bag')):
        assert main([str(path)]) == 2
        error = capsys.readouterr().err
        assert error.startswith('time_report: ') and word in error and error.count('\n') == 1


@pytest.mark.parametrize('seconds', ['nan', 'inf', '1e300', '-1e5000000'])
def test_times_that_ros_can_not_have(seconds, capsys):
    with pytest.raises(SystemExit):
        main(['a.bag', f'--start={seconds}'])
    assert f"'{seconds}': expected a number of seconds below 2^32" in capsys.readouterr().err


def test_a_part_may_begin_before_all_time(tmp_path):
    path = tmp_path / 'early.bag'
    with rosbag.Bag(str(path), 'w') as bag:
        bag.write(f'{SPACE}/detected_poses_3d', PersonDetection_3dArray(header=Header(stamp=time(MS))), time(MS))
    assert len(read_recording(path, start=-1e6).results) == 1


def test_start_after_end(tmp_path):
    with pytest.raises(SystemExit):
        main(['a.bag', '--start', '5', '--end', '5'])

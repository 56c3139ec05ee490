"""time_report on bags: topics, parts, the table as a file, and bags that can not be read."""
import csv

import genpy
import rosbag
from openpose_ros_msgs.msg import PersonDetection, PersonDetection_3dArray
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Header, String

from openpose_ros_tools.ros.time_report import main, read_timings

BEGIN = 1700000000 * 10 ** 9
MS = 10 ** 6
SPACE = '/openpose_ros/skeleton_3d'
# Messages of a frame: topic, type, delay [ms].
FRAME = (('/camera/color/image_raw', Image, 4), ('/camera/depth/points', PointCloud2, 21),
         (f'{SPACE}/detected_poses_keypoints', PersonDetection, 100),
         (f'{SPACE}/detected_poses_keypoints', PersonDetection, 101),
         (f'{SPACE}/detected_poses_3d', PersonDetection_3dArray, 106))


def write_bag(path, frames=10):
    """Write a recording of frames at 10 Hz."""
    with rosbag.Bag(str(path), 'w') as bag:
        for number in range(frames):
            stamp = BEGIN + 100 * number * MS
            for topic, kind, delay in FRAME:
                bag.write(topic, kind(header=Header(stamp=genpy.Time(0, stamp))), genpy.Time(0, stamp + delay * MS))
            bag.write('/notes', String('a'), genpy.Time(0, stamp))
    return path


def test_report_of_a_recording(tmp_path, capsys):
    path, table = write_bag(tmp_path / 'live.bag'), tmp_path / 'delays.csv'
    assert main([str(path), '-o', str(table)]) == 0
    rows = list(csv.DictReader(table.open()))
    assert [(row['topic'], row['messages'], row['frames'], row['rate [Hz]'], row['median [ms]']) for row in rows] == [
        ('/camera/color/image_raw', '10', '10', '10.000', '4.000'),
        ('/camera/depth/points', '10', '10', '10.000', '21.000'),
        (f'{SPACE}/detected_poses_keypoints', '20', '10', '10.000', '101.000'),
        (f'{SPACE}/detected_poses_3d', '10', '10', '10.000', '106.000'), ('/notes', '10', '10', '10.000', '')]
    printed = capsys.readouterr().out
    assert [line.split()[0] for line in printed.splitlines()] == ['topic', *(row['topic'] for row in rows)]
    table.write_text('of another program')
    assert main([str(path), '-o', str(table)]) == 2
    assert f'{table} is there already' in capsys.readouterr().err
    assert table.read_text() == 'of another program'
    assert main([str(path), '-o', str(table), '--overwrite']) == 0
    assert len(table.read_text().splitlines()) == 6


def test_topics_and_a_part_can_be_chosen(tmp_path, capsys):
    path = write_bag(tmp_path / 'live.bag')
    found, = read_timings(path, ['/camera/color/image_raw'], 0.25, 0.65)
    assert ((found.stamps - BEGIN) // MS).tolist() == [300, 400, 500, 600]
    assert len(read_timings(path, start=-1e12)) == 5
    assert main([str(path), '--topic', '/none']) == 2
    assert 'no topic /none; it has: /camera/color/image_raw, ' in capsys.readouterr().err
    assert main([str(path), '--start', '5']) == 2
    assert 'has no messages in the part that was read' in capsys.readouterr().err


def test_a_bag_without_messages_is_refused_in_one_line(tmp_path, capsys):
    assert main([str(write_bag(tmp_path / 'empty.bag', frames=0))]) == 2
    error = capsys.readouterr().err
    assert error.startswith('time_report: ') and 'has no messages' in error and error.count('\n') == 1

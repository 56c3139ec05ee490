"""calibrate_cameras on bags and tables of simulated cameras: files it writes, what it refuses."""
import numpy as np
import pytest
import rosbag
from camera_messages import IMAGE, SPACE, frames

from openpose_ros_fusion.rig import read_rig
from openpose_ros_pkg.ros.topics import people_topics
from openpose_ros_tools.ros.calibrate_cameras import main
from openpose_ros_tools.ros.keypoints import keypoints_to_csv
from simulated_room import around, record_all, rig_errors


def write(path, recordings, prefix='/'):
    """Write a bag with the people of cameras, each in the namespace of its name after the prefix."""
    with rosbag.Bag(str(path), 'w') as bag:
        for recording in recordings:
            name = f'{prefix}{recording.name}/' if prefix else '/'
            for time, messages in frames(recording):
                for topic, message in messages.items():
                    bag.write(name + topic, message, time)
    return path


@pytest.fixture(scope='module')
def cameras():
    three = around(3)
    three[1].clock, three[2].depth = 0.07, False
    return three, record_all(three, seconds=8)


def test_a_bag_with_three_cameras(tmp_path, cameras, capsys):
    """One of them late by 70 ms, one without depth."""
    three, recordings = cameras
    bag = write(tmp_path / 'room.bag', recordings)
    assert main([str(bag), '-o', str(tmp_path / 'rig'), '--fixed-frame', 'room']) == 0
    assert sorted(path.name for path in (tmp_path / 'rig').iterdir()) == ['report.txt', 'rig.png', 'rig.yaml']
    rig = read_rig(tmp_path / 'rig' / 'rig.yaml')
    assert rig.fixed_frame == 'room' and [camera.name for camera in rig.cameras] == [one.name for one in three]
    assert np.all(rig_errors(rig, three) < (0.5, 0.03, 0.015))
    printed = capsys.readouterr().out
    assert printed == (tmp_path / 'rig' / 'report.txt').read_text() and 'camera_0, camera_1' in printed
    assert (tmp_path / 'rig' / 'rig.png').read_bytes().startswith(b'\x89PNG')
    assert main([str(bag), '-o', str(tmp_path / 'rig')]) == 2  # it is there


def test_bags_in_the_root_namespace_and_tables(tmp_path, cameras, capsys):
    """Both are named by their files; the first of --cameras is where the room begins."""
    three, recordings = cameras
    bags = [write(tmp_path / f'{name}.bag', [recording], '') for name, recording in zip(('b', 'a'), recordings)]
    assert main([*map(str, bags), '-o', str(tmp_path / 'rig'), '--cameras', 'b a']) == 0
    rig = read_rig(tmp_path / 'rig' / 'rig.yaml')
    assert [camera.name for camera in rig.cameras] == ['b', 'a']
    assert np.all(rig_errors(rig, three[:2]) < (0.5, 0.03, 0.015))
    tables = [tmp_path / 'b.csv', tmp_path / 'a.csv']
    for bag, table in zip(bags, tables):
        assert keypoints_to_csv.main([str(bag), '--extended', '-o', str(table)]) == 0
    assert main([*map(str, tables), '--cameras', 'b a', '-o', str(tmp_path / 'rig'), '--overwrite']) == 0
    again = read_rig(tmp_path / 'rig' / 'rig.yaml')
    np.testing.assert_allclose(again.cameras[1].translation, rig.cameras[1].translation, atol=1e-4)


def test_a_camera_without_depth_needs_a_calibration(tmp_path, cameras, capsys):
    _, recordings = cameras
    bag = write(tmp_path / 'room.bag', recordings)
    table = tmp_path / 'right.csv'
    assert keypoints_to_csv.main([str(bag), '--topic', f'/camera_2/{IMAGE}', '--extended', '-o', str(table)]) == 0
    assert main([str(bag), str(table), '--cameras', 'camera_0 right', '-o', str(tmp_path / 'rig')]) == 2
    assert '--camera-info right=FILE' in capsys.readouterr().err
    assert main([str(bag), '--cameras', 'top camera_0', '-o', str(tmp_path / 'rig')]) == 2
    assert "no camera 'top'; there are camera_0, camera_1" in capsys.readouterr().err


def test_fused_people_are_of_no_camera():
    arrays = 'openpose_ros_msgs/PersonDetection_3dArray'
    types = {f'/{name}/{SPACE}': arrays for name in ('left', 'people', 'room')}
    types['/room/cameras'] = 'openpose_ros_msgs/FusedCameraArray'
    types[f'/{SPACE}'] = arrays
    types[f'/left/{IMAGE}'] = types[f'/hall/door/{IMAGE}'] = 'openpose_ros_msgs/PersonDetectionArray'
    types[f'/right/{SPACE}'] = 'std_msgs/String'
    assert people_topics(types) == {'': f'/{SPACE}', 'left': f'/left/{SPACE}', 'hall/door': f'/hall/door/{IMAGE}'}

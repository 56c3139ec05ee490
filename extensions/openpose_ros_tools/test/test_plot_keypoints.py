"""plot_keypoints on CSV and bags: files it writes, frames without people, wrong inputs."""
import genpy
import pytest
import rosbag
from openpose_ros_msgs.msg import BodypartDetection_3d, PersonDetection_3d, PersonDetection_3dArray
from std_msgs.msg import Header

from openpose_ros_tools.ros.keypoints.plot_keypoints import main, read_keypoints

BEGIN = 1700000000
SPACE = '/openpose_ros/skeleton_3d'
CSV = """%time,field.num_people_detected,field.person_ID,field.neck.x,field.neck.y,field.neck.z,field.neck.confidence
1700000000000000000,2,0,0.1,-0.5,2.0,0.9
1700000000000000000,2,4,1.1,-0.5,3.0,0.8
1700000000100000000,1,0,0.2,-0.5,2.0,0.9
1700000000200000000,1,0,nan,nan,nan,0.0
"""


def person(number, header):
    part = BodypartDetection_3d(x=0.1, y=-0.5, z=2.0, confidence=0.9, status=1, sigma=0.01)
    return PersonDetection_3d(header=header, num_people_detected=1, person_ID=number, neck=part)


def write_bag(path, people):
    """Write frames at 10 Hz with 0 or 1 people each."""
    with rosbag.Bag(str(path), 'w') as bag:
        for number, count in enumerate(people):
            time = genpy.Time(BEGIN, number * 10 ** 8)
            persons = [person(3, Header(stamp=time, frame_id='camera'))] * count
            bag.write(f'{SPACE}/detected_poses_3d', PersonDetection_3dArray(
                header=Header(stamp=time, frame_id='camera'), pose_model='COCO_18', persons=persons), time)
            for message in persons:
                bag.write(f'{SPACE}/detected_poses_keypoints_3d', message, time)
    return path


@pytest.fixture
def poses(tmp_path):
    path = tmp_path / 'poses.csv'
    path.write_text(CSV)
    return path


def test_a_bag_without_people(tmp_path, capsys):
    path = write_bag(tmp_path / 'empty.bag', [0, 0, 0])
    assert main([str(path), '-o', str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert 'empty' in error and error.count('\n') == 1


def test_plots_of_a_csv(tmp_path, poses, capsys):
    assert main([str(poses), '-o', str(tmp_path / 'plots')]) == 0
    names = sorted(path.name for path in (tmp_path / 'plots').iterdir())
    assert names == ['detections.png', 'top_view.png', 'trajectory_neck.png']
    assert sorted(line.rpartition('/')[2] for line in capsys.readouterr().out.splitlines()) == names


def test_several_frames_of_reference_are_told(tmp_path, poses, capsys):
    assert main([str(poses), '-o', str(tmp_path), '--joints', 'neck']) == 0
    assert 'several frames' not in capsys.readouterr().err
    names, *rows = CSV.splitlines()
    lines = [f'field.header.frame_id,{names}', *(f'camera_{number % 2},{row}' for number, row in enumerate(rows))]
    poses.write_text('\n'.join(lines) + '\n')
    assert main([str(poses), '-o', str(tmp_path), '--joints', 'neck', '--overwrite']) == 0
    assert 'several frames of reference (camera_0, camera_1)' in capsys.readouterr().err


def test_frames_without_people_are_known_from_a_bag(tmp_path):
    path = write_bag(tmp_path / 'a.bag', [0, 1, 1, 0, 0, 1])
    table, frames = read_keypoints(path)
    assert len(table) == 3 and len(frames) == 6
    assert sorted(set(table.stamps.tolist()) - set(frames.tolist())) == []


@pytest.mark.parametrize('options, text', [
    (['--joints', 'nose'], "joint 'nose' is not in it; there are: neck"),
    (['--topic', '/a'], '--topic is for bags')])
def test_what_is_not_in_the_file(poses, capsys, options, text):
    assert main([str(poses), '-o', str(poses.parent), *options]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f'plot_keypoints: {poses}: ') and text in error and error.count('\n') == 1

"""Topics by their types and content: two types on one are refused; depth that is passed over is told."""
import cv2
import genpy
import numpy as np
import pytest
import rosbag
from openpose_ros_msgs.msg import PersonDetection_3dArray
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header, String

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.ros.bag_files import open_bag, topic_types
from openpose_ros_tools.ros.camera_topics import TopicFinder
from openpose_ros_tools.ros.keypoints import keypoints_to_csv, plot_keypoints
from openpose_ros_tools.ros.keypoints.keypoint_bag import merged_types
from openpose_ros_tools.ros.process_bag.input import copied_topics
from openpose_ros_tools.ros.process_bag.program import main as process_bag

TOPIC, NOTES = '/openpose_ros/skeleton_3d/detected_poses_3d', '/notes_1'
BOTH = 'openpose_ros_msgs/PersonDetection_3dArray and std_msgs/String'


@pytest.fixture
def recording(tmp_path):
    """A bag as a recorder writes it when two nodes publish different types on a topic."""
    path = tmp_path / 'two.bag'
    people = PersonDetection_3dArray(header=Header(stamp=genpy.Time(7), frame_id='camera'))
    with rosbag.Bag(str(path), 'w') as bag:
        for topic, message in ((TOPIC, people), (TOPIC[:-1] + '~', String('a')), (NOTES, people),
                               (NOTES[:-1] + '~', String('b'))):
            bag.write(topic, message, genpy.Time(7))
    content = path.read_bytes()
    for topic in (TOPIC, NOTES):
        content = content.replace((topic[:-1] + '~').encode(), topic.encode())
    path.write_bytes(content)
    return path


@pytest.mark.parametrize('main, options', [
    (keypoints_to_csv.main, ('-o', 'a.csv')), (keypoints_to_csv.main, ('-o', 'a.csv', '--topic', TOPIC)),
    (plot_keypoints.main, ('-o', 'a.csv')), (process_bag, ('-o', 'out.bag')),
    (process_bag, ('-o', 'out.bag', '--image', TOPIC))])
def test_it_is_refused_with_its_types(recording, tmp_path, capsys, main, options):
    assert main([str(recording), *(str(tmp_path / word) if '.' in word else word for word in options)]) == 2
    assert BOTH in capsys.readouterr().err


def test_types_in_several_bags_are_those_of_all(recording, tmp_path):
    with rosbag.Bag(str(tmp_path / 'one.bag'), 'w') as bag:
        bag.write('/only', String('a'), genpy.Time(7))
    assert merged_types([]) == {}
    assert merged_types([recording, tmp_path / 'one.bag']) == {TOPIC: BOTH, NOTES: BOTH, '/only': 'std_msgs/String'}


def test_it_is_not_copied(recording, caplog):
    with open_bag(recording) as bag:
        assert topic_types(bag)[NOTES] == BOTH
        with pytest.raises(BadInputError, match=f'--copy {NOTES}: its messages are of several types, {BOTH}'):
            copied_topics(bag, [NOTES])
        assert copied_topics(bag, ['all']) == []
    assert f'{NOTES} is not copied: its messages are of several types, {BOTH}' in caplog.text


def compressed(suffix, pixels, kind):
    return CompressedImage(format=kind, data=cv2.imencode(suffix, pixels)[1].tobytes())


MM = np.full((4, 6), 2000, np.uint16)
BYTES, COLOURS = MM.astype(np.uint8), np.zeros((4, 6, 3), np.uint8)


@pytest.mark.parametrize('topic, message, stream, words', [
    ('/cam/depth/image_raw/compressed', compressed('.png', MM, '16UC1; png compressed '), 'depth', ''),
    ('/cam/depth/image_raw/compressed', compressed('.png', MM, 'png'), 'depth', ''),
    ('/cam/aligned/compressed', compressed('.png', MM, '16UC1; png compressed '), 'depth', ''),
    ('/cam/depth/image_raw/compressedDepth', compressed('.png', MM, '16UC1; compressedDepth'), 'depth', ''),
    ('/cam/depth/image_raw/compressed', compressed('.jpg', BYTES, '16UC1; jpeg compressed '), None, 'lost the depth'),
    ('/cam/aligned/compressed', compressed('.jpg', BYTES, '16UC1; jpeg compressed '), None, 'lost the depth'),
    ('/cam/image_depth', Image(encoding='8UC1'), None, 'its encoding 8UC1 is no depth'),
    ('/cam/infra1/image/compressed', compressed('.png', MM, 'mono16; png compressed '), None, ''),
    ('/cam/grey/image', Image(encoding='mono16'), 'colour', ''),
    ('/cam/grey/image/compressed', compressed('.png', MM, 'mono16; png compressed '), 'colour', ''),
    ('/cam/rgb/image/compressed', compressed('.png', COLOURS, 'bgr8; png compressed bgr8'), 'colour', '')])
def test_depth_is_found_or_told(tmp_path, caplog, topic, message, stream, words):
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as bag:
        bag.write(topic, message, genpy.Time(1))
    with open_bag(tmp_path / 'a.bag') as bag:
        finder = TopicFinder(bag)
        finder.warn_without_depth()
    assert [name for name, topics in finder.candidates.items() if topics] == [stream] * bool(stream)
    assert (f'{topic}: ' in caplog.text) == bool(words) and words in caplog.text

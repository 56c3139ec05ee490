"""Bags define their messages in text, of which rosbag makes code: no other code runs, and only what is read matters."""
import genpy
import pytest
import rosbag
from geometry_msgs.msg import Twist
from openpose_ros_msgs.msg import PersonDetectionArray
from std_msgs.msg import Header, String

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.ros.bag_files import open_bag, stamped_messages, topic_types
from openpose_ros_tools.ros.keypoints.keypoint_bag import bag_messages
from openpose_ros_tools.ros.process_bag.input import copied_topics

PEOPLE = '/openpose_ros/detected_poses'


def bag_of(folder, definition, name='foreign_msgs/Text', topic='/text'):
    """A bag of people, and of a topic with this definition."""
    class Foreign(String):
        _type, _full_text, _md5sum = name, definition, f'{abs(hash((definition, name))):032x}'
    path = folder / 'foreign.bag'
    with rosbag.Bag(str(path), 'w') as bag:
        bag.write(topic, Foreign('a'), genpy.Time(1))
        bag.write(PEOPLE, PersonDetectionArray(Header(stamp=genpy.Time(2)), 'COCO_18', [], []), genpy.Time(2))
    return path


def people_of(bag):
    return [message.header.stamp.secs for message, _ in bag_messages(bag, PEOPLE)]


@pytest.mark.parametrize('definition', [
    'float64[1000000] long', 'string NAME=left knee # no comment', "string NAME=it's", 'int8 A=-1  # 1; 2',
    'float32  E =  1e-3\r\n# """', 'bool YES=True'])
def test_a_definition_of_the_field_is_copied(tmp_path, definition):
    with open_bag(bag_of(tmp_path, definition)) as bag:
        assert people_of(bag) == [2]
        assert copied_topics(bag, ['all']) == ['/text']
        assert [message.raw[1] for message in stamped_messages(bag, ['/text'])] == [b'\1\0\0\0a']


@pytest.mark.parametrize('definition, name, words', [
    ('string data\nint32 __doc__; import os; os.abort(); y=1\n', 'foreign_msgs/Text', 'is no field'),
    ('bool A=__import__("os").abort()', 'foreign_msgs/Text', 'is no field'),
    ("int32 __slots__=['a']", 'foreign_msgs/Text', 'is no field'),
    (f'int32 a\n{"=" * 80}\nMSG: std_msgs/String(object): import os', 'foreign_msgs/Text', 'is no field'),
    ('string data\n', 'foreign_msgs/Text(object): pass\nimport os #', 'is no field'),
    ('Vector9 linear\n', 'foreign_msgs/Text', 'defines its types in part')])
def test_what_can_not_be_defined_is_left_out(tmp_path, caplog, definition, name, words):
    with open_bag(bag_of(tmp_path, definition, name)) as bag:
        assert people_of(bag) == [2]
        assert copied_topics(bag, ['all']) == [] and '/text is not copied: ' in caplog.text and words in caplog.text
        with pytest.raises(BadInputError, match=words):
            copied_topics(bag, ['/text'])
        with pytest.raises(BadInputError, match=words):
            list(stamped_messages(bag, ['/text']))


def test_an_installed_type_needs_no_definition(tmp_path):
    path = tmp_path / 'gap.bag'
    with rosbag.Bag(str(path), 'w') as bag:
        bag.write('/cmd_vel', Twist(), genpy.Time(1))
    path.write_bytes(path.read_bytes().replace(b'MSG: geometry_msgs/Vector3', b'MSG: geometry_msgs/Vector9'))
    with open_bag(path) as bag:
        assert topic_types(bag) == {'/cmd_vel': 'geometry_msgs/Twist'}
        assert copied_topics(bag, ['all']) == ['/cmd_vel']
        assert [message for message, _ in bag_messages(bag, '/cmd_vel')] == [Twist()]

"""Bags define their messages in text, of which rosbag makes code: no other code may run."""

import genpy
import genpy.dynamic
import pytest
import rosbag
from diagnostic_msgs.msg import DiagnosticArray
from openpose_ros_msgs.msg import PersonDetection_3dArray
from sensor_msgs.msg import CameraInfo, PointCloud2
from std_msgs.msg import String
from visualization_msgs.msg import Marker

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.ros.bag_definitions import harmless_definition
from openpose_ros_tools.ros.bag_files import open_bag, stamped_messages


@pytest.mark.parametrize('kind', [CameraInfo, DiagnosticArray, Marker, PersonDetection_3dArray, PointCloud2])
def test_a_harmless_definition_is_the_same_type(kind):
    generated = genpy.dynamic.generate_dynamic(kind._type, harmless_definition(kind._full_text))[kind._type]
    assert generated._md5sum == kind._md5sum
    assert (generated.__slots__, generated._slot_types) == (kind.__slots__, kind._slot_types)


@pytest.mark.parametrize('line, left', [
    ('string NAME=left knee # no comment', 'string NAME=left knee # no comment\n'),
    ('string\tNAME =  a', 'string NAME=  a\n'),
    ("string NAME=it's", ''),
    ('string NAME=\\', ''),
    ('int8 A=-1  # a comment', 'int8 A=-1\n'),
    ('# """ \\', '')])
def test_constants_are_kept_where_they_are_plain(line, left):
    assert harmless_definition(line) == left


@pytest.mark.parametrize('line', [
    'int32 a; import os; os.abort(); b=1', 'bool A=__import__("os").abort()', 'int32[99999999] a', 'int32 a b',
    "int32 __slots__=['a']", 'int32 a\u0663', 'MSG: std_msgs/String; import os', f'{"=" * 80};'])
def test_a_line_that_is_no_field_is_refused(line):
    with pytest.raises(BadInputError, match='that is no field'):
        harmless_definition(f'float32 x\n{line}\n')


def bag_of(folder, definition, name='hostile_msgs/Text'):
    class Hostile(String):
        _type, _full_text, _md5sum = name, definition, '0123456789abcdef0123456789abcdef'
    path = folder / 'hostile.bag'
    with rosbag.Bag(str(path), 'w') as bag:
        bag.write('/text', Hostile('a'), genpy.Time(1))
    return path


@pytest.mark.parametrize('definition, name', [
    ('string data\nint32 __doc__; import os; os.abort(); y=1\n', 'hostile_msgs/Text'),
    ('string data\n', 'hostile_msgs/Text(object): pass\nimport os #')])
def test_a_hostile_bag_is_refused_before_it_is_read(tmp_path, definition, name):
    with pytest.raises(BadInputError, match=r'is no (field|name)'), open_bag(bag_of(tmp_path, definition, name)) as bag:
        list(stamped_messages(bag, ['/text']))

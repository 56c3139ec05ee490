"""Bags of any bytes: damaged, cut off, with other types and definitions; what is read of them, or BadInputError."""
from functools import lru_cache

import genpy
import pytest
import rosbag
from hypothesis import given
from hypothesis import strategies as st
from openpose_ros_msgs.msg import PersonDetection, PersonDetectionArray
from sensor_msgs.msg import Image
from std_msgs.msg import Header, String

from fuzzing import mutated, share, survives
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.ros.bag_files import deserialized, open_bag, stamped_messages, topic_types
from openpose_ros_tools.ros.keypoints.keypoint_bag import read_keypoints


@lru_cache(maxsize=None)
def bag_bytes(folder, compression):
    """A bag of three topics, one of which is not of people."""
    path = folder / 'good.bag'
    with rosbag.Bag(str(path), 'w', compression=compression, chunk_threshold=1500) as bag:
        for number in range(4):
            time = genpy.Time(1600000000, number * 1000)
            header = Header(number, time, 'camera')
            person = PersonDetection(header=header, num_people_detected=1, person_ID=1)
            bag.write('/people', PersonDetectionArray(header, 'COCO_18', [person], []), time)
            bag.write('/image', Image(header, 2, 2, 'mono8', 0, 2, b'abcd'), time)
            bag.write('/text', String('é'), time)
    return path.read_bytes()


def all_messages(path):
    """Read every message of a bag, as process_bag does."""
    with open_bag(path) as bag:
        types = topic_types(bag)
        return [deserialized(message) for message in stamped_messages(bag, list(types))]


@share(0.5)
@pytest.mark.parametrize('compression', ['none', 'bz2', 'lz4'])
@given(data=st.data())
def test_bag(tmp_path_factory, compression, data):
    folder = tmp_path_factory.getbasetemp()
    content = data.draw(mutated(bag_bytes(folder, compression)))
    path = folder / 'spoilt.bag'
    path.write_bytes(content)
    for read in (all_messages, read_keypoints):
        # rosbag reserves as many bytes as a damaged length says, and uses those of the file
        survives(read, path, size=len(content), errors=(BadInputError,), memory=5 << 30)

"""Depth is found by types and content; topics with depth that are not taken are named."""
import cv2
import genpy
import numpy as np
import pytest
import rosbag
from sensor_msgs.msg import CompressedImage, Image

from openpose_ros_tools.ros.bag_files import open_bag, topic_finder


def compressed(suffix, pixels, kind):
    return CompressedImage(format=kind, data=cv2.imencode(suffix, pixels)[1].tobytes())


MM = np.full((4, 6), 2000, np.uint16)
BYTES, COLOURS = MM.astype(np.uint8), np.zeros((4, 6, 3), np.uint8)


@pytest.mark.parametrize('topic, message, stream, is_unused', [
    ('/cam/depth/image_raw/compressed', compressed('.png', MM, '16UC1; png compressed '), 'depth', False),
    ('/cam/depth/image_raw/compressed', compressed('.png', MM, 'png'), 'depth', False),
    ('/cam/aligned/compressed', compressed('.png', MM, '16UC1; png compressed '), 'depth', False),
    ('/cam/depth/image_raw/compressedDepth', compressed('.png', MM, '16UC1; compressedDepth'), 'depth', False),
    ('/cam/depth/image_raw/compressed', compressed('.jpg', BYTES, '16UC1; jpeg compressed '), None, True),
    ('/cam/aligned/compressed', compressed('.jpg', BYTES, '16UC1; jpeg compressed '), None, True),
    ('/cam/image_depth', Image(encoding='8UC1'), None, True),
    ('/cam/infra1/image/compressed', compressed('.png', MM, 'mono16; png compressed '), None, False),
    ('/cam/grey/image', Image(encoding='mono16'), 'colour', False),
    ('/cam/grey/image/compressed', compressed('.png', MM, 'mono16; png compressed '), 'colour', False),
    ('/cam/rgb/image/compressed', compressed('.png', COLOURS, 'bgr8; png compressed bgr8'), 'colour', False)])
def test_depth_is_found_or_named(tmp_path, caplog, topic, message, stream, is_unused):
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as bag:
        bag.write(topic, message, genpy.Time(1))
    with open_bag(tmp_path / 'a.bag') as bag:
        finder = topic_finder(bag)
        finder.warn_without_depth()
    assert [name for name, topics in finder.candidates.items() if topics] == [stream] * bool(stream)
    assert (f'readable depth images are on {topic};' in caplog.text) == is_unused

"""A video is a recording: images at its rate, and the calibration beside it."""
import cv2
import numpy as np
import pytest
import yaml
from sensor_msgs.msg import CameraInfo, Image

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.convert import any_image_to_bgr
from openpose_ros_tools.ros.bag_files import (
    deserialized,
    message_count,
    open_bag,
    stamped_messages,
    topic_finder,
    topic_types,
)
from openpose_ros_tools.ros.video_recording import IMAGE, INFO

RATE, SIZE, GREYS = 12.5, (64, 48), (40, 120, 200)
LENS = {'image_width': 64, 'image_height': 48, 'camera_name': 'c', 'distortion_model': 'plumb_bob',
        'camera_matrix': {'data': [60.0, 0, 31.5, 0, 60.0, 23.5, 0, 0, 1]},
        'distortion_coefficients': {'data': [0.0] * 5}, 'rectification_matrix': {'data': np.eye(3).ravel().tolist()},
        'projection_matrix': {'data': [60.0, 0, 31.5, 0, 0, 60.0, 23.5, 0, 0, 0, 1, 0]}}


@pytest.fixture
def video(tmp_path):
    writer = cv2.VideoWriter(str(tmp_path / 'walk.avi'), cv2.VideoWriter_fourcc(*'MJPG'), RATE, SIZE)
    for grey in GREYS:
        writer.write(np.full((*SIZE[::-1], 3), grey, np.uint8))
    writer.release()
    return tmp_path / 'walk.avi'


def test_images_have_the_stamps_of_the_rate(video):
    with open_bag(video) as bag:
        assert topic_types(bag) == {IMAGE: Image._type} and message_count(bag, IMAGE) == len(GREYS)
        messages = list(stamped_messages(bag, [IMAGE, INFO]))
        later = list(stamped_messages(bag, [IMAGE], deserialized(messages[1]).header.stamp))
        first = list(stamped_messages(bag, [IMAGE], None, deserialized(messages[0]).header.stamp))
        assert bag.get_end_time() - bag.get_start_time() == pytest.approx((len(GREYS) - 1) / RATE)
    assert [len(later), len(first)] == [len(GREYS) - 1, 1]
    assert np.diff([message.stamp for message in messages]).tolist() == [80_000_000] * 2
    for message, grey in zip(messages, GREYS):
        bgr = any_image_to_bgr(deserialized(message, Image))
        assert bgr.shape == (*SIZE[::-1], 3) and abs(bgr.mean() - grey) < 3


def test_the_calibration_beside_it_is_its_camera_info(video):
    video.with_suffix('.yaml').write_text(yaml.safe_dump(LENS))
    with open_bag(video) as bag:
        topics, _ = topic_finder(bag).camera(only_2d=True, needs_info=True)
        assert (topics.image, topics.camera_info) == (IMAGE, INFO)
        info, = (deserialized(message, CameraInfo) for message in stamped_messages(bag, [INFO]))
    assert info.K[0] == 60.0 and (info.width, info.height) == SIZE


def test_what_is_no_video_is_refused(tmp_path):
    (tmp_path / 'walk.mp4').write_bytes(b'no video')
    with pytest.raises(BadInputError, match=r'walk\.mp4'), open_bag(tmp_path / 'walk.mp4'):
        pass

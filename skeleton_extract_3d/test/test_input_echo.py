"""What was computed from is published without a copy, without delaying results, and only to subscribers."""
import threading

import numpy as np
import pytest
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from openpose_ros_pkg.ros.convert import bgr_to_image
from skeleton_extract_3d.points.depth import XYZRGB
from skeleton_extract_3d.ros.convert import cloud_from_message, cloud_to_message
from skeleton_extract_3d.ros.input_echo import InputEcho, InputFrame

PATIENCE = 60.0  # [s]


class Topic:
    """Takes the place of a publisher, with a number of listeners; sending waits until it may."""

    def __init__(self):
        self.listeners, self.sent = 0, []
        self.begun, self.may_send = threading.Event(), threading.Event()
        self.done = threading.Event()

    def get_num_connections(self):
        return self.listeners

    def publish(self, message):
        self.begun.set()
        assert self.may_send.wait(PATIENCE)
        self.sent.append(message)
        self.done.set()


class Topics:
    """Takes the place of Demand."""

    def __init__(self):
        self.of_type = {}

    def advertise(self, _, message_type, **__):
        return self.of_type.setdefault(message_type, Topic())


@pytest.fixture
def frame():
    bgr = np.zeros((4, 6, 3), np.uint8)
    message = cloud_to_message(np.ones((4, 6), XYZRGB), Header(frame_id='camera'))
    return InputFrame(bgr_to_image(bgr, Header()), bgr, message, cloud_from_message(message))


@pytest.fixture
def topics():
    return Topics()


@pytest.fixture
def echo(topics):
    return InputEcho('somewhere', None, topics)


def test_without_subscribers_nothing_is_done(topics, echo, frame):
    echo.submit(frame)
    images, clouds = topics.of_type.values()
    images.listeners = 1
    images.may_send.set()
    echo.submit(frame)
    assert images.done.wait(PATIENCE)
    assert (images.sent, clouds.sent) == ([frame.image], [])


def test_a_cloud_is_passed_on_as_it_came_while_results_go_on(topics, echo, frame):
    clouds = next(topic for kind, topic in topics.of_type.items() if kind is not Image)
    clouds.listeners = 1
    # returns although the cloud is not sent yet
    echo.submit(frame)
    assert clouds.begun.wait(PATIENCE)
    echo.submit(frame)
    assert clouds.sent == []
    clouds.may_send.set()
    assert clouds.done.wait(PATIENCE)
    # not a copy
    assert clouds.sent[0] is frame.message

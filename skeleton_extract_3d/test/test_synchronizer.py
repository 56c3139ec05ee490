"""The synchronizer is a message filter among others, whose callbacks hold up neither stream."""
import threading
from typing import List, Tuple

import message_filters
import pytest
import rospy
from openpose_ros_msgs.msg import PersonDetectionArray
from std_msgs.msg import Header

from openpose_ros_pkg.stream.pairing import PAIRING, PairingParams
from skeleton_extract_3d.ros.synchronizer import StampSynchronizer
from two_streams import EPOCH, IMAGE, POINTS, two_streams

Pair = Tuple[int, int]  # frames of the two messages


class CountedHealth:
    """Takes the place of Health, which reports to a ROS master."""

    def __init__(self):
        self.counts = {}

    def count(self, event, number=1):
        self.counts[event] = self.counts.get(event, 0) + number

    def warn(self, event, text):
        self.count(event)


def message(frame: int, stamp: int) -> PersonDetectionArray:
    """Return some message with a header; seq is the frame."""
    return PersonDetectionArray(header=Header(frame, rospy.Time(0, stamp), ''))


class Inputs:
    """Two filters that the test feeds, and the pairs that come out of what is behind them."""

    def __init__(self):
        self.filters = message_filters.SimpleFilter(), message_filters.SimpleFilter()
        self.pairs: List[Pair] = []

    def keep(self, image, points):
        self.pairs.append((image.header.seq, points.header.seq))

    def send(self, messages):
        for stream, stamp, frame in messages:
            self.filters[stream].signalMessage(message(frame, stamp))

    @property
    def wrong(self) -> List[Pair]:
        return [(image, points) for image, points in self.pairs if image != points]


def synchronized():
    """Return inputs, a synchronizer behind them, and what it counts."""
    source, health = Inputs(), CountedHealth()
    synchronizer = StampSynchronizer(source.filters, PairingParams(), health)
    synchronizer.registerCallback(source.keep)
    return source, synchronizer, health


# 20 s each at 30 Hz, points 10 +- 4 ms after the images, a fifth of the messages of each stream lost
RECORDINGS = [two_streams(seed) for seed in range(20)]


def test_lost_messages_lead_to_no_wrong_pairs():
    for messages in RECORDINGS:
        inputs, _, _ = synchronized()
        inputs.send(messages)
        common = len({each.frame for each in messages if each.stream == IMAGE}
                     & {each.frame for each in messages if each.stream == POINTS})
        assert inputs.wrong == []
        # the first pairs teach the usual difference of the stamps
        assert len(inputs.pairs) > common - PAIRING.min_offsets


def test_without_the_sequencer_messages_out_of_order_are_counted():
    ends, _, health = synchronized()
    for frame in (0, 2, 1, 3):
        for each in ends.filters:
            each.signalMessage(message(frame, EPOCH + frame * 33_000_000))
    assert ends.pairs == [(0, 0), (2, 2), (3, 3)]
    assert health.counts == {'stamp not newer': 2}


def test_an_exception_in_a_callback_does_not_stop_either_stream():
    ends, synchronizer, _ = synchronized()
    failing = [True]

    def fail(image, points):
        if failing[0]:
            raise RuntimeError('a callback fails')

    synchronizer.registerCallback(fail)
    ends.filters[IMAGE].signalMessage(message(0, EPOCH))
    with pytest.raises(RuntimeError, match='a callback fails'):
        ends.filters[POINTS].signalMessage(message(0, EPOCH))
    failing[0] = False
    for frame in (1, 2):
        for each in ends.filters:
            each.signalMessage(message(frame, EPOCH + frame * 10**9))
    assert ends.pairs == [(0, 0), (1, 1), (2, 2)]
    assert synchronizer.pairs == 3


def test_a_callback_that_takes_its_time_holds_up_neither_stream():
    ends, synchronizer, _ = synchronized()
    begun, go_on = threading.Event(), threading.Event()

    def wait(image, points):
        begun.set()
        assert go_on.wait(60)

    synchronizer.registerCallback(wait)
    ends.filters[IMAGE].signalMessage(message(0, EPOCH))
    thread = threading.Thread(target=ends.filters[POINTS].signalMessage, args=(message(0, EPOCH),), daemon=True)
    thread.start()
    assert begun.wait(60)
    # would not return if a lock were held
    other = threading.Thread(target=ends.filters[IMAGE].signalMessage, args=(message(1, EPOCH + 10**9),), daemon=True)
    other.start()
    other.join(10)
    assert not other.is_alive()
    go_on.set()
    thread.join(60)

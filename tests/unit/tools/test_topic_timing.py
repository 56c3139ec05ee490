"""Rate and delay of topics: frames of several messages, missing stamps, recordings that are not live."""
import numpy as np
import pytest

from openpose_ros_tools.topic_timing import COLUMNS, TopicTiming, cells, in_order, markdown, notes

MS = 10 ** 6
BEGIN = 1700000000 * 1000 * MS


def timing(delays, topic='/image', period=100, offset=0):
    """Messages with these delays [ms], one for each period [ms]."""
    stamps = [BEGIN + period * number * MS for number in range(len(delays))]
    return TopicTiming.of_messages(topic, 'sensor_msgs/Image', [stamp + offset for stamp in stamps],
                                   [stamp + int(delay * MS) for stamp, delay in zip(stamps, delays)])


def test_no_messages_have_no_figures():
    empty = timing([])
    assert cells(empty) == ('/image', 'sensor_msgs/Image', '0', '0', *[''] * 6)
    assert notes([empty]) == []


def test_figures_of_a_topic():
    found = timing([4, 6, 8, 4, 28])
    assert cells(found)[2:] == ('5', '5', '9.434', '6.000', '10.000', '24.000', '28.000', '4.000')
    assert found.rate == pytest.approx(4 / 0.424)
    assert notes([found]) == []


def test_messages_of_one_stamp_are_a_frame_that_arrives_with_the_last():
    stamps = [BEGIN, BEGIN, BEGIN + 100 * MS, 0, None]
    arrivals = [BEGIN + 9 * MS, BEGIN + 7 * MS, BEGIN + 105 * MS, BEGIN + 106 * MS, BEGIN + 107 * MS]
    found = TopicTiming.of_messages('/people', 'a/B', stamps, arrivals)
    assert (found.messages, found.delays.tolist()) == (5, [9.0, 5.0])
    assert found.rate == pytest.approx(1 / 0.096)


def test_messages_without_stamps_have_a_rate_alone():
    found = TopicTiming.of_messages('/tf', 'tf2_msgs/TFMessage', [None, 0, None], [0, 50 * MS, 100 * MS])
    assert cells(found)[2:] == ('3', '3', '20.000', '', '', '', '', '')


def test_topics_come_in_the_order_of_their_delay():
    found = in_order([TopicTiming.of_messages('/tf', 'a/B', [None], [1]), timing([30, 30], '/people'),
                      timing([4, 5], '/image')])
    assert [one.topic for one in found] == ['/image', '/people', '/tf']
    lines = markdown(found).splitlines()
    assert len({len(line) for line in lines}) == 1 and len(lines) == 5
    assert [cell.strip() for cell in lines[2].split('|')[1:-1]] == list(cells(found[0]))
    assert [cell.strip() for cell in lines[0].split('|')[1:-1]] == list(COLUMNS)


@pytest.mark.parametrize('found, words', [
    (timing([0, 0, 0]), '/image: the messages have exactly the times of their stamps'),
    (timing([4, 5, 6], offset=-3600 * 1000 * MS), '/image: the stamps are of another clock'),
    (timing([4, 5, 6], offset=11 * 1000 * MS), '/image: the stamps are of another clock'),
    (timing([4, -1, 6]), '/image: messages were recorded before their stamp')])
def test_delays_that_tell_nothing_are_noted(found, words):
    note, = notes([timing([4, 5], '/other'), found])
    assert note.startswith(words)


def test_the_border_of_another_clock_is_an_argument():
    late = timing([2000, 2000])
    assert notes([late]) == [] and len(notes([late], other_clock=1.0)) == 1
    assert np.isfinite(late.delay.median)

"""Rate and delay of topics: frames of several messages, missing stamps, recordings that are not live."""
import numpy as np
import pytest

from openpose_ros_tools.topic_timing import notes, timing_table, topic_timing

MS = 10 ** 6
BEGIN = 1700000000 * 1000 * MS


def timing(delays, topic='/image', offset=0):
    """Messages at 10 Hz with these delays [ms]."""
    stamps = [BEGIN + 100 * number * MS for number in range(len(delays))]
    return topic_timing(topic, 'sensor_msgs/Image', [stamp + offset for stamp in stamps],
                        [stamp + int(delay * MS) for stamp, delay in zip(stamps, delays)])


def test_rows_are_in_the_order_of_their_delay():
    """No messages have no figures, and messages without stamps have a rate alone."""
    table = timing_table([topic_timing('/tf', 'a/B', [None, 0, None], [0, 50 * MS, 100 * MS]), timing([], '/empty'),
                          timing([30, 30], '/people'), timing([4, 6, 8, 4, 28])])
    assert table.topic.tolist() == ['/image', '/people', '/empty', '/tf']
    np.testing.assert_allclose(table.iloc[0].to_numpy()[2:].astype(float),
                               [5, 5, 4 / 0.424, 6, 10, 24, 28, 4], rtol=1e-9)
    np.testing.assert_allclose(table.iloc[2:, 2:].to_numpy(float), [[0, 0] + [np.nan] * 6, [3, 3, 20] + [np.nan] * 5])


def test_messages_of_one_stamp_are_a_frame_that_arrives_with_the_last():
    stamps = [BEGIN, BEGIN, BEGIN + 100 * MS, 0, None]
    arrivals = [BEGIN + 9 * MS, BEGIN + 7 * MS, BEGIN + 105 * MS, BEGIN + 106 * MS, BEGIN + 107 * MS]
    found = topic_timing('/people', 'a/B', stamps, arrivals)
    assert (found.messages, found.delays.tolist()) == (5, [9.0, 5.0])
    assert found.rate == pytest.approx(1 / 0.096)


@pytest.mark.parametrize('found, words', [
    (timing([0, 0, 0]), '/image: the messages have exactly the times of their stamps'),
    (timing([4, 5, 6], offset=-3600 * 1000 * MS), '/image: the stamps are of another clock'),
    (timing([4, 5, 6], offset=11 * 1000 * MS), '/image: the stamps are of another clock'),
    (timing([4, -1, 6]), '/image: messages were recorded before their stamp')])
def test_delays_that_tell_nothing_are_noted(found, words):
    note, = notes([timing([4, 5], '/other'), timing([], '/empty'), found])
    assert note.startswith(words)

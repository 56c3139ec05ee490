"""Two streams are paired by stamp: a message whose partner was lost stays alone, in any order of arrival."""
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from openpose_ros_pkg.stream.pairing import PairingParams, StampMatcher
from two_streams import EPOCH, two_streams

IMAGE, CLOUD = 0, 1


def ns(seconds: float) -> int:
    return EPOCH + round(seconds * 1e9)


def play(seed=0, frames=600, rates=(30, 30), drops=0.2, offset=0.010, jitter=0.004, late=(0.0, 0.0)):
    """Send the frames of one scene as two streams; return pairs, how many were possible, and the longest queue.

    Items are frame numbers, so a right pair has two equal ones.
    """
    messages = two_streams(seed, frames, rates, drops, offset, jitter, late)
    kept = [{each.frame for each in messages if each.stream == stream} for stream in (IMAGE, CLOUD)]
    matcher, pairs, longest = StampMatcher(PairingParams()), [], 0
    for stream, stamp, frame in messages:
        pair = matcher.add(stream, stamp, frame)
        pairs += [pair] if pair else []
        longest = max(longest, *map(len, matcher._queues))
    assert all(image == cloud for image, cloud in pairs)
    return pairs, len(kept[0] & kept[1]), longest


def test_one_stream_alone_pairs_nothing_and_keeps_a_bounded_queue():
    matcher = StampMatcher(PairingParams())
    for stream, bound in ((IMAGE, 30), (CLOUD, 15)):
        matcher = StampMatcher(PairingParams())
        assert all(matcher.add(stream, ns(i / 30), i) is None for i in range(100))
        assert matcher.unpaired[stream] == 100 - bound


def test_equal_stamps_pair_from_the_first_message_on():
    matcher = StampMatcher(PairingParams())
    assert [matcher.add(stream, ns(t), (stream, t)) for t in (0.0, 0.5, 0.6) for stream in (CLOUD, IMAGE)] == [
        None, ((0, 0.0), (1, 0.0)), None, ((0, 0.5), (1, 0.5)), None, ((0, 0.6), (1, 0.6))]
    assert matcher.unpaired == [0, 0]


@pytest.mark.parametrize('seed, late, rates', [
    (0, (0.0, 0.0), (30, 30)), (1, (0.0, 0.3), (30, 30)), (2, (0.3, 0.0), (30, 30)), (3, (0.0, 0.0), (15, 30)),
    (0, (0.0, 0.3), (15, 30)), (1, (0.3, 0.0), (30, 15)), (2, (0.0, 0.0), (30, 15))], ids=str)
def test_no_wrong_pair_when_a_fifth_of_both_streams_is_lost(seed, late, rates):
    # 20 s at 30 Hz, clouds 10 +- 4 ms after the images. The first seven pairs teach the offset and are lost, which are
    # 2 % of 384 (or 4 % of 192) possible ones.
    pairs, possible, longest = play(seed, late=late, rates=rates)
    assert len(pairs) > 0.95 * possible and longest <= 17


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), rate=st.floats(2, 120), offset=st.floats(-0.35, 0.35),
       jitter=st.floats(0, 0.05), drops=st.floats(0, 0.3), delay=st.floats(-8, 8))
def test_no_wrong_pair_at_any_rate_offset_and_delay(seed, rate, offset, jitter, drops, delay):
    # offset and jitter in periods, delay in frames; the queues hold one second, so slower streams get less delay
    period = 1 / rate
    late = min(abs(delay) * period, 0.4)
    pairs, *_ = play(seed, 150, (rate, rate), drops, offset * period, jitter * period,
                     (late if delay < 0 else 0, late if delay > 0 else 0))
    for stream in (IMAGE, CLOUD):
        used = [pair[stream] for pair in pairs]
        assert used == sorted(set(used))


def test_a_bag_that_begins_again_pairs_on():
    matcher, pairs = StampMatcher(PairingParams()), []
    for _ in range(3):
        for i in range(60):
            matcher.add(IMAGE, ns(i / 30), i)
            pair = matcher.add(CLOUD, ns(i / 30 + 0.01), i)
            pairs += [pair] if pair else []
    assert all(image == cloud for image, cloud in pairs)
    assert len(pairs) > 3 * 60 - 10
    # each stream jumps back once per repetition, or the second finds everything forgotten already
    assert 2 <= matcher.resets <= 4


def test_repeated_and_late_messages_are_counted_and_not_used():
    matcher = StampMatcher(PairingParams())
    matcher.add(IMAGE, ns(1.0), 'a')
    assert matcher.add(IMAGE, ns(1.0), 'again') is None
    assert matcher.add(IMAGE, ns(0.9), 'late') is None
    assert matcher.out_of_order == 2
    assert matcher.resets == 0
    assert matcher.add(CLOUD, ns(1.0), 'b') == ('a', 'b')


def test_the_end_of_a_recording_pairs_what_waits_for_something_nearer():
    matcher = StampMatcher(PairingParams(slop=1.0))
    assert matcher.finish() == []
    for t in (0.0, 0.1):
        assert matcher.add(IMAGE, ns(t), t) is None
    assert matcher.add(CLOUD, ns(0.12), 'cloud') is None
    assert matcher.finish() == [(0.1, 'cloud')]
    assert matcher.unpaired == [1, 0]
    assert matcher.finish() == []


def test_what_was_learnt_survives_a_restart():
    matcher = StampMatcher(PairingParams())
    for i in range(12):
        matcher.add(IMAGE, ns(i / 15), i)
        matcher.add(CLOUD, ns(i / 15 + 0.02), i)
    matcher.restart()
    assert matcher.unpaired == [0, 0]
    assert (matcher.out_of_order, matcher.resets) == (0, 0)
    assert matcher.add(IMAGE, ns(0.0), 'image') is None
    # a difference that the first pair of a new matcher would not have bridged
    assert matcher.add(CLOUD, ns(0.02), 'cloud') == ('image', 'cloud')

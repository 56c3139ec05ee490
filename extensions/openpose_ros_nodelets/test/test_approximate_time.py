"""StampMatcher makes the pairs of the policy ApproximateTime of message_filters for C++, and none of its wrong ones.

Equal, pair by pair, on streams that lose nothing, and on streams that lose messages where that policy is told an
interval that no wrong pair can have. Without such an interval that policy makes wrong pairs of what is left over, which
StampMatcher does not, as it knows the usual difference of the stamps.
"""
import subprocess
from dataclasses import dataclass
from typing import Dict, List, Sequence, Tuple

import numpy as np
import pytest

from openpose_ros_pkg.stream.pairing import PAIRING, PairingParams, StampMatcher
from two_streams import Message, two_streams

Pair = Tuple[int, int]  # stamps [ns]
QUEUE = 100  # more than arrive before their partner, in either implementation
RECORDINGS = 60
# Pairs that may be missing at the beginning, as they teach the usual difference of the stamps.
LEARNING = PAIRING.min_offsets - 1


@dataclass
class Recording:
    """The messages of a recording, the shorter period of its streams [s], and the frame that each message shows."""

    messages: List[Message]
    period: float

    def __post_init__(self) -> None:
        self.frame_of: Dict[Tuple[int, int], int] = {(each.stream, each.stamp): each.frame for each in self.messages}

    def wrong(self, pairs: Sequence[Pair]) -> List[Pair]:
        """Return the pairs of messages that show different frames."""
        return [pair for pair in pairs if self.frame_of[0, pair[0]] != self.frame_of[1, pair[1]]]


def random_recordings(drops: float) -> List[Recording]:
    """Return recordings of any rate, offset, jitter, delay and burst.

    Offset and jitter together stay below half a period, so that the nearest stamp is that of the same frame.
    """
    recordings = []
    for seed in range(RECORDINGS):
        rng = np.random.default_rng(seed)
        rate = rng.uniform(2, 120)
        period, ratio = 1 / rate, (1, 2)[seed % 3 == 0]
        rates = ((rate, rate / ratio), (rate / ratio, rate))[seed % 2]
        late = rng.uniform(0, 0.3, 2) * min(1.0, 30 * period)
        recordings.append(Recording(two_streams(
            seed, 150, rates, drops, rng.uniform(-0.35, 0.35) * period, rng.uniform(0, 0.1) * period, tuple(late),
            int(rng.integers(1, 5))), period))
    return recordings


def pairs_by_matcher(recording: Recording) -> List[Pair]:
    matcher = StampMatcher(PairingParams(queue_size=QUEUE))
    found = [matcher.add(each.stream, each.stamp, each.stamp) for each in recording.messages]
    return [pair for pair in found if pair is not None] + matcher.finish()


def pairs_by_policy(recordings: Sequence[Recording], interval: float) -> List[List[Pair]]:
    """Return the pairs of ApproximateTime in each recording.

    Args:
        interval: greatest difference of the stamps of a pair, in periods; 0: any.
    """
    lines = []
    for recording in recordings:
        lines.append(f'begin {QUEUE} {interval * recording.period:.9f}')
        lines += [f'{each.stream} {each.stamp}' for each in recording.messages]
    out = subprocess.run(['rosrun', 'openpose_ros_nodelets', 'test_approximate_time_pairs'], input='\n'.join(lines),
                         stdout=subprocess.PIPE, text=True, check=True).stdout
    return [[(int(first), int(second)) for first, second in (line.split() for line in block.splitlines() if line)]
            for block in out.split('begin\n')[1:]]


@pytest.mark.parametrize('drops, interval', [(0.0, 0.0), (0.2, 0.5)], ids=['nothing lost', 'a fifth lost, bounded'])
def test_pairs_are_those_of_the_policy(drops, interval):
    recordings = random_recordings(drops)
    compared = 0
    for recording, theirs in zip(recordings, pairs_by_policy(recordings, interval)):
        ours, expected = pairs_by_matcher(recording), theirs[LEARNING:]
        assert [pair for pair in ours if expected[0] <= pair <= expected[-1]] == expected
        # the policy waits at the end for messages that could still be nearer
        assert len([pair for pair in ours if pair > expected[-1]]) <= 1
        assert recording.wrong(ours) == recording.wrong(theirs) == []
        compared += len(expected)
    assert compared > 50 * RECORDINGS


def test_without_a_bound_the_policy_pairs_what_is_left_over_and_ours_does_not():
    recordings = random_recordings(0.2)
    number = wrong = 0
    for recording, theirs in zip(recordings, pairs_by_policy(recordings, 0.0)):
        ours, wrong_ones = pairs_by_matcher(recording), recording.wrong(theirs)
        assert recording.wrong(ours) == []
        assert set([pair for pair in theirs if pair not in wrong_ones][LEARNING:]) <= set(ours)
        number, wrong = number + len(theirs), wrong + len(wrong_ones)
    assert wrong > 0.05 * number

"""Which people are there, and since when."""
import numpy as np
import pytest

from animated_skeleton import UP, Pose, people_of
from openpose_ros_signals.reader import SignalReader

PLACES = {1: (0.0, 1.5), 2: (0.0, -1.5), 3: (0.0, 1.5)}


@pytest.mark.parametrize('frames, there', [
    ([(5.0, [1]), (5.5, [1, 2]), (6.0, [2]), (6.5, [2])], [(2, 5.5)]), ([(5.0, [1, 2]), (5.1, [])], []),
    ([(5.0, [2]), (5.1, []), (5.9, [2])], [(2, 5.0)]), ([(5.0, [1, 2]), (5.9, []), (6.1, [2])], [(2, 6.1)]),
    ([(5.0, [1]), (5.1, [3])], [(3, 5.1)]), ([(100.0, [1, 2]), (99.9, [1])], [(1, 99.9)])],
    ids=['one is gone', 'all are gone', 'was away for less than a second', 'was away for longer',
         'a new id in the same place', 'time jumps back'])
def test_people_of_the_last_frame_and_since_when(frames, there):
    reader, random = SignalReader(), np.random.RandomState(0)
    assert reader.present == ()
    for stamp, ids in frames:
        reader.update(people_of([Pose(place=PLACES[name]) for name in ids], ids, random), stamp, UP)
    assert [(present.signals.id, present.since) for present in reader.present] == there

"""Who is there, and since when."""
import numpy as np

from openpose_ros_signals.records import Gesture, PersonSignals, Posture
from openpose_ros_signals.show.summary import Summary


def person(name, posture='standing', *gestures):
    return PersonSignals(name, np.zeros(3), Posture(posture, 0.0, 1.0),
                         tuple(Gesture(gesture, 'left', 0.0, 1.0) for gesture in gestures))


def test_that_nobody_is_there_is_told_once():
    summary = Summary()
    assert [summary.update([], stamp) for stamp in (0.0, 0.1)] == [True, False]
    assert summary.people == []


def test_changes_are_told():
    summary = Summary()
    frames = [[person(1)], [person(1)], [person(1), person(2)], [person(1, 'sitting'), person(2)],
              [person(1, 'sitting'), person(2, 'standing', 'wave')], [person(2, 'standing', 'wave')], []]
    assert [summary.update(frame, 0.1 * number) for number, frame in enumerate(frames)] == [
        True, False, True, True, True, True, True]


def test_since_when():
    summary = Summary()
    for stamp, names in ((5.0, [1]), (5.5, [1, 2]), (6.0, [2]), (6.4, [1, 2])):
        summary.update([person(name) for name in names], stamp)
    assert [present.since for present in summary.people] == [5.0, 5.5]


def test_who_was_away_for_long_came_anew():
    summary = Summary()
    for stamp, names in ((5.0, [1]), (6.5, []), (7.0, [1])):
        summary.update([person(name) for name in names], stamp)
    assert [present.since for present in summary.people] == [7.0]


def test_time_that_jumps_back_begins_anew():
    summary = Summary()
    for stamp in (100.0, 3.0):
        summary.update([person(1)], stamp)
    assert [present.since for present in summary.people] == [3.0]

"""Who is there, and since when."""
import numpy as np
import pytest

from animated_skeleton import UP, Pose, people_of
from openpose_ros_signals.reader import SignalReader
from openpose_ros_signals.records import Gesture, PersonSignals, Posture
from openpose_ros_signals.show.summary import Summary

PLACES = {1: (0.0, 1.5), 2: (0.0, -1.5), 3: (0.0, 1.5)}


def person(name, posture='standing', *gestures):
    return PersonSignals(name, np.zeros(3), Posture(posture, 0.0, 1.0),
                         tuple(Gesture(gesture, 'left', 0.0, 1.0) for gesture in gestures))


def read(*frames):
    """Return the summary after frames of (stamp, ids), and for each whether it has changed."""
    reader, summary, random = SignalReader(), Summary(), np.random.RandomState(0)
    changed = []
    for stamp, ids in frames:
        people = people_of([Pose(place=PLACES[name]) for name in ids], ids, random)
        reader.update(people, stamp, UP)
        changed.append(summary.update([person(name) for name in ids], stamp, reader.known))
    return summary, changed


def told(summary):
    """Return the id of each person in the summary, since when, and when seen last."""
    return [(present.signals.id, present.since, present.seen) for present in summary.people]


def test_that_nobody_is_there_is_told_once():
    summary = Summary()
    assert [summary.update([], stamp, {}) for stamp in (0.0, 0.1)] == [True, False]
    assert summary.people == ()


def test_changes_are_told():
    summary = Summary()
    frames = [[person(1)], [person(1)], [person(1), person(2)], [person(1, 'sitting'), person(2)],
              [person(1, 'sitting'), person(2, 'standing', 'wave')], [person(2, 'standing', 'wave')], []]
    changed = [summary.update(frame, 0.1 * number, {one.id: 0.0 for one in frame})
               for number, frame in enumerate(frames)]
    assert changed == [True, False, True, True, True, True, True]


def test_a_person_missed_for_a_second_stays_with_the_time_of_the_last_sight():
    summary, changed = read((5.0, [1]), (5.5, [1, 2]), (6.0, [2]), (6.5, [2]))
    assert told(summary) == [(1, 5.0, 5.5), (2, 5.5, 6.5)] and changed == [True, True, False, False]
    summary, changed = read((5.0, [1, 2]), (5.9, []), (6.0, []), (6.1, [2]))
    assert told(summary) == [(2, 6.1, 6.1)] and changed == [True, False, False, True]


def test_a_person_missed_for_longer_has_left_and_comes_anew():
    summary, changed = read((5.0, [1]), (6.05, []), (6.5, [1]))
    assert told(summary) == [(1, 6.5, 6.5)] and changed == [True, True, True]


def test_a_new_id_of_the_same_person_is_there_in_the_place_of_the_old_one():
    summary, changed = read((5.0, [1]), (5.1, [3]))
    assert told(summary) == [(3, 5.0, 5.1)] and changed == [True, True]


@pytest.mark.parametrize('back', [3.0, 99.9])
def test_time_that_jumps_back_begins_anew(back):
    summary, _ = read((100.0, [1, 2]), (back, [1]))
    assert told(summary) == [(1, back, back)]


def test_clearing_is_a_change_if_people_were_there():
    summary, _ = read((5.0, [1]))
    assert summary.clear() and summary.people == () and not summary.clear()
    assert summary.update([person(1)], 5.1, {1: 5.1}) and told(summary) == [(1, 5.1, 5.1)]

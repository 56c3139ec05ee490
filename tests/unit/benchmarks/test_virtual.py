"""The benchmark in virtual time: which frames are answered, and what counts as lost, ghost, switch and return."""
from types import SimpleNamespace

import numpy as np
import pytest

import virtual
from chain_runs import BEGIN
from common import DEMO
from openpose_ros_pkg.detect.detection import NextPart
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import MEASURED, People3D
from virtual import Answer, Machine, Moment, Tally

HERE, THERE, NOWHERE = 0.0, 2.0, 7.0  # [m] places of people
RATE = 10.0  # [Hz]


def joints(place):
    return np.full((18, 3), place) + np.arange(18)[:, None] / 18


def moment(number, hidden=(), **places):
    """A moment in which people stand at places."""
    names = [int(name[1:]) for name in places]
    return Moment(Frame('', BEGIN + number / RATE, None, size=(64, 48)), names,
                  np.array([joints(place) for place in places.values()]).reshape(-1, 18, 3),
                  np.array([[name not in hidden] * 18 for name in names], bool).reshape(-1, 18))


def answer(number, **places):
    shape = (len(places), 18)
    xyz = np.array([joints(place) for place in places.values()]).reshape(*shape, 3)
    people = People3D(COCO_18, xyz, np.ones(shape), np.full(shape, MEASURED), np.zeros(shape),
                      [int(name[1:]) for name in places])
    return Answer(number, SimpleNamespace(people_3d=people), 0.0)


def tallied(*moments):
    tally = Tally()
    for one, reported in moments:
        tally.add(one, reported)
    return tally.sums


def test_nothing_happens():
    assert tallied((moment(0), None))['lost'] == 0
    assert tallied((moment(0), answer(0)))['ghosts'] == 0


def test_a_visible_person_without_a_report_is_lost_a_hidden_one_is_not():
    sums = tallied((moment(0, p1=HERE, p2=THERE), answer(0, i5=HERE)), (moment(1, hidden=[2], p1=HERE, p2=THERE),
                                                                       answer(1, i5=HERE)))
    assert (sums['plain'], sums['lost'], sums['ghosts'], sums['answered']) == (3, 1, 0, 2)


def test_a_report_without_a_person_is_a_ghost():
    sums = tallied((moment(0, p1=HERE), answer(0, i5=HERE, i6=NOWHERE)), (moment(1), answer(1, i5=HERE)))
    assert (sums['found'], sums['ghosts'], sums['lost']) == (3, 2, 0)


def test_another_id_is_a_switch_unless_the_person_was_away():
    assert tallied((moment(0, p1=HERE), answer(0, i5=HERE)), (moment(1, p1=HERE), answer(1, i6=HERE)))['switches'] == 1
    sums = tallied((moment(0, p1=HERE), answer(0, i5=HERE)), (moment(30, p1=HERE), answer(30, i6=HERE)),
                   (moment(60, p1=HERE), answer(60, i6=HERE)))
    assert (sums['switches'], sums['returned'], sums['kept'], sums['ids'], sums['people']) == (0, 2, 1, 2, 1)


def test_the_id_of_another_person_is_a_switch():
    sums = tallied((moment(0, p1=HERE), answer(0, i5=HERE)), (moment(30, p2=HERE), answer(30, i5=HERE)))
    assert (sums['switches'], sums['people'], sums['ids']) == (1, 2, 1)


def test_time_without_a_report_counts_in_plain_view_alone_and_through_frames_that_were_left_out():
    seen = [(moment(0, p1=HERE), answer(0, i5=HERE)), (moment(1, p1=HERE), None), (moment(4, p1=HERE), None)]
    assert tallied(*seen)['unreported'] == pytest.approx(0.4)
    assert tallied(*seen, (moment(5, hidden=[1], p1=HERE), answer(5)), (moment(6, p1=HERE), answer(6)),
                   (moment(7, p1=HERE), answer(7, i5=HERE)), (moment(8, p1=HERE), answer(8, i5=HERE))
                   )['unreported'] == pytest.approx(0.4)


class Chain:
    """Looks for a time, and has parts to search."""

    def __init__(self, machine, look, *parts):
        self.machine, self.looks, self.parts, self.searched = machine, look, parts, 0

    def look(self, frame):
        self.machine.work(self.looks)
        return frame.stamp

    def search(self):
        for part in self.parts:
            yield part
            self.machine.work(part.seconds)
            self.searched += 1


def played(look, *parts, frames=6):
    machine = Machine()
    chain = Chain(machine, look, *parts)
    answers = virtual.play(chain, machine, [moment(number) for number in range(frames)])
    return [one.number for one in answers], [one.latency for one in answers], chain.searched


def test_a_quick_machine_answers_all_frames_a_slow_one_the_newest():
    numbers, latencies, _ = played(0.02)
    assert numbers == [0, 1, 2, 3, 4, 5] and latencies == pytest.approx(6 * [0.02 + virtual.BESIDES])
    assert played(0.25 - virtual.BESIDES)[0] == [0, 2, 5]


def test_a_search_ends_before_the_next_frame_unless_a_part_is_owed():
    numbers, latencies, searched = played(0.02, *9 * [NextPart(0.03)])
    assert numbers == [0, 1, 2, 3, 4, 5] and searched > 10
    assert latencies[2:] == pytest.approx(4 * [0.02 + virtual.BESIDES])  # when the second comes is not known before
    numbers, _, searched = played(0.02, NextPart(0.15, owed=True))
    assert numbers == [0, 1, 3, 5] and searched == 4


def test_a_busy_machine_takes_longer_for_a_while():
    machine = Machine()
    machine.slow, machine.load = 2.0, 3.0
    machine.work(0.1)
    assert machine.clock() == pytest.approx(0.6)
    machine.now = virtual.BUSY
    machine.work(0.1)
    assert machine.clock() == pytest.approx(virtual.BUSY + 0.2)


def test_black_images_between_passes_and_then_another_light():
    moments = virtual.moments_of(DEMO)
    again = virtual.passes(moments, 15.0, 2, 2.0, (0.0, 1.0, 0.5))
    black, last = again[len(moments)], again[-1]
    assert len(again) == 2 * len(moments) + 30
    assert not black.frame.bgr.any() and not len(black.ids) and last.ids == moments[-1].ids
    np.testing.assert_array_equal(last.frame.bgr, moments[-1].frame.bgr // (1, 1, 2) * (0, 1, 1))
    assert np.diff([one.frame.stamp for one in again]) == pytest.approx(1 / 15)

"""Sightings of several cameras become updates at common stamps."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_fusion.collector import Collector
from openpose_ros_fusion.constants import FUSION
from openpose_ros_fusion.observations import from_space
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import People3D

EMPTY = from_space('', 0.0, People3D.empty(COCO_18), (np.eye(3), np.zeros(3)))
PATIENCE = FUSION.collector.patience


def play(arrivals, cameras='abc', end=None):
    """Send (arrival, camera, stamp), look in between when the collector asks for it; return (time, update)."""
    collector = Collector(cameras)
    updates = []
    for arrival, camera, stamp in sorted(arrivals):
        while collector.deadline is not None and collector.deadline < arrival:
            deadline = collector.deadline
            updates += [(deadline, update) for update in collector.due(deadline)]
        updates += [(arrival, update) for update in
                    collector.add(replace(EMPTY, camera=camera, stamp=stamp), arrival)]
    if collector.deadline is not None:
        updates += [(collector.deadline, update) for update in collector.due(collector.deadline)]
    return updates, collector


def stream(camera, rate, seconds=2.0, phase=0.0, latency=0.01, late=0.0):
    times = phase + np.arange(int(seconds * rate)) / rate
    return [(time + latency, camera, time + late) for time in times.tolist()]


def names(update):
    return ''.join(sorted(sighting.camera for sighting in update.sightings))


def test_cameras_with_one_shutter_make_one_update_each_time_without_waiting():
    assert Collector('abc').due(1e9) == [] and Collector('abc').deadline is None
    updates, _ = play([each for camera in 'abc' for each in stream(camera, 30.0)])
    assert len(updates) == 60
    assert all(names(update) == 'abc' and time == pytest.approx(update.stamp + 0.01) for time, update in updates)


@pytest.mark.parametrize('rate, delay, speed', [(10.0, 0.03, 1.0), (1.5, 0.2, 1.0), (0.8, 0.2, 0.1)])
def test_cameras_that_share_a_detector_make_one_update_each_time(rate, delay, speed):
    """As behind one detector: a camera is up to two delays later than the first one; also in slow motion."""
    updates, _ = play([(arrival, camera, speed * stamp) for place, camera in enumerate('abc')
                       for arrival, _, stamp in stream(camera, rate, 20.0, latency=0.1 + place * delay)])
    settled = updates[3:]
    assert len(settled) > 10 and all(names(update) == 'abc' for _, update in settled)
    assert all(len({sighting.stamp for sighting in update.sightings}) == 1 for _, update in settled)
    assert max(time - update.stamp / speed for time, update in settled) == pytest.approx(0.1 + 2 * delay)


def test_a_slow_camera_does_not_slow_down_the_others():
    updates, _ = play([*stream('a', 30.0), *stream('b', 30.0), *stream('c', 5.0, phase=0.003)])
    settled = [(time, update) for time, update in updates if update.stamp > 0.5]
    assert len(settled) >= 44  # of 45 frames
    assert sum(names(update) == 'abc' for _, update in settled) == 7  # all its frames that are left
    assert max(time - update.stamp for time, update in settled) < 0.01 + 0.004


def test_cameras_without_a_common_shutter_come_with_what_they_saw_last():
    updates, _ = play([*stream('a', 30.0), *stream('b', 30.0, phase=0.02)], 'ab')
    settled = [update for _, update in updates if update.stamp > 0.5]
    assert [names(update) for update in settled].count('ab') >= len(settled) - 1 > 40


def test_a_camera_that_dies_costs_the_patience_until_it_is_silent_and_may_come_back():
    dead = [each for each in stream('c', 30.0, 6.0) if not 2.0 < each[0] < 4.5]
    updates, _ = play([*stream('a', 30.0, 6.0), *stream('b', 30.0, 6.0), *dead])
    waited = {update.stamp: time - update.stamp for time, update in updates}
    assert max(waited.values()) <= 0.01 + PATIENCE + 1e-9
    assert max(wait for stamp, wait in waited.items() if 3.1 < stamp < 4.4) == pytest.approx(0.01)
    assert names(updates[-1][1]) == 'abc'


def test_stamps_of_updates_only_grow_although_messages_are_late_or_out_of_order():
    jitter = np.random.RandomState(1)
    arrivals = [(time + 0.04 * jitter.rand(), camera, stamp) for camera, rate in zip('abc', (30.0, 25.0, 7.0))
                for time, _, stamp in stream(camera, rate, 4.0)]
    updates, collector = play(arrivals)
    stamps = [update.stamp for _, update in updates]
    assert np.all(np.diff(stamps) > 0)
    used = sum(len(update.sightings) for _, update in updates)
    assert used + sum(collector.dropped.values()) == len(arrivals)


def test_a_camera_that_is_an_hour_off_is_left_out_and_counted(late=3600.0):
    updates, collector = play([*stream('a', 30.0), *stream('b', 30.0), *stream('c', 30.0, phase=0.001, late=late)])
    settled = [update for _, update in updates if 0.2 < update.stamp < 100]
    assert len(settled) >= 52 and all(names(update) == 'ab' for update in settled)
    assert collector.out_of_time == {'a': 0, 'b': 0, 'c': 60}


def test_a_recording_that_begins_anew_is_followed_after_a_second_of_doubt():
    again = [(time + 2.0, camera, stamp) for camera in 'ab' for time, _, stamp in stream(camera, 30.0, 4.0)]
    updates, _ = play([*stream('a', 30.0), *stream('b', 30.0), *again], 'ab')
    assert max(update.stamp for _, update in updates[-30:]) == pytest.approx(4.0 - 1 / 30)
    assert next(time for time, _ in updates if time > 2.1) < 3.2


def test_a_late_message_that_waits_through_a_pause_neither_sets_back_the_stamps_nor_puts_others_out_of_time():
    """b is late by half a second when all pause for more than the time to begin anew; then all go on."""
    late = (1.05, 'b', 0.5)
    before = [(time, camera, stamp) for camera in 'ac' for time, _, stamp in stream(camera, 30.0, 1.0)]
    after = [(time, camera, stamp) for camera in 'abc' for time, _, stamp in stream(camera, 30.0, phase=2.0)]
    updates, collector = play([*before, late, *after])
    assert np.all(np.diff([update.stamp for _, update in updates]) > 0)
    assert collector.out_of_time == {'a': 0, 'b': 0, 'c': 0}
    assert sum(update.stamp >= 2.0 for _, update in updates) == 60

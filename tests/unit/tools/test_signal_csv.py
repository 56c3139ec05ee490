"""Tables of signals."""
import csv
import io

import numpy as np

from openpose_ros_signals.records import (
    Facing,
    Fall,
    Gesture,
    Hit,
    PersonSignals,
    PointedTarget,
    Pointing,
    Posture,
    Ray,
    Walk,
)
from openpose_ros_tools.tables.long_csv import SIGNAL_COLUMNS, LongCsvWriter, signal_rows

LAMP = np.array([3.0, 0.0, 1.5])
RAY = Pointing(np.array([0.5, 0.0, 1.5]), np.array([1.0, 0.0, 0.0]), 0.25,
               Ray(np.array([0.5, 0.0, 1.7]), np.array([0.0, 1.0, 0.0]), 0.125),
               Ray(np.array([0.5, 0.0, 1.3]), np.array([0.0, 0.0, 1.0]), 0.0625),
               Hit(LAMP, 'lamp, left', 0.0),
               (PointedTarget('lamp, left', LAMP, 0.5, 0.875), PointedTarget('cup', LAMP, 1.5, 0.125)))
BUSY = PersonSignals(7, np.array([0.5, 0.25, 1.0]), Posture('lying', 11.5, 0.75),
                     (Gesture('wave', 'left', 12.25, 0.5), Gesture('point', 'right', 12.0, 1.0, RAY)),
                     Facing(np.array([0.0, 1.0, 0.0]), 0.125), None, Walk(True, 1.5, np.zeros(3)), Fall(11.5, 0.7, 2.0))
HIDDEN = PersonSignals(8, np.full(3, np.nan))


def table(*frames):
    handle = io.StringIO()
    writer = LongCsvWriter(handle, SIGNAL_COLUMNS)
    numbers = [writer.write(time, signal_rows('room', persons)) for time, persons in frames]
    return numbers, list(csv.DictReader(io.StringIO(handle.getvalue())))


def test_each_gesture_has_a_row_and_a_person_without_gestures_has_one():
    assert table((10, [])) == ([0], [])
    numbers, rows = table((10, [BUSY, HIDDEN]), (20, [HIDDEN]))
    assert numbers == [3, 1]
    assert [(row['frame'], row['person_ID'], row['gesture']) for row in rows] == [
        ('0', '7', 'wave'), ('0', '7', 'point'), ('0', '8', ''), ('1', '8', '')]


def test_values():
    _, (wave, point, hidden) = table((10, [BUSY, HIDDEN]))
    assert (wave['posture'], wave['posture_since'], wave['moving'], wave['speed'], wave['fallen'], wave['fall_stamp'],
            wave['body_y'], wave['head_x'], wave['since'], wave['direction_x']) == (
        'lying', '11500000000', 'true', '1.5', 'true', '11500000000', '1.0', 'nan', '12250000000', 'nan')
    assert (point['direction_x'], point['sigma'], point['target'], point['hit_x']) == ('1.0', '0.25', 'lamp, left',
                                                                                      '3.0')
    assert (point['target_probability'], point['eye_origin_z'], point['eye_direction_y'], point['eye_sigma'],
            point['arm_origin_z'], point['arm_direction_z'], point['arm_sigma']) == (
        '0.875', '1.7', '1.0', '0.125', '1.3', '1.0', '0.0625')
    assert (wave['target_probability'], wave['eye_sigma'], hidden['arm_sigma']) == ('nan', 'nan', 'nan')
    assert (hidden['posture'], hidden['posture_since'], hidden['x'], hidden['moving'], hidden['fallen']) == (
        'unknown', '', 'nan', '', 'false')

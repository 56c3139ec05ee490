"""Signals as CSV: one row per frame, person and gesture. See docs/csv_columns.md."""
import csv
from itertools import groupby
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Sequence, TextIO, Tuple, Union

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_signals.records import Facing, Fall, Gesture, PersonSignals, Posture, Walk
from openpose_ros_tools.tables.keypoint_table import (
    FIELDS,
    MISSING_PART,
    KeypointTable,
    LineWriter,
    PersonRow,
    quoted,
    table_of,
)
from openpose_ros_tools.tables.signal_timeline import SignalTimeline
from skeleton_extract_3d.people import MEASURED

SIGNAL_COLUMNS = (
    'time', 'frame', 'frame_id', 'person_ID', 'x', 'y', 'z', 'posture', 'posture_since', 'posture_confidence',
    'body_x', 'body_y', 'body_z', 'body_sigma', 'head_x', 'head_y', 'head_z', 'head_sigma', 'moving', 'speed',
    'fallen', 'fall_stamp', 'gesture', 'arm', 'since', 'confidence', 'origin_x', 'origin_y', 'origin_z',
    'direction_x', 'direction_y', 'direction_z', 'sigma', 'target', 'hit_x', 'hit_y', 'hit_z')
_NOWHERE = (np.nan, np.nan, np.nan)


class SignalCsvWriter:
    """Writes signals in the order of the recording.

    Args:
        handle: gets the names of the columns at once.
    """

    part, dimensions = 'signals', 3

    def __init__(self, handle: TextIO) -> None:
        self._lines = LineWriter(handle, SIGNAL_COLUMNS)
        self._frame, self._time = -1, -1

    def write(self, time: int, frame_id: str, persons: Sequence[PersonSignals]) -> int:
        """Add the people of a frame at a time [ns]; return how many rows that are."""
        self._frame, self._time = self._frame + (time != self._time), time
        rows = [[time, self._frame, quoted(frame_id), *row] for person in persons for row in _rows(person)]
        self._lines.write_rows(rows)
        return len(rows)


def is_signal_csv(path: Path) -> bool:
    """Return whether a file is a table of signals, by its first line."""
    with path.open('rb') as handle:
        return handle.readline(4096).strip() == ','.join(SIGNAL_COLUMNS).encode()


def read_signal_csv(path: Path) -> Tuple[KeypointTable, SignalTimeline]:
    """Return the places of people, as a table of their mid_hip, and their signals, without rays and speeds of falls.

    Raises:
        BadInputError: it can not be read.
    """
    timeline, rows = SignalTimeline(), []
    try:
        with path.open(newline='', encoding='utf-8') as handle:
            for time, frame in groupby(csv.DictReader(handle), lambda line: int(line['time'])):
                people = [list(lines) for _, lines in groupby(frame, lambda line: line['person_ID'])]
                signals = tuple(_person(lines) for lines in people)
                timeline.add(1e-9 * time, signals)
                rows += [PersonRow(time, 0, time, lines[0]['frame_id'], len(people), person.id, _place(person))
                         for lines, person in zip(people, signals)]
    except (ValueError, TypeError, KeyError, csv.Error) as error:
        raise BadInputError(f'{path} is no table of signals, or is damaged: {error}') from error
    return table_of(rows, 3), timeline


def _place(person: PersonSignals) -> np.ndarray:
    parts = np.tile(np.array(MISSING_PART[3], np.float32), (len(MESSAGE_JOINTS), 1))
    if np.isfinite(person.place).all():
        parts[MESSAGE_JOINTS.index('mid_hip'), :len(FIELDS[3])] = (*person.place, 1.0, MEASURED, np.nan)
    return parts


def _person(lines: Sequence[Dict[str, str]]) -> PersonSignals:
    """Return a person of the rows of a frame."""
    first = lines[0]
    gestures = tuple(Gesture(line['gesture'], line['arm'], _stamp(line['since']), float(line['confidence']))
                     for line in lines if line['gesture'])
    walk = Walk(first['moving'] == 'true', float(first['speed']), np.zeros(3)) if first['moving'] else None
    fall = Fall(_stamp(first['fall_stamp']), np.nan, np.nan) if first['fallen'] == 'true' else None
    return PersonSignals(int(first['person_ID']), np.array([float(first[name]) for name in 'xyz']),
                         Posture(first['posture'], _stamp(first['posture_since']), float(first['posture_confidence'])),
                         gestures, walk=walk, fall=fall)


def _stamp(text: str) -> float:
    """Return a stamp [s]; NaN where it is empty."""
    return 1e-9 * int(text) if text else np.nan


def _rows(person: PersonSignals) -> Iterator[List[object]]:
    """Yield a row for each gesture, or one without a gesture."""
    posture, walk, fall = person.posture, person.walk, person.fall
    head = [person.id, *_short(person.place), posture.name, _nanoseconds(posture.since), *_short([posture.confidence]),
            *_facing(person.body), *_facing(person.head), '' if walk is None else str(walk.moving).lower(),
            *_short([np.nan if walk is None else walk.speed]), str(fall is not None).lower(),
            _nanoseconds(np.nan if fall is None else fall.stamp)]
    for gesture in person.gestures or (None,):
        yield [*head, *_gesture(gesture)]


def _gesture(gesture: Optional[Gesture]) -> List[object]:
    if gesture is None:
        return ['', '', '', *_short(np.full(8, np.nan)), '', *_short(_NOWHERE)]
    ray = gesture.pointing
    hit = None if ray is None else ray.hit
    way = np.full(7, np.nan) if ray is None else np.array([*ray.origin, *ray.direction, ray.sigma])
    return [gesture.name, gesture.arm, _nanoseconds(gesture.since), *_short([gesture.confidence, *way]),
            quoted(hit.name) if hit else '', *_short(_NOWHERE if hit is None else hit.position)]


def _facing(facing: Optional[Facing]) -> List[float]:
    return _short(np.full(4, np.nan) if facing is None else [*facing.direction, facing.sigma])


def _short(values: Union[Sequence[float], np.ndarray]) -> List[float]:
    return [round(float(value), 4) for value in values]


def _nanoseconds(stamp: float) -> object:
    """Return a stamp [s] in ns; empty where it is NaN."""
    return '' if np.isnan(stamp) else round(stamp * 1e9)

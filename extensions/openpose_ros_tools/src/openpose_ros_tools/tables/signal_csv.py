"""Signals as CSV: one row per frame, person and gesture. See docs/recordings.md."""
import csv
from typing import Iterator, List, Optional, Sequence, TextIO, Union

import numpy as np

from openpose_ros_signals.records import Facing, Gesture, PersonSignals, Pointing, Ray

_RAY = ('origin_x', 'origin_y', 'origin_z', 'direction_x', 'direction_y', 'direction_z', 'sigma')
SIGNAL_COLUMNS = (
    'time', 'frame', 'frame_id', 'person_ID', 'x', 'y', 'z', 'posture', 'posture_since', 'posture_confidence',
    'body_x', 'body_y', 'body_z', 'body_sigma', 'head_x', 'head_y', 'head_z', 'head_sigma', 'moving', 'speed',
    'fallen', 'fall_stamp', 'gesture', 'arm', 'since', 'confidence', *_RAY, 'target', 'hit_x', 'hit_y', 'hit_z',
    'target_probability', *(f'{ray}_{name}' for ray in ('eye', 'arm') for name in _RAY))
_NOWHERE = (np.nan, np.nan, np.nan)


class SignalCsvWriter:
    """Writes signals in the order of the recording, the names of the columns at once."""

    part, dimensions = 'signals', 3

    def __init__(self, handle: TextIO) -> None:
        self._rows = csv.writer(handle, lineterminator='\n')
        self._rows.writerow(SIGNAL_COLUMNS)
        self._frame, self._time = -1, -1

    def write(self, time: int, frame_id: str, persons: Sequence[PersonSignals]) -> int:
        """Add the people of a frame at a time [ns]; return how many rows that are."""
        self._frame, self._time = self._frame + (time != self._time), time
        rows = [[time, self._frame, frame_id, *row] for person in persons for row in _rows(person)]
        self._rows.writerows(rows)
        return len(rows)


def _rows(person: PersonSignals) -> Iterator[List[object]]:
    """Yield a row for each gesture, or one without a gesture."""
    posture, walk, fall = person.posture, person.walk, person.fall
    head = [person.id, *_short(person.place), posture.name, _nanoseconds(posture.since), *_short([posture.confidence]),
            *_facing(person.body), *_facing(person.head), '' if walk is None else str(walk.moving).lower(),
            *_short([np.nan if walk is None else walk.speed]), str(fall is not None).lower(),
            '' if fall is None else _nanoseconds(fall.stamp)]
    for gesture in person.gestures:
        yield [*head, *_gesture(gesture)]
    if not person.gestures:
        yield [*head, '', '', '', np.nan, *_pointing(None)]


def _gesture(gesture: Gesture) -> List[object]:
    return [gesture.name, gesture.arm, _nanoseconds(gesture.since), *_short([gesture.confidence]),
            *_pointing(gesture.pointing)]


def _pointing(ray: Optional[Pointing]) -> List[object]:
    if ray is None:
        return [*_ray(None), '', *_NOWHERE, np.nan, *_ray(None), *_ray(None)]
    return [*_ray(ray), ray.hit.name if ray.hit else '', *_short(ray.hit.position if ray.hit else _NOWHERE),
            *_short([ray.targets[0].probability if ray.targets else np.nan]), *_ray(ray.eye_ray), *_ray(ray.arm_ray)]


def _ray(ray: Optional[Ray]) -> List[float]:
    return _short(np.full(7, np.nan) if ray is None else [*ray.origin, *ray.direction, ray.sigma])


def _facing(facing: Optional[Facing]) -> List[float]:
    return _short(np.full(4, np.nan) if facing is None else [*facing.direction, facing.sigma])


def _short(values: Union[Sequence[float], np.ndarray]) -> List[float]:
    return [round(float(value), 4) for value in values]


def _nanoseconds(stamp: float) -> object:
    """Return a stamp [s] in ns; empty where it is NaN."""
    return '' if np.isnan(stamp) else round(stamp * 1e9)

"""Signals of a recording as spans of time: postures, gestures, walking, and falls."""
from dataclasses import dataclass, replace
from typing import Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.constants import SIGNALS
from openpose_ros_signals.reader import SignalReader
from openpose_ros_signals.records import Fall, PersonSignals
from openpose_ros_tools.tables.keypoint_selection import upwards_of
from openpose_ros_tools.tables.keypoint_table import KeypointTable, people_of_rows

POSTURE, GESTURE, WALKING = 'posture', 'gesture', 'walking'


@dataclass(frozen=True)
class Span:
    """A time in which one thing held of one person, without a gap."""

    person: int  # id
    kind: str  # `POSTURE`, `GESTURE` or `WALKING`
    name: str  # of the posture, which may be unknown, or of the gesture; '' of walking
    arm: str  # of gestures
    begin: float  # [s], the stamp of its first frame; of gestures when it began, which is a little earlier
    end: float  # [s], the stamp of the first frame in which it did not hold, or of the person's last one


class SignalFrame(NamedTuple):
    """What the people of a frame do."""

    stamp: float  # [s]
    persons: Tuple[PersonSignals, ...]


def timeline_of(frames: Iterable[SignalFrame]) -> Tuple[List[Span], List[Tuple[int, Fall]]]:
    """Return the spans of frames in the order of time, and each fall with the id of its person.

    After a gap without a person, spans begin anew.
    """
    spans: List[Span] = []
    held: Dict[int, Dict[Tuple[str, str, str], int]] = {}  # by person, the numbers of the spans that may go on
    latest: Dict[int, float] = {}
    falls: Dict[Tuple[int, int], Tuple[int, Fall]] = {}
    for stamp, persons in frames:
        for person in persons:
            pause = stamp - latest.get(person.id, -np.inf)
            before = held.get(person.id, {}) if 0 <= pause <= SIGNALS.person.gap else {}
            for number in before.values():
                spans[number] = replace(spans[number], end=stamp)
            latest[person.id], held[person.id] = stamp, {}
            for span in _spans_of(person, stamp):
                key = span.kind, span.name, span.arm
                if key not in before:
                    spans.append(span)
                held[person.id][key] = before.get(key, len(spans) - 1)
            if person.fall is not None:
                falls[person.id, round(1e3 * person.fall.stamp)] = (person.id, person.fall)
    return spans, list(falls.values())


def _spans_of(person: PersonSignals, stamp: float) -> Iterator[Span]:
    yield Span(person.id, POSTURE, person.posture.name, '', stamp, stamp)
    if person.walk is not None and person.walk.moving:
        yield Span(person.id, WALKING, '', '', stamp, stamp)
    for gesture in person.gestures:
        begin = stamp if np.isnan(gesture.since) else min(gesture.since, stamp)
        yield Span(person.id, GESTURE, gesture.name, gesture.arm, begin, stamp)


def computed_signals(table: KeypointTable, up: Optional[Sequence[float]] = None) -> Iterator[SignalFrame]:
    """Yield the signals of each frame, computed from the joints in space; `up` as in `upwards_of`."""
    reader, upwards = SignalReader(), upwards_of(table, up)
    order = np.argsort(table.stamps, kind='stable')
    stamps, starts = np.unique(table.stamps[order], return_index=True)
    for stamp, rows in zip(stamps.tolist(), np.split(order, starts[1:])):
        people = people_of_rows(table.select(rows), COCO_18)
        yield SignalFrame(stamp * 1e-9, reader.update(people, stamp * 1e-9, upwards))

"""Signals of a recording as spans of time: postures, gestures, walking, and falls."""
from dataclasses import dataclass, replace
from typing import Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.constants import SIGNALS
from openpose_ros_signals.reader import SignalReader
from openpose_ros_signals.records import Fall, Gesture, PersonSignals, Pointing
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
    confidence: float = 0.0  # the greatest one; 0 of walking
    pointing: Optional[Pointing] = None  # the ray where the confidence was greatest, of pointing


class SignalFrame(NamedTuple):
    """What the people of a frame do."""

    stamp: float  # [s]
    persons: Tuple[PersonSignals, ...]


class PersonFall(NamedTuple):
    """A fall of a person."""

    person: int
    fall: Fall


class SignalTimeline:
    """Spans in the order of their begin, and falls, of frames that are added in the order of time.

    Its size grows with the number of spans, not of frames.

    Args:
        gap: after a longer time without a person, its spans begin anew [s].
    """

    def __init__(self, gap: float = SIGNALS.person.gap) -> None:
        self._gap = gap
        self.spans: List[Span] = []
        self._held: Dict[int, List[int]] = {}  # by person, numbers of the spans that may go on
        self._seen: Dict[int, float] = {}
        self._falls: Dict[Tuple[int, int], PersonFall] = {}

    @property
    def falls(self) -> List[PersonFall]:
        """Return each fall once."""
        return list(self._falls.values())

    def of(self, kind: str, person: Optional[int] = None) -> List[Span]:
        """Return the spans of a kind, of one person or of all."""
        return [span for span in self.spans if span.kind == kind and person in (None, span.person)]

    def add(self, stamp: float, persons: Tuple[PersonSignals, ...]) -> None:
        """Add a frame; stamp [s]."""
        for person in persons:
            follows = 0 <= stamp - self._seen.get(person.id, -np.inf) <= self._gap
            before = self._held.get(person.id, []) if follows else []
            for number in before:
                self.spans[number] = replace(self.spans[number], end=stamp)
            self._seen[person.id] = stamp
            self._held[person.id] = [self._continued(before, span) for span in _spans_of(person, stamp)]
            if person.fall is not None:
                self._falls[person.id, round(1e3 * person.fall.stamp)] = PersonFall(person.id, person.fall)

    def _continued(self, before: List[int], new: Span) -> int:
        """Return the number of the span that goes on, or of the new one."""
        for number in before:
            old = self.spans[number]
            if (old.kind, old.name, old.arm) == (new.kind, new.name, new.arm):
                if new.confidence > old.confidence:
                    self.spans[number] = replace(old, confidence=new.confidence, pointing=new.pointing or old.pointing)
                return number
        self.spans.append(new)
        return len(self.spans) - 1


def _spans_of(person: PersonSignals, stamp: float) -> Iterator[Span]:
    yield Span(person.id, POSTURE, person.posture.name, '', stamp, stamp, person.posture.confidence)
    if person.walk is not None and person.walk.moving:
        yield Span(person.id, WALKING, '', '', stamp, stamp)
    for gesture in person.gestures:
        yield Span(person.id, GESTURE, gesture.name, gesture.arm, _begin(gesture, stamp), stamp, gesture.confidence,
                   gesture.pointing)


def _begin(gesture: Gesture, stamp: float) -> float:
    return stamp if np.isnan(gesture.since) else min(gesture.since, stamp)


def timeline_of(frames: Iterable[SignalFrame]) -> SignalTimeline:
    """Return the spans and falls of frames in the order of time."""
    timeline = SignalTimeline()
    for frame in frames:
        timeline.add(*frame)
    return timeline


def computed_signals(table: KeypointTable, up: Optional[Sequence[float]] = None) -> Iterator[SignalFrame]:
    """Yield the signals of each frame, computed from the joints, for recordings without them.

    Args:
        table: in space.
        up: (3,) upwards, any length; None: the axis along which people are most of the time, of a level frame.
    """
    reader, upwards = SignalReader(), upwards_of(table, up)
    order = np.argsort(table.stamps, kind='stable')
    stamps, starts = np.unique(table.stamps[order], return_index=True)
    for stamp, rows in zip(stamps.tolist(), np.split(order, starts[1:])):
        people = people_of_rows(table.select(rows), COCO_18)
        yield SignalFrame(stamp * 1e-9, reader.update(people, stamp * 1e-9, upwards))



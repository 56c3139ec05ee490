"""Whether a part of a person is inside a zone: volumes of a file, in any frame.

Parts are capsules, whose ends have errors (`capsules.py`). A capsule reaches into a zone with the probability that the
error along the line to it is greater than its distance. Of one person the most probable part counts, as errors of the
joints of a body depend on each other. A person enters and leaves by two probabilities, and between them stays as it
was.
"""
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.people import distinct_ids
from openpose_ros_pkg.structured_text import file_values
from openpose_ros_signals.capsules import PARTS, Capsules, known_parts, reaches_of, tail
from openpose_ros_signals.constants import SIGNALS
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.transform import Transform

UNKNOWN, EMPTY, OCCUPIED = 0, 1, 2
"""States of a zone, as in openpose_ros_msgs/ZoneState."""
# Points along a capsule whose distances are told: of a thigh, 5 cm apart.
_SHARES = np.linspace(0.0, 1.0, 9)
_SHAPES = {'box': 'two corners [[x, y, z], [x, y, z]] that differ in x, y and z',
           'polygon': 'three or more corners [[x, y], ...] around an area, none twice running, with z',
           'z': 'lowest and highest [z, z], with polygon'}
_KEYS = 'name, frame_id, and box or polygon and z'


@dataclass(frozen=True)
class ZoneConstants:
    """When a person is inside a zone."""

    entered: float = constant(0.7, 'A person enters with this probability.', source='chosen; trials.md, zones')
    left: float = constant(0.3, 'And leaves with this one.', source='chosen: as far from one half')
    gap: float = constant(SIGNALS.person.gap, 'After a longer time without people all begins anew.', unit='s')


class Zone(NamedTuple):
    """A prism that stands still in a frame, its axis along z."""

    name: str
    frame_id: str
    polygon: np.ndarray  # (N, 2) x, y of its corners, one after the other [m]
    heights: np.ndarray  # (2,) lowest and highest z [m]


class ZoneState(NamedTuple):
    """What is known of a zone at one time."""

    name: str
    state: int  # `UNKNOWN`: its frame is not known, or it may be that a person is inside
    since: float  # of the first frame with this state [s]
    probability: float  # of the part that is inside most probably; 0: no part is known, NaN: the frame is not
    person: int  # id of this part's person; 0: none
    part: str  # one of `PARTS`; empty: none
    inside: Tuple[int, ...]  # ids of the people who are inside


class ZoneWatch:
    """Tells who is inside zones from frame to frame, with no clock but the stamps."""

    def __init__(self, zones: Sequence[Zone], constants: ZoneConstants = ZoneConstants()) -> None:
        self._zones, self._constants, self._stamp = zones, constants, -math.inf
        self._inside: Dict[str, Dict[int, Optional[bool]]] = {}  # by zone and id; None: not known
        self._before: Dict[str, ZoneState] = {}

    def update(self, people: People3D, stamp: float, poses: Sequence[Optional[Transform]]) -> Tuple[ZoneState, ...]:
        """Return the states of all zones; after a gap, and when the stamp [s] jumps back, all begins anew.

        `poses` take points of each zone's frame to that of the people; None: not known.
        """
        if not 0 <= stamp - self._stamp <= self._constants.gap:
            self._inside, self._before = {}, {}
        self._stamp = stamp
        if self._zones:
            known, hidden, ids = known_parts(people), reaches_of(people), distinct_ids(people.ids).tolist()
            found = [self._state(zone, pose, known, hidden, ids) for zone, pose in zip(self._zones, poses)]
            self._before = {state.name: state for state in found}
        return tuple(self._before.values())

    def _state(self, zone: Zone, pose: Optional[Transform], known: Capsules, hidden: Capsules, ids: Sequence[int]
               ) -> ZoneState:
        if pose is None:
            self._inside.pop(zone.name, None)
            return self._lasting(ZoneState(zone.name, UNKNOWN, self._stamp, math.nan, 0, '', ()))
        chances = probabilities(zone, known, pose)
        near = set(hidden.persons[(_gaps(zone, hidden, pose) < 0).any(axis=1)].tolist())
        near |= set(ids) - set(known.persons.tolist()) - set(hidden.persons.tolist())  # may be anywhere
        before = self._inside.get(zone.name, {})
        inside = {name: self._is_inside(chances[known.persons == name].max(initial=0.0), name in near, before.get(name))
                  for name in ids}
        self._inside[zone.name] = inside
        states = set(inside.values())
        state = OCCUPIED if True in states else UNKNOWN if None in states else EMPTY
        found = ZoneState(zone.name, state, self._stamp, 0.0, 0, '', tuple(name for name in ids if inside[name]))
        if len(chances):
            most = int(chances.argmax())
            found = found._replace(probability=float(chances[most]), person=int(known.persons[most]),
                                   part=PARTS[known.parts[most]])
        return self._lasting(found)

    def _is_inside(self, chance: float, may_be: bool, before: Optional[bool]) -> Optional[bool]:
        if chance >= self._constants.entered:
            return True
        if chance > self._constants.left and (before or not may_be):
            return before
        return None if may_be else False

    def _lasting(self, state: ZoneState) -> ZoneState:
        before = self._before.get(state.name, state)
        return state if before.state != state.state else state._replace(since=before.since)


def probabilities(zone: Zone, capsules: Capsules, pose: Transform) -> np.ndarray:
    """Return with which probability each capsule reaches into a zone, (N,); `pose` as in `ZoneWatch.update`."""
    sigma = capsules.known_sigma @ np.array([1 - _SHARES, _SHARES])
    return np.asarray(tail(_gaps(zone, capsules, pose) / np.maximum(sigma / math.sqrt(3), 1e-9)).max(axis=1))


def _gaps(zone: Zone, capsules: Capsules, pose: Transform) -> np.ndarray:
    """Return how far the surfaces of capsules are outside a zone at points along them, (N, S) [m]; < 0: inside."""
    begins, ends = capsules.ends[:, :1], capsules.ends[:, 1:]
    points = begins + _SHARES[:, np.newaxis] * (ends - begins)
    rotation, translation = pose
    return distances_to(zone, (points - translation) @ rotation) - capsules.radii[:, np.newaxis]


def distances_to(zone: Zone, points: np.ndarray) -> np.ndarray:
    """Return how far points (..., 3) in its frame are from a zone, (...) [m]; inside, how far from its surface, < 0."""
    begins, along = zone.polygon, np.roll(zone.polygon, -1, axis=0) - zone.polygon
    offsets = points[..., np.newaxis, :2] - begins  # (..., N, 2)
    shares = np.clip((offsets * along).sum(axis=-1) / (along ** 2).sum(axis=-1), 0.0, 1.0)
    away = np.linalg.norm(offsets - shares[..., np.newaxis] * along, axis=-1).min(axis=-1)
    # edges to the right of a point
    crosses = (offsets[..., 1] >= 0) != (offsets[..., 1] >= along[:, 1])
    with np.errstate(divide='ignore', invalid='ignore'):
        crosses &= offsets[..., 0] < offsets[..., 1] / along[:, 1] * along[:, 0]
    sideways = np.where(crosses.sum(axis=-1) % 2 == 1, -away, away)
    upwards = np.maximum(zone.heights[0] - points[..., 2], points[..., 2] - zone.heights[1])
    outside = np.hypot(np.maximum(sideways, 0.0), np.maximum(upwards, 0.0))
    return np.asarray(outside + np.minimum(np.maximum(sideways, upwards), 0.0))


def read_zones(path: Path) -> Tuple[Zone, ...]:
    """Read a file of zones.

    Raises:
        BadInputError: it can not be read or is none; the text names the file, the key, its value and what is allowed.
    """
    values = file_values(path, f'zones {path}')
    try:
        if not isinstance(values, list):
            raise ValueError(f'{values!r} is not allowed: a list of zones with {_KEYS}')
        zones = tuple(_zone(value) for value in values)
        names = [zone.name for zone in zones]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f'name {name!r} is not allowed: a name of its own for each zone')
    except ValueError as error:
        raise BadInputError(f'zones {path}: {error}') from error
    return zones


def _zone(value: Any) -> Zone:
    shapes = [{'box'}, {'polygon', 'z'}]
    if not isinstance(value, dict) or set(value) - {'name', 'frame_id'} not in shapes:
        raise ValueError(f'{value!r} is not allowed: {_KEYS}')
    for key in ('name', 'frame_id'):
        if not (isinstance(value.get(key), str) and value[key]):
            raise ValueError(f'{key} {value.get(key)!r} is not allowed: a text')
    if 'box' in value:
        low, high = np.sort(_numbers(value, 'box', (2, 3)), axis=0)
        if not (high > low).all():
            raise _wrong(value, 'box')
        polygon = np.array([low[:2], [high[0], low[1]], high[:2], [low[0], high[1]]])
        return Zone(value['name'], frame_name(value['frame_id']), polygon, np.array([low[2], high[2]]))
    polygon, heights = _numbers(value, 'polygon', (-1, 2)), _numbers(value, 'z', (2,))
    x, y = polygon.T
    area = x @ np.roll(y, -1) - y @ np.roll(x, -1)
    repeated = (np.roll(polygon, -1, axis=0) == polygon).all(axis=1).any()
    if len(polygon) < 3 or repeated or not abs(area) > 1e-9:
        raise _wrong(value, 'polygon')
    if not heights[1] > heights[0]:
        raise _wrong(value, 'z')
    return Zone(value['name'], frame_name(value['frame_id']), polygon, heights)


def _numbers(value: Dict[str, Any], key: str, shape: Tuple[int, ...]) -> np.ndarray:
    try:
        numbers = np.array(value[key], np.float64)
    except (TypeError, ValueError):
        raise _wrong(value, key) from None
    if numbers.ndim != len(shape) or not np.isfinite(numbers).all() or any(
            wanted not in (-1, size) for wanted, size in zip(shape, numbers.shape)):
        raise _wrong(value, key)
    return numbers


def _wrong(value: Dict[str, Any], key: str) -> ValueError:
    return ValueError(f'{key} {value[key]!r} of {value["name"]!r} is not allowed: {_SHAPES[key]}')

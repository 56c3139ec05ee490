"""What RViz shall show of the people: spheres at the joints, lines for the limbs, a label with the id."""
import colorsys
import math
from collections import deque
from dataclasses import dataclass, field
from typing import Deque, List, Optional, Set, Tuple

import numpy as np

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params import Parameters, parameter
from skeleton_extract_3d.people import People3D

Rgba = Tuple[float, float, float, float]

# The lifetime covers this many frame periods: a late or lost frame does not make the markers flicker.
_LIFETIME_PERIODS = 3
# Frame periods that the median is taken of.
_PERIODS = 15
# A label stands this far [m] beyond the head.
_LABEL_DISTANCE = 0.3
_HEAD = ('nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear', 'head_top')
# Turning the hue by the golden ratio keeps the colours of successive ids apart, however many there are.
_HUE_STEP = (math.sqrt(5) - 1) / 2


@dataclass(frozen=True)
class MarkerParams(Parameters):
    """How people look in RViz."""

    joint_scale: float = parameter(0.05, "Diameter of the joints' spheres.", unit='m', minimum=0.001, maximum=1.0)
    skeleton_scale: float = parameter(0.03, 'Width of the limbs.', unit='m', minimum=0.001, maximum=1.0)
    joint_colour: str = parameter('1 0 0 1', 'Colour of the joints: red, green, blue, opacity, each 0 .. 1.')
    skeleton_colour: str = parameter('0 0 1 1', 'Colour of the limbs: red, green, blue, opacity, each 0 .. 1.')
    colour_by_person: bool = parameter(False, 'Give each person one colour of its own, by id, in place of the two.')
    label: bool = parameter(False, "Write each person's id above the head.")
    label_scale: float = parameter(0.15, 'Height of the letters.', unit='m', minimum=0.001, maximum=2.0)
    lifetime: float = parameter(
        0.15, 'Markers vanish when nothing new came for this long; at a low frame rate it grows to three frame '
              'periods, so that they do not flicker.', unit='s', minimum=0.01, maximum=60.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in ('joint_colour', 'skeleton_colour'):
            _rgba(key, getattr(self, key))


@dataclass(frozen=True)
class MarkerSpec:
    """One marker, in the terms of visualization_msgs/Marker; pose is the identity (orientation w = 1).

    Attributes:
        ns, id: identify the marker in RViz; id is the person's.
        action: 'add' or 'delete'; of a delete only ns and id count.
        kind: 'sphere_list', 'line_list' or 'text'.
        points: (N, 3) float32 [m], all finite; two per line; one, the position, for a text.
        scale: diameter, width or height of the letters [m].
        rgba: each 0 .. 1.
        text: of a text.
        lifetime: [s].
    """

    ns: str
    id: int
    action: str = 'delete'
    kind: str = 'sphere_list'
    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.float32))
    scale: float = 0.0
    rgba: Rgba = (0.0, 0.0, 0.0, 0.0)
    text: str = ''
    lifetime: float = 0.0


class MarkerTracker:
    """Makes the markers of each frame and removes those of people who left."""

    def __init__(self, params: MarkerParams) -> None:
        self._params = params
        self._lifetime = MarkerLifetime(params.lifetime)
        self._shown: Set[Tuple[str, int]] = set()

    def update(self, people: People3D, stamp: float) -> List[MarkerSpec]:
        """Return what to publish for a frame: first the deletes of what is no more, then the adds.

        Args:
            stamp: of the frame [s].
        """
        added = people_markers(people, self._params, self._lifetime.update(stamp))
        shown = {(marker.ns, marker.id) for marker in added}
        deleted = [MarkerSpec(ns, person) for ns, person in sorted(self._shown - shown)]
        self._shown = shown
        return deleted + added


class MarkerLifetime:
    """Stretches the lifetime of markers to the frame rate.

    Args:
        minimum: [s].
    """

    def __init__(self, minimum: float) -> None:
        self._minimum = minimum
        self._last: Optional[float] = None
        self._periods: Deque[float] = deque(maxlen=_PERIODS)

    def update(self, stamp: float) -> float:
        """Return the lifetime [s] for the frame with this stamp [s]: three median periods, at least the minimum."""
        if self._last is not None and stamp > self._last:
            self._periods.append(stamp - self._last)
        self._last = stamp
        typical = float(np.median(self._periods)) if self._periods else 0.0
        return max(self._minimum, _LIFETIME_PERIODS * typical)


def people_markers(people: People3D, params: MarkerParams, lifetime: float) -> List[MarkerSpec]:
    """Return the markers of the people: ns 'joints', 'skeleton' and, if asked for, 'label'; none without points."""
    markers = []
    for xyz, person in zip(people.xyz, people.ids.tolist()):
        joints = _finite(xyz)
        if not len(joints):
            continue
        own = _person_colour(person)
        joint_rgba = own if params.colour_by_person else _rgba('joint_colour', params.joint_colour)
        limb_rgba = own if params.colour_by_person else _rgba('skeleton_colour', params.skeleton_colour)
        markers.append(MarkerSpec('joints', person, 'add', 'sphere_list', joints, params.joint_scale, joint_rgba,
                                  lifetime=lifetime))
        limbs = _limb_points(people, xyz)
        if len(limbs):
            markers.append(MarkerSpec('skeleton', person, 'add', 'line_list', limbs, params.skeleton_scale, limb_rgba,
                                      lifetime=lifetime))
        if params.label:
            markers.append(MarkerSpec('label', person, 'add', 'text', _label_position(people, xyz)[None],
                                      params.label_scale, own if params.colour_by_person else (1.0, 1.0, 1.0, 1.0),
                                      str(person), lifetime))
    return markers


def _finite(xyz: np.ndarray) -> np.ndarray:
    return xyz[np.isfinite(xyz).all(axis=1)]


def _limb_points(people: People3D, xyz: np.ndarray) -> np.ndarray:
    """Return start, end, start, end, ... of the limbs that have both ends, (2 * L, 3)."""
    index = people.skeleton.index
    ends = xyz[[[index[start], index[end]] for start, end in people.skeleton.drawn_limbs]]
    return ends[np.isfinite(ends).all(axis=(1, 2))].reshape(-1, 3)


def _label_position(people: People3D, xyz: np.ndarray) -> np.ndarray:
    """Return a place beyond the head, as seen from the trunk: true in any frame, whichever axis points up."""
    head = _middle(people, xyz, _HEAD)
    neck = _middle(people, xyz, ('neck', 'right_shoulder', 'left_shoulder'))
    hips = _middle(people, xyz, ('right_hip', 'left_hip', 'mid_hip'))
    tops = [place for place in (head, neck) if place is not None]
    if not tops:
        return _finite(xyz).mean(axis=0)
    up = neck - hips if neck is not None and hips is not None else None
    length = 0.0 if up is None else float(np.linalg.norm(up))
    return (tops[0] + up / length * _LABEL_DISTANCE if length > 0 else tops[0]).astype(np.float32)


def _middle(people: People3D, xyz: np.ndarray, joints: Tuple[str, ...]) -> Optional[np.ndarray]:
    """Return the mean of those of the joints that exist and are finite, or None."""
    index = people.skeleton.index
    found = _finite(xyz[[index[joint] for joint in joints if joint in index]])
    return found.mean(axis=0) if len(found) else None


def _person_colour(person: int) -> Rgba:
    red, green, blue = colorsys.hsv_to_rgb(person * _HUE_STEP % 1.0, 1.0, 1.0)
    return red, green, blue, 1.0


def _rgba(key: str, text: str) -> Rgba:
    """Return the colour of a parameter's text.

    Raises:
        ParameterError: not four numbers of 0 .. 1.
    """
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != 4 or not all(0 <= value <= 1 for value in values):
        raise ParameterError(f"parameter '{key}' = {text!r} is not allowed: four numbers in 0 .. 1, as '1 0 0 1'")
    return values[0], values[1], values[2], values[3]

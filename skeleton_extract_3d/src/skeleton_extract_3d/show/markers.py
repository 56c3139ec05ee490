"""What RViz shall show of the people: spheres at the joints, lines for the limbs, who it is, how sure that is and the
way that they came."""
import colorsys
import math
from collections import deque
from dataclasses import dataclass, field, fields
from typing import Deque, Dict, List, Optional, Set, Tuple

import numpy as np

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.parameters import Parameters, parameter
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

Rgba = Tuple[float, float, float, float]

# Namespaces of the markers that show limbs; those of all others show joints or people.
LIMB_NAMESPACES = ('skeleton', 'skeleton_inferred')

# The lifetime covers this many frame periods: a late or lost frame does not make the markers flicker.
_LIFETIME_PERIODS = 3
# Frame periods that the median is taken of.
_PERIODS = 15
# A label stands this far [m] beyond the head.
_LABEL_DISTANCE = 0.3
_HEAD = ('nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear', 'head_top')
_SHOULDERS = ('neck', 'right_shoulder', 'left_shoulder')
_HIPS = ('right_hip', 'left_hip', 'mid_hip')
# A marker of spheres has one size, so the spheres of sigma come in sizes: the smallest radius [m], and each larger by
# the square root of 2, up to 1.8 m. A sphere is at most 19 % larger or smaller than it should be.
_SIGMA_RADIUS, _SIGMA_SIZES = 0.01, 16
# So many dashes at most, however far apart the ends are.
_MAX_DASHES = 100
# Points of a trail are at least this far [m] apart, so that whoever stands still leaves no tangle.
_TRAIL_STEP = 0.02
# Turning the hue by the golden ratio keeps the colours of successive ids apart, however many there are.
_HUE_STEP = (math.sqrt(5) - 1) / 2


@dataclass(frozen=True)
class MarkerParams(Parameters):
    """How people look in RViz."""

    joint_scale: float = parameter(0.05, "Diameter of the joints' spheres.", unit='m', minimum=0.001, maximum=1.0)
    skeleton_scale: float = parameter(0.03, 'Width of the limbs.', unit='m', minimum=0.001, maximum=1.0)
    joint_colour: str = parameter('1 0 0 1', 'Colour of the joints: red, green, blue, opacity, each 0 .. 1.')
    skeleton_colour: str = parameter('0 0 1 1', 'Colour of the limbs: red, green, blue, opacity, each 0 .. 1.')
    joint_inferred_colour: str = parameter(
        '1 0.6 0.6 0.6', 'Colour of the joints that are INFERRED: red, green, blue, opacity, each 0 .. 1.')
    skeleton_inferred_colour: str = parameter(
        '0.6 0.6 1 0.6', 'Colour of the limbs with an INFERRED end: red, green, blue, opacity, each 0 .. 1.')
    dash_length: float = parameter(
        0.05, 'Limbs with an INFERRED end are dashed: length of dashes and gaps, fitted to the limb. 0: solid; so are '
              'limbs shorter than two dashes.', unit='m', minimum=0.0, maximum=1.0)
    colour_by_person: bool = parameter(
        False, 'Give each person one colour of its own, by id, paler where it is INFERRED. Of the colours above and of '
               'sigma_colour only the opacity counts then.')
    label: bool = parameter(
        False, "Write each person's id above the head, with '(hidden)' when no joint is MEASURED.")
    label_scale: float = parameter(0.15, 'Height of the letters.', unit='m', minimum=0.001, maximum=2.0)
    sigma_spheres: bool = parameter(
        False, 'Show how sure each position is: a sphere with radius sigma, rounded to 10, 14, 20, 28, ... mm, around '
               'each joint that has one.')
    sigma_colour: str = parameter(
        '1 1 0 0.25', 'Colour of the spheres of sigma: red, green, blue, opacity, each 0 .. 1.')
    trail_seconds: float = parameter(
        0.0, "Show the way that each person came in so much time, in the person's own colour: that of the middle "
             'between the hips, or without hips between the shoulders. 0: off.', unit='s', minimum=0.0, maximum=60.0)
    trail_scale: float = parameter(0.02, 'Width of the trails.', unit='m', minimum=0.001, maximum=1.0)
    lifetime: float = parameter(
        0.15, 'Markers vanish when nothing new came for this long; at a low frame rate it grows to three frame '
              'periods, so that they do not flicker.', unit='s', minimum=0.01, maximum=60.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        for declared in fields(self):
            if declared.name.endswith('_colour'):
                _rgba(declared.name, getattr(self, declared.name))


@dataclass(frozen=True)
class MarkerSpec:
    """One marker, in the terms of visualization_msgs/Marker; pose is the identity (orientation w = 1).

    Attributes:
        ns, id: identify the marker in RViz; id is the person's; in ns 'sigma' it is 16 times that plus the number of
            the size.
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
        self._lifetime = MarkerLifetime()
        self._trails = Trails()
        self._shown: Set[Tuple[str, int]] = set()

    def reconfigure(self, params: MarkerParams) -> None:
        """Take other parameters from the next frame on."""
        self._params = params

    def update(self, people: People3D, stamp: float, frame_id: str = '') -> List[MarkerSpec]:
        """Return what to publish for a frame: first the deletes of what is no more, then the adds.

        Args:
            stamp: of the frame [s].
            frame_id: of the positions.
        """
        params = self._params
        lifetime = self._lifetime.update(stamp, params.lifetime)
        added = people_markers(people, params, lifetime)
        added += trail_markers(self._trails.update(people, stamp, frame_id, params.trail_seconds), params, lifetime)
        shown = {(marker.ns, marker.id) for marker in added}
        deleted = [MarkerSpec(ns, number) for ns, number in sorted(self._shown - shown)]
        self._shown = shown
        return deleted + added


class MarkerLifetime:
    """Stretches the lifetime of markers to the frame rate."""

    def __init__(self) -> None:
        self._last: Optional[float] = None
        self._periods: Deque[float] = deque(maxlen=_PERIODS)

    def update(self, stamp: float, minimum: float) -> float:
        """Return the lifetime [s] for the frame with this stamp [s]: three median periods, at least the minimum [s]."""
        if self._last is not None and stamp > self._last:
            self._periods.append(stamp - self._last)
        self._last = stamp
        typical = float(np.median(self._periods)) if self._periods else 0.0
        return max(minimum, _LIFETIME_PERIODS * typical)


class Trails:
    """Remembers where people were."""

    def __init__(self) -> None:
        self._paths: Dict[int, Deque[Tuple[float, np.ndarray]]] = {}
        self._last: Optional[Tuple[float, str]] = None

    def update(self, people: People3D, stamp: float, frame_id: str, seconds: float) -> Dict[int, np.ndarray]:
        """Return the way that each person of the frame came.

        Who comes back within `seconds` goes on with the old trail. All trails begin anew when the stamps jump back or
        the positions are in another frame.

        Args:
            stamp: of the frame [s].
            frame_id: of the positions.
            seconds: what is this old is forgotten [s].

        Returns:
            By id: (N, 3) float32 [m], the oldest place first.
        """
        if self._last is not None and (stamp < self._last[0] or frame_id != self._last[1]):
            self._paths.clear()
        self._last = stamp, frame_id
        for path in self._paths.values():
            while path and stamp - path[0][0] >= seconds:
                path.popleft()
        for xyz, person in zip(people.xyz, people.ids.tolist()):
            place = _middle(people, xyz, _HIPS)
            place = _middle(people, xyz, _SHOULDERS) if place is None else place
            if place is not None:
                _go_to(self._paths.setdefault(person, deque()), stamp, place)
        self._paths = {person: path for person, path in self._paths.items() if path}
        return {person: np.array([place for _, place in self._paths[person]])
                for person in people.ids.tolist() if person in self._paths}


def _go_to(path: Deque[Tuple[float, np.ndarray]], stamp: float, place: np.ndarray) -> None:
    """Append a place; the last one goes when it was hardly any way from the one before."""
    if len(path) > 1 and np.linalg.norm(path[-1][1] - path[-2][1]) < _TRAIL_STEP:
        path.pop()
    path.append((stamp, place))


def people_markers(people: People3D, params: MarkerParams, lifetime: float) -> List[MarkerSpec]:
    """Return the markers of the people; none without points.

    They are in ns 'joints' and 'skeleton' what is MEASURED, 'joints_inferred' and 'skeleton_inferred' what is not, and,
    if asked for, 'label' and 'sigma'.
    """
    markers: List[MarkerSpec] = []
    for p in range(len(people)):
        markers += _joint_markers(people, p, params, lifetime)
        markers += _limb_markers(people, p, params, lifetime)
        if params.label:
            markers.append(_label(people, p, params, lifetime))
        if params.sigma_spheres:
            markers += _sigma_markers(people, p, params, lifetime)
    return [marker for marker in markers if len(marker.points)]


def trail_markers(paths: Dict[int, np.ndarray], params: MarkerParams, lifetime: float) -> List[MarkerSpec]:
    """Return a marker in ns 'trail' for each path of at least two places; the paths are those of `Trails`."""
    return [MarkerSpec('trail', person, 'add', 'line_list', np.repeat(path, 2, axis=0)[1:-1], params.trail_scale,
                       (*_person_colour(person), 1.0), lifetime=lifetime)
            for person, path in paths.items() if len(path) > 1]


def _joint_markers(people: People3D, p: int, params: MarkerParams, lifetime: float) -> List[MarkerSpec]:
    person = int(people.ids[p])
    return [MarkerSpec(ns, person, 'add', 'sphere_list', people.xyz[p][people.status[p] == status],
                       params.joint_scale, _colour(params, key, person), lifetime=lifetime)
            for ns, status, key in (('joints', MEASURED, 'joint_colour'),
                                    ('joints_inferred', INFERRED, 'joint_inferred_colour'))]


def _limb_markers(people: People3D, p: int, params: MarkerParams, lifetime: float) -> List[MarkerSpec]:
    person, index = int(people.ids[p]), people.skeleton.index
    limbs = np.array([(index[start], index[end]) for start, end in people.skeleton.drawn_limbs])
    status, ends = people.status[p][limbs], people.xyz[p][limbs]
    measured = (status == MEASURED).all(axis=1)
    inferred = (status != MISSING).all(axis=1) & ~measured
    return [MarkerSpec(ns, person, 'add', 'line_list', points, params.skeleton_scale, _colour(params, key, person),
                       lifetime=lifetime)
            for ns, points, key in (
                ('skeleton', ends[measured].reshape(-1, 3), 'skeleton_colour'),
                ('skeleton_inferred', _dashed(ends[inferred], params.dash_length), 'skeleton_inferred_colour'))]


def _dashed(limbs: np.ndarray, dash: float) -> np.ndarray:
    """Return lines (L, 2, 3) as dashes and gaps of one length, near `dash` [m], that begin and end with a dash.

    Returns:
        (2 * N, 3): start, end, start, end, ... of the dashes.
    """
    if not dash:
        return limbs.reshape(-1, 3)
    pieces = [np.zeros((0, 3))]
    for start, end in limbs.astype(np.float64):
        dashes = 1 + int(min(np.linalg.norm(end - start) / (2 * dash), _MAX_DASHES - 1))
        pieces.append(start + np.linspace(0, 1, 2 * dashes)[:, None] * (end - start))
    return np.concatenate(pieces).astype(np.float32)


def _label(people: People3D, p: int, params: MarkerParams, lifetime: float) -> MarkerSpec:
    person, hidden = int(people.ids[p]), not (people.status[p] == MEASURED).any()
    rgba = (*_person_colour(person), 1.0) if params.colour_by_person else (1.0, 1.0, 1.0, 1.0)
    return MarkerSpec('label', person, 'add', 'text', _label_position(people, people.xyz[p]), params.label_scale, rgba,
                      f'{person} (hidden)' if hidden else str(person), lifetime)


def _sigma_markers(people: People3D, p: int, params: MarkerParams, lifetime: float) -> List[MarkerSpec]:
    """Return one marker of spheres for each size that occurs."""
    known = (people.status[p] != MISSING) & np.isfinite(people.sigma[p])
    xyz, sigma = people.xyz[p][known], people.sigma[p][known]
    steps = np.rint(2 * np.log2(np.maximum(sigma, _SIGMA_RADIUS) / _SIGMA_RADIUS))
    sizes, person = np.minimum(steps, _SIGMA_SIZES - 1).astype(int), int(people.ids[p])
    return [MarkerSpec('sigma', _SIGMA_SIZES * person + size, 'add', 'sphere_list', xyz[sizes == size],
                       2 * _SIGMA_RADIUS * 2 ** (size / 2), _colour(params, 'sigma_colour', person), lifetime=lifetime)
            for size in np.unique(sizes).tolist()]


def _finite(xyz: np.ndarray) -> np.ndarray:
    return xyz[np.isfinite(xyz).all(axis=1)]


def _label_position(people: People3D, xyz: np.ndarray) -> np.ndarray:
    """Return a place beyond the head, as seen from the trunk: true in any frame, whichever axis points up.

    Returns:
        (1, 3) float32 [m]; (0, 3) when no joint is known.
    """
    head, neck, hips = (_middle(people, xyz, joints) for joints in (_HEAD, _SHOULDERS, _HIPS))
    tops = [place for place in (head, neck) if place is not None]
    if not tops:
        known = _finite(xyz)
        return known.mean(axis=0, keepdims=True) if len(known) else known
    up = neck - hips if neck is not None and hips is not None else None
    length = 0.0 if up is None else float(np.linalg.norm(up))
    place = tops[0] + up / length * _LABEL_DISTANCE if length > 0 else tops[0]
    return place.astype(np.float32)[None]


def _middle(people: People3D, xyz: np.ndarray, joints: Tuple[str, ...]) -> Optional[np.ndarray]:
    """Return the mean of those of the joints that exist and are finite, or None."""
    index = people.skeleton.index
    found = _finite(xyz[[index[joint] for joint in joints if joint in index]])
    return found.mean(axis=0) if len(found) else None


def _colour(params: MarkerParams, key: str, person: int) -> Rgba:
    """Return the colour that a parameter names; with colour_by_person the person's, half white where inferred."""
    red, green, blue, opacity = _rgba(key, getattr(params, key))
    if params.colour_by_person:
        red, green, blue = _person_colour(person)
        if key in ('joint_inferred_colour', 'skeleton_inferred_colour'):
            red, green, blue = (1 + red) / 2, (1 + green) / 2, (1 + blue) / 2
    return red, green, blue, opacity


def _person_colour(person: int) -> Tuple[float, float, float]:
    return colorsys.hsv_to_rgb(person * _HUE_STEP % 1.0, 1.0, 1.0)


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

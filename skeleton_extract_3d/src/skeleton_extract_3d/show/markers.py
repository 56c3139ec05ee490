"""RViz markers of people: spheres at the joints, lines for the limbs, ids, spheres of uncertainty, and trails."""
from collections import deque
from dataclasses import dataclass, field, fields, replace
from typing import Deque, Dict, List, Optional, Set, Tuple

import numpy as np

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.output.draw import person_colour
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import distinct_ids
from openpose_ros_pkg.skeletons import SkeletonModel
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.show.trails import Trails

Rgba = Tuple[float, float, float, float]

# Namespaces of the markers that show limbs; all other namespaces show joints or people.
LIMB_NAMESPACES = ('skeleton', 'skeleton_inferred')

# Share of white in the colour of a person where it is INFERRED, also in pages.
INFERRED_WHITE = 0.5

# The lifetime covers this many frame periods, so that markers do not flicker when a frame is late or lost.
_LIFETIME_PERIODS = 3
# The frame period is the median of this many.
_PERIODS = 15
# Distance of a label from the head [m].
_LABEL_DISTANCE = 0.3
_HEAD = ('nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear', 'head_top')
_SHOULDERS, _HIPS = ('neck', 'right_shoulder', 'left_shoulder'), ('right_hip', 'left_hip', 'mid_hip')
# All spheres of a marker have one size, so the uncertainty spheres of each size are a marker. Smallest radius [m]:
_SIGMA_RADIUS = 0.01
# Number of sizes; each is sqrt(2) times the one before, up to 1.8 m. Rounding changes a radius by at most 19 %.
_SIGMA_SIZES = 16
# A limb has at most this many dashes, however far apart its ends are.
_MAX_DASHES = 100


@dataclass(frozen=True)
class MarkerParams(Parameters):
    """Markers of people in RViz."""

    joint_scale: float = parameter(0.05, "Diameter of the joints' spheres.", unit='m', minimum=0.001, maximum=1.0)
    skeleton_scale: float = parameter(0.03, 'Width of the limbs.', unit='m', minimum=0.001, maximum=1.0)
    joint_colour: str = parameter('1 0 0 1', 'Colour of the joints: red, green, blue, opacity, each 0 .. 1.')
    skeleton_colour: str = parameter('0 0 1 1', 'Colour of the limbs: red, green, blue, opacity, each 0 .. 1.')
    joint_inferred_colour: str = parameter(
        '1 0.6 0.6 0.6', 'Colour of the joints that are INFERRED: red, green, blue, opacity, each 0 .. 1.')
    skeleton_inferred_colour: str = parameter(
        '0.6 0.6 1 0.6', 'Colour of the limbs with an INFERRED end: red, green, blue, opacity, each 0 .. 1.')
    dash_length: float = parameter(
        0.05, 'Limbs with an INFERRED end are dashed: length of dashes and gaps, fitted to the limb. 0: solid, as are '
              'limbs shorter than two dashes.', unit='m', minimum=0.0, maximum=1.0)
    colour_by_person: bool = parameter(
        False, 'Each person has a colour of its own, by id, as in the annotated image; INFERRED parts are paler. Only '
               'the opacity of the colours above and of sigma_colour counts then.')
    label: bool = parameter(
        False, "Write each person's id above the head, with '(hidden)' when no joint is MEASURED.")
    label_scale: float = parameter(0.15, 'Height of the letters.', unit='m', minimum=0.001, maximum=2.0)
    sigma_spheres: bool = parameter(
        False, 'Show the uncertainty of each position: a sphere with radius sigma, rounded to 10, 14, 20, 28, ... mm, '
               'around each joint that has one.')
    sigma_colour: str = parameter(
        '1 1 0 0.25', 'Colour of the uncertainty spheres: red, green, blue, opacity, each 0 .. 1.')
    trail_seconds: float = parameter(
        0.0, "Show each person's path over this time in the person's own colour: the path of the point midway between "
             'the hips or, without hips, the shoulders. 0: off.', unit='s', minimum=0.0, maximum=60.0)
    trail_scale: float = parameter(0.02, 'Width of the trails.', unit='m', minimum=0.001, maximum=1.0)
    hand_scale: float = parameter(0.006, 'Width of the fingers and of the lines of faces.', unit='m', minimum=0.001,
                                  maximum=1.0)
    head_arrow: float = parameter(
        0.25, 'Length of the arrow that shows where a head is directed. 0: none.', unit='m', minimum=0.0, maximum=5.0)
    lifetime: float = parameter(
        0.15, 'Markers vanish when no frame has come for this long. At a low frame rate it grows to three frame '
              'periods, so that they do not flicker.', unit='s', minimum=0.01, maximum=60.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        for declared in fields(self):
            if declared.name.endswith('_colour'):
                _rgba(declared.name, getattr(self, declared.name))


@dataclass(frozen=True)
class MarkerSpec:
    """One marker, in the terms of visualization_msgs/Marker; its pose is the identity.

    Attributes:
        ns, id: identify the marker in RViz; id is the person's, in ns 'sigma' 16 x the person's + index of the size.
        action: 'add' or 'delete'; a delete needs only ns and id.
        kind: 'sphere_list', 'line_list', 'arrow' or 'text'.
        points: (N, 3) float32 [m], all finite; two per line; an arrow has its start and tip, a text its position.
        scale: diameter of spheres, width of lines and of the shaft of arrows, or height of letters [m].
        rgba: each 0 .. 1.
        text: what a text says.
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


class ShownMarkers:
    """Remembers which markers are shown, to delete those that are no more, and the frame period."""

    def __init__(self) -> None:
        self._shown: Set[Tuple[str, int]] = set()
        self._last: Optional[float] = None
        self._periods: Deque[float] = deque(maxlen=_PERIODS)

    def replaced(self, markers: List[MarkerSpec], stamp: float, lifetime: float) -> List[MarkerSpec]:
        """Return what to publish for the frame of a stamp [s]: first the deletes, then the markers with points.

        They last for three median frame periods, at least the lifetime [s].
        """
        if self._last is not None and stamp > self._last:
            self._periods.append(stamp - self._last)
        self._last = stamp
        typical = float(np.median(list(self._periods))) if self._periods else 0.0
        lifetime = max(lifetime, _LIFETIME_PERIODS * typical)
        added = [replace(marker, lifetime=lifetime) for marker in markers if len(marker.points)]
        shown = {(marker.ns, marker.id) for marker in added}
        deleted = [MarkerSpec(ns, number) for ns, number in sorted(self._shown - shown)]
        self._shown = shown
        return deleted + added


class Markers:
    """Base of what makes the markers of each frame, and deletes those that are no more."""

    def __init__(self, params: MarkerParams) -> None:
        self._params, self._shown = params, ShownMarkers()

    def reconfigure(self, params: MarkerParams) -> None:
        """Use other parameters from the next frame on."""
        self._params = params

    def _replaced(self, markers: List[MarkerSpec], stamp: float) -> List[MarkerSpec]:
        return self._shown.replaced(markers, stamp, self._params.lifetime)


class PeopleMarkers(Markers):
    """Makes the markers of people: ns joints, skeleton, both with _inferred; optional: label, sigma, trail."""

    def __init__(self, params: MarkerParams) -> None:
        super().__init__(params)
        self._trails = Trails()

    def update(self, people: People3D, stamp: float, frame_id: str) -> List[MarkerSpec]:
        """Return what to publish for the frame of a stamp [s]: first the deletes, then the adds."""
        people = replace(people, ids=distinct_ids(people.ids))
        markers = [marker for row in range(len(people)) for marker in _PersonMarkers(people, row, self._params).all()]
        paths = self._trails.extended(_places(people), stamp, frame_id, self._params.trail_seconds)
        return self._replaced(markers + _trail_markers(paths, self._params.trail_scale), stamp)


def _places(people: People3D) -> Dict[int, np.ndarray]:
    """Return the middle of the hips, or of the shoulders, of each person with one of them, (3,) [m] by id."""
    middles = {person: (_middle(people.skeleton, xyz, _HIPS), _middle(people.skeleton, xyz, _SHOULDERS))
               for person, xyz in zip(people.ids.tolist(), people.xyz)}
    places = {person: shoulders if hips is None else hips for person, (hips, shoulders) in middles.items()}
    return {person: place for person, place in places.items() if place is not None}


def _trail_markers(paths: Dict[int, np.ndarray], width: float) -> List[MarkerSpec]:
    return [MarkerSpec('trail', person, 'add', 'line_list', np.repeat(path, 2, axis=0)[1:-1], width,
                       (*person_rgb(person), 1.0)) for person, path in paths.items()]


class _PersonMarkers:
    """Makes the markers of the person in a row."""

    def __init__(self, people: People3D, row: int, params: MarkerParams) -> None:
        self._skeleton, self._id, self._params = people.skeleton, int(people.ids[row]), params
        self._xyz, self._status, self._sigma = people.xyz[row], people.status[row], people.sigma[row]

    def all(self) -> List[MarkerSpec]:
        """Return all markers that the parameters ask for; some may have no points."""
        return [*self._joints(), *self._limbs(), *([self._label()] if self._params.label else []),
                *(self._uncertainty() if self._params.sigma_spheres else [])]

    def _joints(self) -> List[MarkerSpec]:
        return [self._marker(ns, 'sphere_list', self._xyz[self._status == status], self._params.joint_scale, colour)
                for ns, status, colour in (('joints', MEASURED, 'joint_colour'),
                                           ('joints_inferred', INFERRED, 'joint_inferred_colour'))]

    def _limbs(self) -> List[MarkerSpec]:
        measured, inferred = limb_lines(self._skeleton, self._xyz, self._status, self._params.dash_length)
        return [self._marker(ns, 'line_list', points, self._params.skeleton_scale, colour)
                for ns, points, colour in (('skeleton', measured, 'skeleton_colour'),
                                           ('skeleton_inferred', inferred, 'skeleton_inferred_colour'))]

    def _label(self) -> MarkerSpec:
        hidden = not (self._status == MEASURED).any()
        rgb = person_rgb(self._id) if self._params.colour_by_person else (1.0, 1.0, 1.0)
        return MarkerSpec('label', self._id, 'add', 'text', self._label_position(), self._params.label_scale,
                          (*rgb, 1.0), f'{self._id} (hidden)' if hidden else str(self._id))

    def _label_position(self) -> np.ndarray:
        """Return a place (1, 3) float32 [m] beyond the head, seen from the trunk, in any frame; (0, 3) if unknown."""
        head, neck, hips = (_middle(self._skeleton, self._xyz, joints) for joints in (_HEAD, _SHOULDERS, _HIPS))
        top = neck if head is None else head
        if top is None:
            known = _finite(self._xyz)
            return known.mean(axis=0, keepdims=True) if len(known) else known
        up = np.zeros(3) if neck is None or hips is None else neck - hips
        length = float(np.linalg.norm(up))
        place = top + up / length * _LABEL_DISTANCE if length > 0 else top
        return place.astype(np.float32)[None]

    def _uncertainty(self) -> List[MarkerSpec]:
        """Return one marker of spheres for each size that occurs."""
        known = (self._status != MISSING) & np.isfinite(self._sigma)
        xyz, sigma = self._xyz[known], self._sigma[known]
        steps = np.rint(2 * np.log2(np.maximum(sigma, _SIGMA_RADIUS) / _SIGMA_RADIUS))
        sizes = np.minimum(steps, _SIGMA_SIZES - 1).astype(int)
        return [replace(self._marker('sigma', 'sphere_list', xyz[sizes == size], 2 * _SIGMA_RADIUS * 2 ** (size / 2),
                                     'sigma_colour'), id=_SIGMA_SIZES * self._id + size)
                for size in np.unique(sizes).tolist()]

    def _marker(self, ns: str, kind: str, points: np.ndarray, scale: float, colour: str) -> MarkerSpec:
        return MarkerSpec(ns, self._id, 'add', kind, points, scale, marker_colour(self._params, colour, self._id))


def marker_colour(params: MarkerParams, name: str, person: int) -> Rgba:
    """Return the colour of a parameter; with colour_by_person that of a person, whiter where INFERRED."""
    red, green, blue, opacity = _rgba(name, getattr(params, name))
    if params.colour_by_person:
        white = INFERRED_WHITE if 'inferred' in name else 0.0
        red, green, blue = (white + (1 - white) * value for value in person_rgb(person))
    return red, green, blue, opacity


def limb_lines(skeleton: SkeletonModel, xyz: np.ndarray, status: np.ndarray, dash: float
               ) -> Tuple[np.ndarray, np.ndarray]:
    """Return the lines of MEASURED limbs, and the dashes of those with an INFERRED end, (2 * N, 3) each [m].

    Args:
        xyz: (K, 3) [m]; status: (K,).
        dash: length of dashes [m].
    """
    limbs = np.array([(skeleton.index[start], skeleton.index[end]) for start, end in skeleton.drawn_limbs])
    measured = (status[limbs] == MEASURED).all(axis=1)
    inferred = (status[limbs] != MISSING).all(axis=1) & ~measured
    return xyz[limbs[measured]].reshape(-1, 3), _dashed(xyz[limbs[inferred]], dash)


def _dashed(limbs: np.ndarray, dash: float) -> np.ndarray:
    """Return lines (L, 2, 3) [m] as starts and ends of dashes, (2 * N, 3), of one length near `dash` [m]."""
    if not dash:
        return limbs.reshape(-1, 3)
    pieces = [np.zeros((0, 3))]
    for start, end in limbs.astype(np.float64):
        dashes = 1 + int(min(float(np.linalg.norm(end - start)) / (2 * dash), _MAX_DASHES - 1))
        pieces.append(start + np.linspace(0, 1, 2 * dashes)[:, None] * (end - start))
    return np.concatenate(pieces).astype(np.float32)


def _finite(xyz: np.ndarray) -> np.ndarray:
    return xyz[np.isfinite(xyz).all(axis=1)]


def _middle(skeleton: SkeletonModel, xyz: np.ndarray, joints: Tuple[str, ...]) -> Optional[np.ndarray]:
    """Return the mean of those of the joints that exist and are finite, or None."""
    found = _finite(xyz[[skeleton.index[joint] for joint in joints if joint in skeleton.index]])
    return found.mean(axis=0) if len(found) else None


def person_rgb(person: int) -> Tuple[float, float, float]:
    """Return the colour that the person's box has in the annotated image."""
    blue, green, red = person_colour(person)
    return red / 255, green / 255, blue / 255


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
        raise ParameterError(f"parameter '{key}' = {text!r} is not allowed: four numbers in 0 .. 1, as '1 0 0 1'", key)
    return values[0], values[1], values[2], values[3]

"""RViz markers of people, hands and faces: spheres at the joints, lines for limbs, ids, directions of heads."""
from collections import deque
from dataclasses import dataclass, field, replace
from typing import Deque, List, Optional, Set, Tuple

import numpy as np
from scipy.spatial.transform import Rotation

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.output.draw import person_colour
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import distinct_ids
from openpose_ros_pkg.skeletons import FACE_70, HAND_21, SkeletonModel
from skeleton_extract_3d.landmarks import Faces3D, Hands3D, Points3D
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

Rgba = Tuple[float, float, float, float]

# Namespaces of the markers that show limbs; all other namespaces show joints or people.
LIMB_NAMESPACES = ('skeleton', 'skeleton_inferred')
# What is INFERRED has this share of white, and of the opacity; also in pages.
INFERRED_WHITE, INFERRED_OPACITY = 0.6, 0.6
# Limbs with an INFERRED end are dashed: length of dashes and gaps, fitted to the limb, of bodies and of landmarks [m].
DASH, _LANDMARK_DASH = 0.05, 0.006
# A limb has at most this many dashes, however far apart its ends are.
_MAX_DASHES = 100
# Width of the fingers and of the lines of faces [m].
LANDMARK_WIDTH = 0.006
# Length of the arrow that shows where a head is directed, and width of its shaft [m].
_HEAD_ARROW, _ARROW_WIDTH = 0.25, 0.015
# Height of the letters, and distance of a label from the head [m].
_LABEL_SCALE, _LABEL_DISTANCE = 0.15, 0.3
# The lifetime covers this many frame periods, so that markers do not flicker when a frame is late or lost.
_LIFETIME_PERIODS = 3
# The frame period is the median of this many.
_PERIODS = 15
_HEAD = ('nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear', 'head_top')
_SHOULDERS, _HIPS = ('neck', 'right_shoulder', 'left_shoulder'), ('right_hip', 'left_hip', 'mid_hip')


@dataclass(frozen=True)
class MarkerParams(Parameters):
    """Markers of people in RViz."""

    retired = ('joint_inferred_colour', 'skeleton_inferred_colour', 'dash_length', 'label_scale', 'sigma_spheres',
               'sigma_colour', 'trail_seconds', 'trail_scale', 'hand_scale', 'head_arrow')

    joint_scale: float = parameter(0.05, "Diameter of the joints' spheres.", unit='m', minimum=0.001, maximum=1.0)
    skeleton_scale: float = parameter(0.03, 'Width of the limbs.', unit='m', minimum=0.001, maximum=1.0)
    joint_colour: str = parameter(
        '1 0 0 1', 'Colour of the joints: red, green, blue, opacity, each 0 .. 1. INFERRED ones are paler.')
    skeleton_colour: str = parameter(
        '0 0 1 1', 'Colour of the limbs: red, green, blue, opacity, each 0 .. 1. Those with an INFERRED end are paler, '
                   'and dashed.')
    colour_by_person: bool = parameter(
        False, 'Each person has a colour of its own, by id, as in the annotated image. Only the opacity of the colours '
               'above counts then.')
    label: bool = parameter(
        False, "Write each person's id above the head, with '(hidden)' when no joint has a keypoint.")
    lifetime: float = parameter(
        0.15, 'Markers vanish when no frame has come for this long. At a low frame rate it grows to three frame '
              'periods, so that they do not flicker.', unit='s', minimum=0.01, maximum=60.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        for kind in ('joint', 'skeleton'):
            self.rgba(kind, 0)

    def rgba(self, kind: str, person: int, inferred: bool = False) -> Rgba:
        """Return the colour of a person's 'joint' or 'skeleton'."""
        key = f'{kind}_colour'
        try:
            *rgb, opacity = (float(word) for word in getattr(self, key).split())
        except ValueError:
            rgb, opacity = [], -1.0
        if len(rgb) != 3 or not all(0 <= value <= 1 for value in (*rgb, opacity)):
            raise ParameterError(f"parameter '{key}' = {getattr(self, key)!r} is not allowed: four numbers in 0 .. 1, "
                                 "as '1 0 0 1'", key)
        red, green, blue = person_rgb(person) if self.colour_by_person else rgb
        if not inferred:
            return red, green, blue, opacity
        white = INFERRED_WHITE
        return (white + (1 - white) * red, white + (1 - white) * green, white + (1 - white) * blue,
                INFERRED_OPACITY * opacity)


@dataclass(frozen=True)
class MarkerSpec:
    """One marker, in the terms of visualization_msgs/Marker; its pose is the identity.

    Attributes:
        ns, id: identify the marker in RViz; id is the person's, of hands 2 x the person's + 1 if left.
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


def people_markers(people: People3D, params: MarkerParams) -> List[MarkerSpec]:
    """Return the markers of people, some without points: joints, skeleton, both with _inferred, and label if wanted."""
    markers = []
    for person, xyz, status, score in zip(distinct_ids(people.ids).tolist(), people.xyz, people.status,
                                          people.confidence):
        solid, dashed = _limb_lines(people.skeleton, xyz, status, DASH)
        markers += [MarkerSpec(ns, person, 'add', 'sphere_list', xyz[status == value], params.joint_scale,
                               params.rgba('joint', person, value == INFERRED))
                    for ns, value in (('joints', MEASURED), ('joints_inferred', INFERRED))]
        markers += [MarkerSpec(ns, person, 'add', 'line_list', lines, params.skeleton_scale,
                               params.rgba('skeleton', person, lines is dashed))
                    for ns, lines in zip(LIMB_NAMESPACES, (solid, dashed))]
        if params.label:
            rgb = person_rgb(person) if params.colour_by_person else (1.0, 1.0, 1.0)
            text = str(person) if score.any() else f'{person} (hidden)'
            markers.append(MarkerSpec('label', person, 'add', 'text', _label_position(people.skeleton, xyz),
                                      _LABEL_SCALE, (*rgb, 1.0), text))
    return markers


def hand_markers(hands: Hands3D, params: MarkerParams) -> List[MarkerSpec]:
    """Return the lines of hands, solid and dashed."""
    owners = zip(hands.people.tolist(), hands.left.astype(int).tolist())
    return [marker for row, (person, left) in enumerate(owners)
            for marker in _landmark_lines('hand', 2 * person + left, (HAND_21, hands.points, row), person, params)]


def face_markers(faces: Faces3D, params: MarkerParams) -> List[MarkerSpec]:
    """Return the lines of faces, solid and dashed, and arrows from their middles, where heads are directed."""
    markers = []
    for row, (person, turn) in enumerate(zip(faces.people.tolist(), faces.orientations)):
        markers += _landmark_lines('face', person, (FACE_70, faces.points, row), person, params)
        known, arrow = faces.points.status[row] != MISSING, np.zeros((0, 3), np.float32)
        # in messages of other nodes an unset orientation is zero
        if known.any() and np.isfinite(turn).all() and turn.any():
            start = faces.points.xyz[row][known].mean(axis=0)
            arrow = np.stack([start, start + Rotation.from_quat(turn).apply((_HEAD_ARROW, 0, 0))]).astype(np.float32)
        markers.append(MarkerSpec('head_direction', person, 'add', 'arrow', arrow, _ARROW_WIDTH,
                                  params.rgba('skeleton', person)))
    return markers


def _landmark_lines(ns: str, number: int, landmarks: Tuple[SkeletonModel, Points3D, int], person: int,
                    params: MarkerParams) -> List[MarkerSpec]:
    skeleton, points, row = landmarks
    solid, dashed = _limb_lines(skeleton, points.xyz[row], points.status[row], _LANDMARK_DASH)
    return [MarkerSpec(ns + kind, number, 'add', 'line_list', places, LANDMARK_WIDTH,
                       params.rgba('skeleton', person, bool(kind)))
            for kind, places in (('', solid), ('_inferred', dashed))]


def _limb_lines(skeleton: SkeletonModel, xyz: np.ndarray, status: np.ndarray, dash: float
                ) -> Tuple[np.ndarray, np.ndarray]:
    """Return the lines of MEASURED limbs, and the dashes [m] of those with an INFERRED end, (2 * N, 3) each [m]."""
    limbs = np.array([(skeleton.index[start], skeleton.index[end]) for start, end in skeleton.drawn_limbs])
    measured = (status[limbs] == MEASURED).all(axis=1)
    inferred = (status[limbs] != MISSING).all(axis=1) & ~measured
    pieces = [np.zeros((0, 3))]
    for start, end in xyz[limbs[inferred]].astype(np.float64):
        dashes = 1 + int(min(float(np.linalg.norm(end - start)) / (2 * dash), _MAX_DASHES - 1))
        pieces.append(start + np.linspace(0, 1, 2 * dashes)[:, None] * (end - start))
    return xyz[limbs[measured]].reshape(-1, 3), np.concatenate(pieces).astype(np.float32)


def _label_position(skeleton: SkeletonModel, xyz: np.ndarray) -> np.ndarray:
    """Return a place (1, 3) float32 [m] beyond the head, seen from the trunk, in any frame; (0, 3) if unknown."""
    finite = np.isfinite(xyz).all(axis=1)

    def middle(joints: Tuple[str, ...]) -> Optional[np.ndarray]:
        rows = [skeleton.index[joint] for joint in joints if joint in skeleton.index and finite[skeleton.index[joint]]]
        return xyz[rows].mean(axis=0) if rows else None

    head, neck, hips = (middle(joints) for joints in (_HEAD, _SHOULDERS, _HIPS))
    top = neck if head is None else head
    if top is None:
        return xyz[finite].mean(axis=0, keepdims=True) if finite.any() else xyz[finite]
    up = np.zeros(3) if neck is None or hips is None else neck - hips
    length = float(np.linalg.norm(up))
    return (top + up / length * _LABEL_DISTANCE if length > 0 else top).astype(np.float32)[None]


def person_rgb(person: int) -> Tuple[float, float, float]:
    """Return the colour that the person's box has in the annotated image."""
    blue, green, red = person_colour(person)
    return red / 255, green / 255, blue / 255

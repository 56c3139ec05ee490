"""RViz markers of signals: what a person does as text, where body and head face, pointing rays."""
from typing import List, Sequence

import numpy as np

from openpose_ros_signals.constants import SIGNALS
from openpose_ros_signals.records import PersonSignals, Ray
from skeleton_extract_3d.show.markers import MarkerSpec, Rgba, ShownMarkers, person_rgb

# Height of the letters, and of the text over the middle of the trunk, upright and lying [m].
_LETTERS, _OVER_UPRIGHT, _OVER_LYING = 0.13, 0.95, 0.6
# Length of the arrow of a body's facing, of a head's, and of a pointing ray that meets nothing [m].
_BODY_FACING, _HEAD_FACING, _POINTING = 0.5, 0.25, 1.5
# Markers vanish when no frame has come for this long, or for three frame periods [s].
_LIFETIME = 0.3
# Lines that show a cone, and each which one of them begins at its tip.
_CONE_LINES, _CONE_EDGES = 24, 6
# Diameter of the shaft of an arrow, at most this share of its length, and of the lines of a cone [m].
_SHAFT, _SHAFT_SHARE, _CONE_WIDTH = 0.03, 0.12, 0.008
_CONE_OPACITY = 0.5
# Share of white in the arrows of facing, which begin inside the skeleton.
_WHITE = 0.6


class SignalMarkers:
    """Makes the markers of each frame, and deletes those that are no more."""

    def __init__(self) -> None:
        self._shown = ShownMarkers()

    def markers(self, persons: Sequence[PersonSignals], stamp: float, up: np.ndarray) -> List[MarkerSpec]:
        """Return what to publish for a frame: first the deletes, then the adds.

        The namespaces are 'signals' (text), 'body_facing', 'head_facing', 'pointing', 'pointing_cone' and
        'pointing_rays' (from eyes and shoulder); the number is the person's, for the right arm's pointing plus one of
        twice the person's.

        Args:
            stamp: [s].
            up: (3,) unit vector.
        """
        return self._shown.replaced([marker for person in persons if np.isfinite(person.place).all()
                                     for marker in _of_person(person, up)], stamp, _LIFETIME)


def _of_person(person: PersonSignals, up: np.ndarray) -> List[MarkerSpec]:
    rgb, text = person_rgb(person.id), text_of(person)
    # RViz puts the middle of the text there: its last line keeps its height
    height = (_OVER_LYING if person.posture.name == 'lying' else _OVER_UPRIGHT) + 0.5 * _LETTERS * text.count('\n')
    markers = [MarkerSpec('signals', person.id, 'add', 'text', _points(person.place + height * up), _LETTERS,
                          (*rgb, 1.0), text)]
    red, green, blue = (_WHITE + (1 - _WHITE) * value for value in rgb)
    for name, facing, length in (('body_facing', person.body, _BODY_FACING),
                                 ('head_facing', person.head, _HEAD_FACING)):
        if facing is not None:
            begin = person.place if facing.begin is None else facing.begin
            markers.append(_arrow(name, person.id, (begin, begin + length * facing.direction),
                                  (red, green, blue, 1.0)))
    for gesture in person.gestures:
        if gesture.pointing is not None:
            ray, number = gesture.pointing, 2 * person.id + (gesture.arm == 'right')
            length = float(np.linalg.norm(ray.hit.position - ray.origin)) if ray.hit else _POINTING
            lines = _points(np.array([(one.origin, one.origin + _POINTING * one.direction)
                                      for one in (ray.eye_ray, ray.arm_ray)]))
            markers += [_arrow('pointing', number, (ray.origin, ray.origin + length * ray.direction), (*rgb, 1.0)),
                        MarkerSpec('pointing_cone', number, 'add', 'line_list', cone_lines(ray, _POINTING),
                                   _CONE_WIDTH, (*rgb, _CONE_OPACITY)),
                        MarkerSpec('pointing_rays', number, 'add', 'line_list', lines, _CONE_WIDTH, (*rgb, 1.0))]
    return markers


def text_of(person: PersonSignals) -> str:
    """Return what a person does, in a few words, one line each."""
    lines = [('fallen, ' if person.fall else '') + person.posture.name
             + (f', {person.walk.speed:.1f} m/s' if person.walk and person.walk.moving else '')]
    for gesture in person.gestures:
        hit = gesture.pointing.hit if gesture.pointing else None
        lines.append(f"{gesture.name.replace('_', ' ')} ({gesture.arm})" + (f' -> {hit.name}' if hit else ''))
    return '\n'.join(lines)


def cone_lines(ray: Ray, length: float, sigmas: float = SIGNALS.pointing.cone) -> np.ndarray:
    """Return the cone round a ray of a length [m] as lines, (N, 3) [m], two points each; half angle: `sigmas` of it."""
    side = np.cross(ray.direction, np.eye(3)[np.abs(ray.direction).argmin()])
    side /= np.linalg.norm(side)
    other = np.cross(ray.direction, side)
    turns = np.linspace(0, 2 * np.pi, _CONE_LINES + 1)[:, np.newaxis]
    radius = length * np.tan(min(sigmas * ray.sigma, np.radians(80)))
    circle = ray.origin + length * ray.direction + radius * (np.cos(turns) * side + np.sin(turns) * other)
    edges = circle[:-1:_CONE_LINES // _CONE_EDGES]
    tips = np.broadcast_to(ray.origin, edges.shape)
    return _points(np.concatenate([np.stack([circle[:-1], circle[1:]], axis=1), np.stack([tips, edges], axis=1)]))


def _arrow(name: str, number: int, ends: Sequence[np.ndarray], rgba: Rgba) -> MarkerSpec:
    thickness = min(_SHAFT, _SHAFT_SHARE * float(np.linalg.norm(ends[1] - ends[0])))
    return MarkerSpec(name, number, 'add', 'arrow', _points(np.array(ends)), thickness, rgba)


def _points(points: np.ndarray) -> np.ndarray:
    return np.asarray(points, np.float32).reshape(-1, 3)

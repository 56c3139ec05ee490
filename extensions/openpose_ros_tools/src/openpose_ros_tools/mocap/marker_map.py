"""Marker maps: YAML files that say where the joints lie by the markers on the skin.

`joints` holds the joints (names of `MESSAGE_JOINTS`), each after the joints that it is computed from::

    description: what it is for
    joints:
      left_knee: LKNE                                    # at a marker
      left_wrist: [LWRA, LWRB]                           # mean of markers; missing when one of them is
      neck: {joints: [left_shoulder, right_shoulder]}    # mean of joints above
      left_ankle: {markers: [LANK], shift: {metres: 0.04, from: [LASI], to: [RASI]}}   # moved along a direction
      left_hip: {hip_centre: left, asis: [LASI, RASI], psis: [LPSI, RPSI]}             # regression, see hip_centres
      head_top: {first_of: [HTOP, [LFHD, RFHD]]}         # the first whose markers the recording has
"""
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_pkg.structured_text import file_values

_FOLDER = Path(__file__).resolve().parents[1] / 'data' / 'marker_maps'
_KINDS = ('markers', 'joints', 'hip_centre', 'first_of')
_SIDES = ('left', 'right')
# Largest shift of a joint from its markers [m].
_MOST_SHIFT = 1.0
# Hip joint centre by Harrington et al. (2007): share of pelvis depth PD or width PW, and offset [m], per axis of the
# pelvis: forwards (PD), up (PW), outwards (PW).
_HIP_FORWARDS, _HIP_UP, _HIP_OUT = (-0.24, -0.0099), (-0.30, -0.0109), (0.33, 0.0073)

Names = Tuple[str, ...]
# Positions (T, 3) [m] by name.
Points = Mapping[str, np.ndarray]


class Rule(NamedTuple):
    """Where a joint lies."""

    markers: Names  # names of those that it may use
    # returns the joint, (T, 3) [m], by the markers and by the joints above it; None if the recording lacks one of these
    place: Callable[[Points, Points], Optional[np.ndarray]]


@dataclass(frozen=True)
class MarkerMap:
    """Where joints lie by the markers."""

    name: str  # of a shipped map, or the path of a file
    rules: Mapping[str, Rule]  # by joint, in the order in which they are applied
    is_shipped: bool  # it is part of this package; its markers are known by other spellings too
    is_choice: bool = False  # it was chosen by the names of the markers

    @property
    def markers(self) -> Names:
        """Names of all markers that it may use, each once."""
        return tuple(dict.fromkeys(name for rule in self.rules.values() for name in rule.markers))


def shipped_maps() -> Names:
    """Return the names of the maps that are part of this package."""
    return tuple(sorted(path.stem for path in _FOLDER.glob('*.yaml')))


def read_marker_map(path: Union[str, Path]) -> MarkerMap:
    """Read a marker map.

    Args:
        path: of a YAML file, or the name of a shipped map.

    Raises:
        BadInputError: there is none, or it is not as expected.
    """
    file = Path(path).expanduser()
    is_shipped = not file.is_file()
    if is_shipped:
        if str(path) not in shipped_maps():
            raise BadInputError(f"marker map '{path}': there is no such file, nor a shipped map of this name "
                                f"({', '.join(shipped_maps())})")
        file = _FOLDER / f'{path}.yaml'
    where = f'marker map {path}'
    values = _mapping(where, file_values(file, f'marker map {file}'), ('description', 'joints'))
    rules: Dict[str, Rule] = {}
    for joint, value in _mapping(f'{where}, joints', values.get('joints'), MESSAGE_JOINTS).items():
        rules[joint] = _rule(f'{where}, {joint}', value, tuple(rules))
    return MarkerMap(str(path), rules, is_shipped)


def hip_centres(left_asis: np.ndarray, right_asis: np.ndarray, psis: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the left and right hip joint centre.

    Harrington et al., Prediction of the hip joint centre in adults, children, and patients with cerebral palsy based on
    magnetic resonance imaging, J. Biomech. 40 (2007) 595-602: 3 to 5 mm off in each axis, given the bones; markers on
    skin and clothes add to that. The pelvis' frame has its origin in the middle of the ASIS, x forwards in the plane of
    ASIS and PSIS.

    Args:
        left_asis, right_asis: (..., 3) [m] anterior superior iliac spines.
        psis: (..., 3) [m] middle of the posterior superior iliac spines.

    Returns:
        (..., 3) [m] each; NaN where a marker is.
    """
    middle = (left_asis + right_asis) / 2
    width = np.linalg.norm(right_asis - left_asis, axis=-1, keepdims=True)
    depth = np.linalg.norm(middle - psis, axis=-1, keepdims=True)
    right = _unit(right_asis - left_asis)
    forwards = middle - psis
    forwards = _unit(forwards - (forwards * right).sum(axis=-1, keepdims=True) * right)
    up = np.cross(right, forwards)
    centre = (middle + (_HIP_FORWARDS[0] * depth + _HIP_FORWARDS[1]) * forwards
              + (_HIP_UP[0] * width + _HIP_UP[1]) * up)
    out = (_HIP_OUT[0] * width + _HIP_OUT[1]) * right
    return centre - out, centre + out


def _unit(vectors: np.ndarray) -> np.ndarray:
    with np.errstate(invalid='ignore', divide='ignore'):
        return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _mean(points: Points, names: Sequence[str]) -> np.ndarray:
    return np.mean([points[name] for name in names], axis=0)


def _rule(where: str, value: Any, above: Names) -> Rule:
    """Return the rule that a value of a map stands for.

    Args:
        where: it stands, for errors.
        above: the joints that it may be computed from.
    """
    if isinstance(value, (str, list)):
        value = {'markers': value}
    value = _mapping(where, value, (*_KINDS, 'shift', 'asis', 'psis'))
    kinds = [key for key in _KINDS if key in value]
    if len(kinds) != 1:
        raise BadInputError(f"{where}: expected one of {', '.join(_KINDS)}, got {' and '.join(kinds) or 'none'}")
    if kinds == ['first_of']:
        value = _mapping(where, value, ('first_of',))
        if not isinstance(value['first_of'], list) or not value['first_of']:
            raise BadInputError(f"{where}: first_of = {value['first_of']!r}, expected a list")
        return _first_of([_rule(where, one, above) for one in value['first_of']])
    if kinds == ['hip_centre']:
        return _hip_rule(where, _mapping(where, value, ('hip_centre', 'asis', 'psis')))
    return _mean_rule(where, _mapping(where, value, (*kinds, 'shift')), above)


def _first_of(rules: Sequence[Rule]) -> Rule:
    """Return the rule of the first of several whose markers or joints a recording has."""
    def place(markers: Points, joints: Points) -> Optional[np.ndarray]:
        placed = (rule.place(markers, joints) for rule in rules)
        return next((points for points in placed if points is not None), None)

    return Rule(tuple(name for rule in rules for name in rule.markers), place)


def _hip_rule(where: str, value: Mapping[str, Any]) -> Rule:
    """Return the rule of the centre of a hip joint by regression from markers on the pelvis, see `hip_centres`."""
    asis, psis = (_names(where, key, value.get(key)) for key in ('asis', 'psis'))
    if value['hip_centre'] not in _SIDES or len(asis) != 2 or len(psis) not in (1, 2):
        raise BadInputError(f'{where}: expected hip_centre left or right, asis [LEFT, RIGHT] and psis [LEFT, RIGHT] or '
                            f'[SACRUM], got {dict(value)!r}')
    side = _SIDES.index(value['hip_centre'])

    def place(markers: Points, joints: Points) -> Optional[np.ndarray]:
        if not {*asis, *psis} <= set(markers):
            return None
        return hip_centres(markers[asis[0]], markers[asis[1]], _mean(markers, psis))[side]

    return Rule(asis + psis, place)


def _mean_rule(where: str, value: Mapping[str, Any], above: Names) -> Rule:
    """Return the rule of the mean of markers, or of joints that come before, moved by a distance if asked for."""
    kind = 'joints' if 'joints' in value else 'markers'
    names = _names(where, kind, value[kind])
    unknown = [name for name in names if kind == 'joints' and name not in above]
    if unknown:
        raise BadInputError(f"{where}: uses {', '.join(unknown)}, which is not among the joints above it")
    metres, start, end = _shift(where, value['shift']) if 'shift' in value else (0.0, (), ())

    def place(markers: Points, joints: Points) -> Optional[np.ndarray]:
        source = joints if kind == 'joints' else markers
        if not set(names) <= set(source) or not {*start, *end} <= set(markers):
            return None
        mean = _mean(source, names)
        if end:
            mean = mean + metres * _unit(_mean(markers, end) - (_mean(markers, start) if start else mean))
        return mean

    return Rule((names if kind == 'markers' else ()) + start + end, place)


def _shift(where: str, value: Any) -> Tuple[float, Names, Names]:
    """Return a distance [m] and the markers between whose means it leads; without a start it starts at the joint."""
    value = _mapping(f'{where}, shift', value, ('metres', 'from', 'to'))
    metres = value.get('metres')
    if not isinstance(metres, (int, float)) or isinstance(metres, bool) or not abs(metres) <= _MOST_SHIFT:
        raise BadInputError(f'{where}: shift by metres = {metres!r}, expected a number within -1 .. 1 [m]')
    start = _names(where, 'shift from', value['from']) if 'from' in value else ()
    return float(metres), start, _names(where, 'shift to', value.get('to'))


def _names(where: str, key: str, value: Any) -> Names:
    names: List[Any] = [value] if isinstance(value, str) else value
    if not isinstance(names, list) or not names or not all(isinstance(name, str) and name for name in names):
        raise BadInputError(f'{where}: {key} = {value!r}, expected a name or a list of names')
    return tuple(names)


def _mapping(where: str, value: Any, known: Sequence[str]) -> Dict[str, Any]:
    """Return the value if it is a mapping with none but known keys."""
    if not isinstance(value, dict) or not value:
        raise BadInputError(f'{where}: expected keys with values, got {value!r}')
    unknown = [str(key) for key in value if key not in known]
    if unknown:
        raise BadInputError(f"{where}: unknown {', '.join(unknown)}; allowed: {', '.join(known)}")
    return value

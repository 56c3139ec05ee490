"""Marker maps: YAML files that say where the joints lie by the markers on the skin.

`joints` holds the joints (names of `MESSAGE_JOINTS`) in an order in which those that others are made of come first::

    description: what it is for
    joints:
      left_knee: LKNE                                    # at a marker
      left_wrist: [LWRA, LWRB]                           # mean of markers; missing when one of them is
      left_elbow: {markers: [LELB, LELBM], weights: [0.4, 0.6]}        # 60 % of the way from LELB to LELBM
      nose: {markers: [F1, F2, F3], at_least: 2}         # mean of those that are seen, if these are two or more
      neck: {joints: [left_shoulder, right_shoulder]}    # of joints above
      left_ankle: {markers: [LANK], shift: {metres: 0.04, from: [LASI], to: [RASI]}}   # moved along a direction
      left_hip: {hip_centre: left, asis: [LASI, RASI], psis: [LPSI, RPSI]}             # regression, see hip_centres
      head_top: {first_of: [HTOP, [LFHD, RFHD]]}         # the first whose markers the recording has
    subjects: {Ann: 'A_', Ben: 'B_'}                     # optional: how the names of whose markers start
"""
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_pkg.structured_text import yaml_value

AUTOMATIC = 'automatic'
_FOLDER = Path(__file__).resolve().parents[1] / 'data' / 'marker_maps'
_KINDS = ('markers', 'joints', 'hip_centre', 'first_of')
_SIDES = ('left', 'right')

# No number of a map is greater; Python's whole numbers can be greater than floats.
_HUGE = 1e9

Names = Tuple[str, ...]
# Positions (T, 3) [m] by name.
Points = Mapping[str, np.ndarray]


class Rule(NamedTuple):
    """Where a joint lies.

    Attributes:
        markers: names of those that it may use.
        place: returns the joint, (T, 3) [m], by the markers and by the joints above it; None if the recording does not
            have what it is made of.
    """

    markers: Names
    place: Callable[[Points, Points], Optional[np.ndarray]]


@dataclass(frozen=True)
class MarkerMap:
    """Where joints lie by the markers.

    Attributes:
        name: of a shipped map, or the path of a file; `AUTOMATIC`: one of the shipped maps is chosen later.
        rules: by joint, in the order in which they are applied.
        subjects: by name, how the names of their markers start; empty: found out.
        is_choice: it was chosen by the markers, nobody named it.
    """

    name: str
    rules: Mapping[str, Rule]
    subjects: Mapping[str, str]
    is_choice: bool = False

    @property
    def markers(self) -> Names:
        """Names of all markers that it may use, each once."""
        return tuple(dict.fromkeys(name for rule in self.rules.values() for name in rule.markers))


def shipped_maps() -> Names:
    """Return the names of the maps that are part of this package."""
    return tuple(sorted(path.stem for path in _FOLDER.glob('*.yaml')))


def read_marker_map(path: Union[str, Path, None] = None) -> MarkerMap:
    """Read a marker map.

    Args:
        path: of a YAML file, or the name of a shipped map; None: `chosen_map` will choose among these.

    Raises:
        BadInputError: there is none, or it is not as expected.
    """
    if path is None or str(path) == AUTOMATIC:
        return MarkerMap(AUTOMATIC, {}, {})
    file = Path(path).expanduser()
    if not file.is_file():
        if str(path) not in shipped_maps():
            raise BadInputError(f"marker map '{path}': there is no such file, nor a shipped map of this name "
                                f"({', '.join(shipped_maps())})")
        file = _FOLDER / f'{path}.yaml'
    where = f'marker map {path}'
    try:
        values = yaml_value(file.read_text(encoding='utf-8'))
    except (OSError, ValueError) as error:
        raise BadInputError(f'marker map {file} can not be read: {error}') from error
    values = _mapping(where, values, ('description', 'joints', 'subjects'))
    rules: Dict[str, Rule] = {}
    for joint, value in _mapping(f'{where}, joints', values.get('joints'), MESSAGE_JOINTS).items():
        rules[joint] = _rule(f'{where}, {joint}', value, tuple(rules))
    subjects = values.get('subjects') or {}
    if not isinstance(subjects, dict) or not all(isinstance(text, str) for pair in subjects.items() for text in pair):
        raise BadInputError(f'{where}, subjects: expected names and how their markers start, got {subjects!r}')
    return MarkerMap(str(path), rules, subjects)


def hip_centres(left_asis: np.ndarray, right_asis: np.ndarray, psis: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the left and right hip joint centre.

    Harrington et al., Prediction of the hip joint centre in adults, children, and patients with cerebral palsy based on
    magnetic resonance imaging, J. Biomech. 40 (2007) 595-602. In the pelvis' frame (origin in the middle of the ASIS, x
    forwards in the plane of ASIS and PSIS, y up, z to the right) and with depth PD and width PW they are at
    x = -0.24 PD - 9.9 mm, y = -0.30 PW - 10.9 mm, z = -+(0.33 PW + 7.3 mm): 3 to 5 mm off in each, given the bones.
    Markers on skin and clothes add to that.

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
    centre = middle + (-0.24 * depth - 0.0099) * forwards + (-0.30 * width - 0.0109) * up
    out = (0.33 * width + 0.0073) * right
    return centre - out, centre + out


def _unit(vectors: np.ndarray) -> np.ndarray:
    with np.errstate(invalid='ignore', divide='ignore'):
        return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _mean(markers: Points, names: Sequence[str]) -> np.ndarray:
    return np.mean([markers[name] for name in names], axis=0)


def _rule(where: str, value: Any, above: Names) -> Rule:
    """Return the rule that a value of a map stands for.

    Args:
        where: it stands, for errors.
        above: the joints that it may be made of.
    """
    if isinstance(value, (str, list)):
        value = {'markers': value}
    value = _mapping(where, value, (*_KINDS, 'weights', 'at_least', 'shift', 'asis', 'psis'))
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
    return _mean_rule(where, _mapping(where, value, (*kinds, 'weights', 'at_least', 'shift')), above)


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
    """Return the rule of the mean of markers, or of joints that come before, moved by a distance if asked for.

    It needs `at_least` of them; where others are missing, the weights are scaled up.
    """
    kind = 'joints' if 'joints' in value else 'markers'
    names = _names(where, kind, value[kind])
    unknown = [name for name in names if kind == 'joints' and name not in above]
    if unknown:
        raise BadInputError(f"{where}: is made of {', '.join(unknown)}, which is not among the joints above it")
    weights = value.get('weights', [1] * len(names))
    if (not isinstance(weights, list) or len(weights) != len(names)
            or not all(_is_number(weight) and weight > 0 for weight in weights)):
        raise BadInputError(f'{where}: weights = {weights!r}, expected {len(names)} numbers above 0')
    at_least = value.get('at_least', len(names))
    if not isinstance(at_least, int) or not 1 <= at_least <= len(names):
        raise BadInputError(f'{where}: at_least = {at_least!r}, expected 1 .. {len(names)}')
    metres, start, end = _shift(where, value['shift']) if 'shift' in value else (0.0, (), ())

    def place(markers: Points, joints: Points) -> Optional[np.ndarray]:
        source = joints if kind == 'joints' else markers
        there = [number for number, name in enumerate(names) if name in source]
        if len(there) < at_least or not {*start, *end} <= set(markers):
            return None
        points = np.stack([source[names[number]] for number in there])
        seen = np.isfinite(points[..., 0])
        share = np.array(weights)[there, None] * seen
        with np.errstate(invalid='ignore', divide='ignore'):
            mean = np.einsum('nt,ntd->td', share, np.nan_to_num(points)) / share.sum(axis=0)[:, None]
        mean[seen.sum(axis=0) < at_least] = np.nan
        if end:
            mean = mean + metres * _unit(_mean(markers, end) - (_mean(markers, start) if start else mean))
        return mean

    return Rule((names if kind == 'markers' else ()) + start + end, place)


def _shift(where: str, value: Any) -> Tuple[float, Names, Names]:
    """Return a distance [m] and the markers between whose means it leads; none: it starts at the joint."""
    value = _mapping(f'{where}, shift', value, ('metres', 'from', 'to'))
    metres = value.get('metres')
    if not _is_number(metres) or not abs(metres) <= 1:
        raise BadInputError(f'{where}: shift by metres = {metres!r}, expected a number within -1 .. 1 [m]')
    start = _names(where, 'shift from', value['from']) if 'from' in value else ()
    return float(metres), start, _names(where, 'shift to', value.get('to'))


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < _HUGE


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

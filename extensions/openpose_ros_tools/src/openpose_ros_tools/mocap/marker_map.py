"""Marker maps: YAML files that say where the joints lie by the markers on the skin.

`joints` holds the joints (names of `MESSAGE_JOINTS`), each after the joints that it is computed from::

    description: what it is for
    joints:
      left_knee: LKNE                                    # at a marker
      left_wrist: [LWRA, LWRB]                           # mean of markers; missing when one of them is
      neck: {joints: [left_shoulder, right_shoulder]}    # mean of joints above
      left_ankle: {markers: [LANK], shift: {metres: 0.04, from: [LASI], to: [RASI]}}   # moved along a direction
      left_hip: {hip_centre: left, asis: [LASI, RASI], psis: [LPSI, RPSI]}             # regression, see _hip_centre
      head_top: {first_of: [HTOP, [LFHD, RFHD]]}         # the first whose markers the recording has
"""
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_pkg.structured_text import file_values

_FOLDER = Path(__file__).resolve().parents[1] / 'data' / 'marker_maps'
# Kinds of rules, and what each may have beside it.
_KINDS = {'first_of': (), 'hip_centre': ('asis', 'psis'), 'markers': ('shift',), 'joints': ('shift',)}
# Largest shift of a joint from its markers [m].
_MOST_SHIFT = 1.0
# Hip joint centre by Harrington et al. (2007): share of pelvis depth PD or width PW, and offset [m], per axis of the
# pelvis: forwards (PD), up (PW), outwards (PW).
_HIP_FORWARDS, _HIP_UP, _HIP_OUT = (-0.24, -0.0099), (-0.30, -0.0109), (0.33, 0.0073)

# A rule is what stands in the file, with lists of names for single ones.
Rule = Dict[str, Any]
# Positions (T, 3) [m] by name.
Points = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class MarkerMap:
    """Where joints lie by the markers."""

    name: str  # of a shipped map, or the path of a file
    rules: Mapping[str, Rule]  # by joint, in the order in which they are applied

    @property
    def markers(self) -> Tuple[str, ...]:
        """Names of all markers that it may use, each once."""
        return tuple(dict.fromkeys(name for rule in self.rules.values() for name in _markers(rule)))


def shipped_maps() -> Tuple[str, ...]:
    """Return the names of the maps that are part of this package."""
    return tuple(sorted(path.stem for path in _FOLDER.glob('*.yaml')))


def read_marker_map(path: Union[str, Path]) -> MarkerMap:
    """Read a marker map, a YAML file or a shipped map by name; BadInputError: there is none, or it is not one."""
    file = _FOLDER / f'{path}.yaml' if str(path) in shipped_maps() else Path(path).expanduser()
    if not file.is_file():
        raise BadInputError(f"marker map '{path}': there is no such file, nor a shipped map of this name "
                            f"({', '.join(shipped_maps())})")
    rules: Dict[str, Rule] = {}
    joint, values = 'joints', file_values(file, f'marker map {file}')
    try:
        _check_keys(values, ('description', 'joints'))
        _check_keys(values.get('joints'), MESSAGE_JOINTS)
        for joint, value in values['joints'].items():
            rules[joint] = _rule(value, tuple(rules))
    except (LookupError, TypeError, ValueError) as error:
        raise BadInputError(f'marker map {path}, {joint}: {error}') from error
    return MarkerMap(str(path), rules)


def place(rule: Rule, markers: Points, joints: Points) -> Optional[np.ndarray]:
    """Return the joint of a rule, (T, 3) [m], by the markers and the joints above it; None: it has not all of these."""
    if 'first_of' in rule:
        placed = (place(each, markers, joints) for each in rule['first_of'])
        return next((points for points in placed if points is not None), None)
    if not set(_markers(rule)) <= set(markers) or not set(rule.get('joints', ())) <= set(joints):
        return None
    if 'hip_centre' in rule:
        left, right = (markers[name] for name in rule['asis'])
        return _hip_centre(left, right, _mean(markers, rule['psis']), 1 if rule['hip_centre'] == 'right' else -1)
    mean = _mean(joints, rule['joints']) if 'joints' in rule else _mean(markers, rule['markers'])
    if 'shift' in rule:
        shift = rule['shift']
        start = _mean(markers, shift['from']) if 'from' in shift else mean
        mean = mean + shift['metres'] * _unit(_mean(markers, shift['to']) - start)
    return mean


def _markers(rule: Rule) -> Iterator[str]:
    for each in rule.get('first_of', ()):
        yield from _markers(each)
    for part, keys in ((rule, ('asis', 'psis', 'markers')), (rule.get('shift', {}), ('from', 'to'))):
        for key in keys:
            yield from part.get(key, ())


def _hip_centre(left_asis: np.ndarray, right_asis: np.ndarray, psis: np.ndarray, side: int) -> np.ndarray:
    """Return a hip joint centre, (T, 3) [m].

    Harrington et al., Prediction of the hip joint centre in adults, children, and patients with cerebral palsy based on
    magnetic resonance imaging, J. Biomech. 40 (2007) 595-602: 3 to 5 mm off in each axis, given the bones; markers on
    skin and clothes add to that. The pelvis' frame has its origin in the middle of the anterior superior iliac spines
    (ASIS), x forwards in the plane of these and the posterior ones (PSIS).

    Args:
        left_asis, right_asis, psis: (T, 3) [m], the last in their middle.
        side: 1 right, -1 left.
    """
    middle = (left_asis + right_asis) / 2
    width = np.linalg.norm(right_asis - left_asis, axis=-1, keepdims=True)
    depth = np.linalg.norm(middle - psis, axis=-1, keepdims=True)
    right, forwards = _unit(right_asis - left_asis), middle - psis
    forwards = _unit(forwards - (forwards * right).sum(axis=-1, keepdims=True) * right)
    centre = (middle + (_HIP_FORWARDS[0] * depth + _HIP_FORWARDS[1]) * forwards
              + (_HIP_UP[0] * width + _HIP_UP[1]) * np.cross(right, forwards))
    return centre + side * ((_HIP_OUT[0] * width + _HIP_OUT[1]) * right)


def _unit(vectors: np.ndarray) -> np.ndarray:
    with np.errstate(invalid='ignore', divide='ignore'):
        return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _mean(points: Points, names: Sequence[str]) -> np.ndarray:
    return np.mean([points[name] for name in names], axis=0)


def _rule(value: Any, above: Sequence[str]) -> Rule:
    """Return the rule that a value stands for; above: joints that it may be made of."""
    if isinstance(value, (str, list)):
        value = {'markers': value}
    kind = next((kind for kind in _KINDS if kind in value), None)
    if kind is None:
        raise ValueError(f"expected one of {', '.join(_KINDS)}")
    _check_keys(value, (kind, *_KINDS[kind]))
    if kind == 'first_of':
        if not isinstance(value[kind], list) or not value[kind]:
            raise ValueError(f'first_of = {value[kind]!r}, expected a list')
        return {kind: [_rule(each, above) for each in value[kind]]}
    if kind == 'hip_centre':
        asis, psis = (_names(value.get(key)) for key in _KINDS[kind])
        if value[kind] not in ('left', 'right') or len(asis) != 2:
            raise ValueError('expected hip_centre left or right, asis [LEFT, RIGHT] and psis [LEFT, RIGHT] or [SACRUM]')
        return {kind: value[kind], 'asis': asis, 'psis': psis}
    rule: Rule = {kind: _names(value[kind])}
    unknown = [name for name in rule.get('joints', ()) if name not in above]
    if unknown:
        raise ValueError(f"uses {', '.join(unknown)}, which is not among the joints above it")
    if 'shift' in value:
        shift = value['shift']
        _check_keys(shift, ('metres', 'from', 'to'))
        metres = shift.get('metres')
        if not isinstance(metres, (int, float)) or not abs(metres) <= _MOST_SHIFT:
            raise ValueError(f"shift by metres = {metres!r}, expected a number within -1 .. 1 [m]")
        rule['shift'] = {'metres': metres, 'to': _names(shift.get('to')), **(
            {'from': _names(shift['from'])} if 'from' in shift else {})}
    return rule


def _names(value: Any) -> List[str]:
    names: List[Any] = [value] if isinstance(value, str) else value
    if not isinstance(names, list) or not names or not all(isinstance(name, str) and name for name in names):
        raise ValueError(f'{value!r}, expected a name or a list of names')
    return names


def _check_keys(value: Any, known: Sequence[str]) -> None:
    if not isinstance(value, dict) or not value:
        raise ValueError(f'expected keys with values, got {value!r}')
    unknown = [str(key) for key in value if key not in known]
    if unknown:
        raise ValueError(f"unknown {', '.join(unknown)}; allowed: {', '.join(known)}")

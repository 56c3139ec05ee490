"""From markers on the skin to joints: marker maps in YAML, and what they make of a recording.

A marker map says for each joint where it lies. `joints` holds the joints (names of `MESSAGE_JOINTS`) in an order in
which those that others are made of come first::

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

Without `subjects`, what stands before a marker's name and ':' or '_' names the subject: `Ann:LKNE`, `Ann_LKNE`.
Markers of the shipped maps are also known by other spellings, with upper and lower case and separators as they come:
`Ann lkne`, `Ann.LeftKnee` for left_knee.
"""
import logging
import re
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
import yaml

from openpose_ros_mocap.files.recording import MarkerRecording, check_positions, check_times
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS

_log = logging.getLogger(__name__)

# Fewer joints than these are no person: a wand, or a map for other markers.
LEAST_JOINTS = 6
# Name of the only subject, where markers have no prefix.
SUBJECT = 'subject'
AUTOMATIC = 'automatic'
_SEPARATORS = (':', '_')
# What may stand between a subject and a marker that is found by its words.
_BETWEEN = ' :_.-/|'
# Words in names: 'Ann:LeftKnee' has ann, left, knee; 'person0_LKNE' has person, 0, lkne.
_WORD = re.compile('[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+')
_FOLDER = Path(__file__).resolve().parent / 'data' / 'marker_maps'

Points = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class JointRecording:
    """Joints of S people at T times, in the frame and by the clock of the motion capture system.

    Attributes:
        subjects: names of the people, each once.
        times: (T,) float64 [s], increasing.
        positions: (S, T, K, 3) float64 [m]; NaN where missing. The K joints are `MESSAGE_JOINTS`.

    Raises:
        ValueError: shapes, names or times are wrong, or a position is half missing.
    """

    subjects: Tuple[str, ...]
    times: np.ndarray
    positions: np.ndarray

    def __post_init__(self) -> None:
        subjects, times = tuple(self.subjects), np.asarray(self.times, np.float64)
        positions = np.asarray(self.positions, np.float64)
        if len(set(subjects)) != len(subjects):
            raise ValueError(f"subjects: expected each once, got {', '.join(subjects)}")
        check_times(times)
        expected = (len(subjects), len(times), len(MESSAGE_JOINTS), 3)
        if positions.shape != expected:
            raise ValueError(f'positions: expected {expected}, got {positions.shape}')
        check_positions(positions)
        for name, value in (('subjects', subjects), ('times', times), ('positions', positions)):
            object.__setattr__(self, name, value)

    @property
    def joints(self) -> Tuple[str, ...]:
        """Names of the K joints."""
        return MESSAGE_JOINTS


@dataclass(frozen=True)
class Mean:
    """The mean of markers or joints, moved by a distance if asked for.

    Attributes:
        names: of the markers, or of joints that come before.
        of_joints: whether `names` are joints.
        weights: of the names; they add up to 1.
        at_least: how many of them must be seen. Where some are missing, the weights of the others are scaled up.
        shift: distance [m] and the markers between whose means it leads; it starts at the joint if `shift_from` is ().
    """

    names: Tuple[str, ...]
    of_joints: bool
    weights: Tuple[float, ...]
    at_least: int
    shift: float = 0.0
    shift_from: Tuple[str, ...] = ()
    shift_to: Tuple[str, ...] = ()

    @property
    def markers(self) -> Tuple[str, ...]:
        """Names of the markers that it may use."""
        return (() if self.of_joints else self.names) + self.shift_from + self.shift_to

    def place(self, markers: Points, joints: Points) -> Optional[np.ndarray]:
        """Return the joint, (T, 3) [m], or None if the recording does not have what it is made of."""
        source = joints if self.of_joints else markers
        there = [(source[name], weight) for name, weight in zip(self.names, self.weights) if name in source]
        if len(there) < self.at_least or any(name not in markers for name in self.shift_from + self.shift_to):
            return None
        points = np.stack([point for point, _ in there])
        seen = np.isfinite(points).all(axis=2)
        weights = np.array([weight for _, weight in there])[:, None] * seen
        with np.errstate(invalid='ignore', divide='ignore'):
            mean = (np.where(seen[..., None], points, 0.0) * weights[..., None]).sum(axis=0)
            mean /= weights.sum(axis=0)[:, None]
        mean[seen.sum(axis=0) < self.at_least] = np.nan
        if self.shift_to:
            start = _mean(markers, self.shift_from) if self.shift_from else mean
            mean = mean + self.shift * _unit(_mean(markers, self.shift_to) - start)
        return mean


@dataclass(frozen=True)
class HipCentre:
    """The centre of a hip joint by regression from markers on the pelvis, see `hip_centres`.

    Attributes:
        side: 0 left, 1 right.
        asis: left and right anterior superior iliac spine.
        psis: left and right posterior superior iliac spine, or the sacrum alone.
    """

    side: int
    asis: Tuple[str, ...]
    psis: Tuple[str, ...]

    @property
    def markers(self) -> Tuple[str, ...]:
        """Names of the markers that it uses."""
        return self.asis + self.psis

    def place(self, markers: Points, joints: Points) -> Optional[np.ndarray]:
        """Return the joint, (T, 3) [m], or None if the recording does not have its markers."""
        if any(name not in markers for name in self.markers):
            return None
        return hip_centres(*(markers[name] for name in self.asis), _mean(markers, self.psis))[self.side]


@dataclass(frozen=True)
class FirstOf:
    """The first of several rules whose markers or joints a recording has."""

    rules: Tuple['Rule', ...]

    @property
    def markers(self) -> Tuple[str, ...]:
        """Names of the markers that it may use."""
        return tuple(name for rule in self.rules for name in rule.markers)

    def place(self, markers: Points, joints: Points) -> Optional[np.ndarray]:
        """Return the joint, (T, 3) [m], or None if the recording has the markers of none."""
        placed = (rule.place(markers, joints) for rule in self.rules)
        return next((points for points in placed if points is not None), None)


Rule = Union[Mean, HipCentre, FirstOf]


@dataclass(frozen=True)
class MarkerMap:
    """Where joints lie by the markers.

    Attributes:
        name: of a shipped map, or the path of a file; `AUTOMATIC` chooses among the shipped ones.
        rules: by joint, in the order in which they are applied.
        subjects: by name, how the names of their markers start; empty: found out.
        is_choice: of `chosen_map`, nobody named it.
    """

    name: str
    rules: Mapping[str, Rule]
    subjects: Mapping[str, str]
    is_choice: bool = False

    @property
    def markers(self) -> Tuple[str, ...]:
        """Names of all markers that it may use, each once."""
        return tuple(dict.fromkeys(name for rule in self.rules.values() for name in rule.markers))


def shipped_maps() -> Tuple[str, ...]:
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
    try:
        values = yaml.safe_load(file.read_text(encoding='utf-8'))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise BadInputError(f'marker map {file} can not be read: {error}') from error
    return _marker_map(str(path), values)


def chosen_map(recording: MarkerRecording, marker_map: MarkerMap) -> MarkerMap:
    """Return the map itself, or in place of the automatic one the shipped one that gives most joints.

    Of several that give as many, it is the one that knows most of the markers.
    """
    if marker_map.name != AUTOMATIC:
        return marker_map
    maps = [read_marker_map(name) for name in shipped_maps()]
    return replace(max(maps, key=lambda one: _fit(recording, one)), is_choice=True)


def joints_of(recording: MarkerRecording, marker_map: MarkerMap) -> JointRecording:
    """Return the joints of all people of whom a recording has markers.

    Prefixes with fewer than `LEAST_JOINTS` joints are left out, as those of props are.

    Raises:
        BadInputError: nobody is left; the text names the markers that are there and those that are expected.
    """
    chosen = chosen_map(recording, marker_map)
    groups = _by_subject(recording, chosen)
    subjects, positions = [], []
    for subject, markers in groups.items():
        joints = _place(recording, chosen, markers)
        if len(joints) < LEAST_JOINTS:
            _log.warning("%s has only %d joints by the marker map '%s' (%s), expected %d or more; left out",
                         subject, len(joints), chosen.name, ', '.join(joints) or 'none', LEAST_JOINTS)
            continue
        body = np.full((len(recording), len(MESSAGE_JOINTS), 3), np.nan)
        for joint, points in joints.items():
            body[:, MESSAGE_JOINTS.index(joint)] = points
        subjects.append(subject)
        positions.append(body)
    if not subjects:
        raise BadInputError(_nobody(recording, chosen, groups))
    return JointRecording(tuple(subjects), recording.times, np.stack(positions))


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


def _split(name: str, marker_map: MarkerMap) -> Optional[Tuple[str, str]]:
    """Return subject and marker of a name in a recording, None if the map does not know it."""
    if marker_map.subjects:
        for subject, prefix in marker_map.subjects.items():
            if name.startswith(prefix) and name[len(prefix):] in marker_map.markers:
                return subject, name[len(prefix):]
        return None
    known = [marker for marker in marker_map.markers
             if name == marker or any(name.endswith(separator + marker) for separator in _SEPARATORS)]
    if not known:
        return None
    marker = max(known, key=len)  # left_hip, not hip
    return name[:-len(marker) - 1] or SUBJECT, marker


def _split_words(name: str, known: Mapping[str, str]) -> Optional[Tuple[str, str]]:
    """Return what `_split` does, by the words of the name; markers are known by what `_plain` makes of them."""
    for word in _WORD.finditer(name):  # left_hip, not hip
        marker = known.get(_plain(name[word.start():]))
        if marker is not None:
            return name[:word.start()].rstrip(_BETWEEN) or SUBJECT, marker
    return None


def _plain(name: str) -> str:
    """Return a name without upper case and separators."""
    return ''.join(_WORD.findall(name)).lower()


def _by_subject(recording: MarkerRecording, marker_map: MarkerMap) -> Dict[str, Dict[str, int]]:
    """Return by subject and marker the place of the marker in the recording."""
    groups: Dict[str, Dict[str, int]] = {subject: {} for subject in marker_map.subjects}
    splits = [partial(_split, marker_map=marker_map)]
    if marker_map.name in shipped_maps():
        splits.append(partial(_split_words, known={_plain(marker): marker for marker in marker_map.markers}))
    left = recording.index()
    for split in splits:
        found = {name: split(name) for name in left}
        for name, subject_and_marker in found.items():
            if subject_and_marker is not None:
                subject, marker = subject_and_marker
                groups.setdefault(subject, {}).setdefault(marker, left.pop(name))
    return groups


def _place(recording: MarkerRecording, marker_map: MarkerMap, places: Mapping[str, int]) -> Dict[str, np.ndarray]:
    """Return the joints of a subject that are known at some time, (T, 3) each."""
    markers = {name: recording.positions[:, place] for name, place in places.items()}
    joints: Dict[str, np.ndarray] = {}
    for joint, rule in marker_map.rules.items():
        points = rule.place(markers, joints)
        if points is not None and np.isfinite(points).any():
            joints[joint] = points
    return joints


def _fit(recording: MarkerRecording, marker_map: MarkerMap) -> Tuple[int, int]:
    """Return how many joints a map gives of people, and of how many markers."""
    groups = _by_subject(recording, marker_map)
    counts = [len(_place(recording, marker_map, markers)) for markers in groups.values()]
    return (sum(count for count in counts if count >= LEAST_JOINTS), sum(len(markers) for markers in groups.values()))


def _nobody(recording: MarkerRecording, marker_map: MarkerMap, groups: Mapping[str, Mapping[str, int]]) -> str:
    matched = {place for markers in groups.values() for place in markers.values()}
    unmatched = [name for i, name in enumerate(recording.names) if i not in matched]
    text = (f"marker map '{marker_map.name}' gives nobody {LEAST_JOINTS} joints: it knows {len(matched)} of "
            f'{len(recording.names)} markers')
    if unmatched:
        text += f', not {_some(unmatched)}'
    text += f'. It expects {_some(marker_map.markers, 60)}'
    if marker_map.is_choice:
        text += f". No shipped map ({', '.join(shipped_maps())}) fits better; write one for these markers"
    return text


def _some(names: Sequence[str], most: int = 30) -> str:
    return ', '.join(names[:most]) + (f', ... ({len(names)} in all)' if len(names) > most else '')


def _marker_map(name: str, values: Any) -> MarkerMap:
    where = f'marker map {name}'
    values = _mapping(where, values, ('description', 'joints', 'subjects'))
    entries = _mapping(f'{where}, joints', values.get('joints'), MESSAGE_JOINTS)
    rules: Dict[str, Rule] = {}
    for joint, value in entries.items():
        rules[joint] = _rule(f'{where}, {joint}', value, tuple(rules))
    subjects = values.get('subjects') or {}
    if not isinstance(subjects, dict) or not all(isinstance(text, str) for pair in subjects.items() for text in pair):
        raise BadInputError(f'{where}, subjects: expected names and how their markers start, got {subjects!r}')
    return MarkerMap(name, rules, dict(subjects))


def _rule(where: str, value: Any, above: Tuple[str, ...]) -> Rule:
    """Return the rule that a value of a map stands for.

    Args:
        where: it stands, for errors.
        above: the joints that it may be made of.
    """
    if isinstance(value, (str, list)):
        value = {'markers': value}
    keys = ('markers', 'joints', 'weights', 'at_least', 'shift', 'hip_centre', 'asis', 'psis', 'first_of')
    value = _mapping(where, value, keys)
    kinds = [key for key in ('markers', 'joints', 'hip_centre', 'first_of') if key in value]
    if len(kinds) != 1:
        raise BadInputError(f"{where}: expected one of markers, joints, hip_centre, first_of, got "
                            f"{' and '.join(kinds) or 'none'}")
    if kinds == ['first_of']:
        value = _mapping(where, value, ('first_of',))
        if not isinstance(value['first_of'], list) or not value['first_of']:
            raise BadInputError(f"{where}: first_of = {value['first_of']!r}, expected a list")
        return FirstOf(tuple(_rule(where, one, above) for one in value['first_of']))
    if kinds == ['hip_centre']:
        return _hip_rule(where, _mapping(where, value, ('hip_centre', 'asis', 'psis')))
    return _mean_rule(where, _mapping(where, value, (*kinds, 'weights', 'at_least', 'shift')), above)


def _hip_rule(where: str, value: Mapping[str, Any]) -> HipCentre:
    asis, psis = _names(where, 'asis', value.get('asis')), _names(where, 'psis', value.get('psis'))
    if value['hip_centre'] not in ('left', 'right') or len(asis) != 2 or len(psis) not in (1, 2):
        raise BadInputError(f'{where}: expected hip_centre left or right, asis [LEFT, RIGHT] and psis [LEFT, RIGHT] or '
                            f'[SACRUM], got {dict(value)!r}')
    return HipCentre(('left', 'right').index(value['hip_centre']), asis, psis)


def _mean_rule(where: str, value: Mapping[str, Any], above: Tuple[str, ...]) -> Mean:
    of_joints = 'joints' in value
    names = _names(where, 'joints' if of_joints else 'markers', value['joints' if of_joints else 'markers'])
    unknown = [name for name in names if of_joints and name not in above]
    if unknown:
        raise BadInputError(f"{where}: is made of {', '.join(unknown)}, which is not among the joints above it")
    weights = value.get('weights', [1] * len(names))
    if (not isinstance(weights, list) or len(weights) != len(names)
            or not all(_is_number(weight) and weight > 0 for weight in weights)):
        raise BadInputError(f'{where}: weights = {weights!r}, expected {len(names)} numbers above 0')
    at_least = value.get('at_least', len(names))
    if not isinstance(at_least, int) or not 1 <= at_least <= len(names):
        raise BadInputError(f'{where}: at_least = {at_least!r}, expected 1 .. {len(names)}')
    shift, start, end = _shift(where, value['shift']) if 'shift' in value else (0.0, (), ())
    return Mean(names, of_joints, tuple(weight / sum(weights) for weight in weights), at_least, shift, start, end)


def _shift(where: str, value: Any) -> Tuple[float, Tuple[str, ...], Tuple[str, ...]]:
    value = _mapping(f'{where}, shift', value, ('metres', 'from', 'to'))
    if not _is_number(value.get('metres')) or not abs(value['metres']) <= 1:
        raise BadInputError(f"{where}: shift by metres = {value.get('metres')!r}, expected a number within -1 .. 1 [m]")
    start = _names(where, 'shift from', value['from']) if 'from' in value else ()
    return float(value['metres']), start, _names(where, 'shift to', value.get('to'))


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and bool(np.isfinite(value))


def _names(where: str, key: str, value: Any) -> Tuple[str, ...]:
    names: List[Any] = [value] if isinstance(value, str) else value
    if not isinstance(names, list) or not names or not all(isinstance(name, str) and name for name in names):
        raise BadInputError(f'{where}: {key} = {value!r}, expected a name or a list of names')
    return tuple(names)


def _mapping(where: str, value: Any, known: Sequence[str]) -> Mapping[str, Any]:
    """Return the value if it is a mapping with none but known keys."""
    if not isinstance(value, dict) or not value:
        raise BadInputError(f'{where}: expected keys with values, got {value!r}')
    unknown = [str(key) for key in value if key not in known]
    if unknown:
        raise BadInputError(f"{where}: unknown {', '.join(unknown)}; allowed: {', '.join(known)}")
    return value

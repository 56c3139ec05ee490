"""From the markers of a recording to the joints of its people, by a marker map.

The prefix of a marker's name before ':' or '_' names the subject: `Ann:LKNE`, `Ann_LKNE`. Markers of the shipped maps
are also known by other spellings, with any upper and lower case and separators: `Ann lkne`, `Ann.LeftKnee` for
left_knee.
"""
import logging
import re
from dataclasses import dataclass, replace
from typing import Callable, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.mocap.files.recording import MarkerRecording
from openpose_ros_tools.mocap.marker_map import MarkerMap, read_marker_map, shipped_maps

_log = logging.getLogger(__name__)

# Fewer joints than these are no person: a wand, or a map for other markers.
LEAST_JOINTS = 6
# Name of the only subject, where markers have no prefix.
SUBJECT = 'subject'
_SEPARATORS = (':', '_')
# What may stand between a subject and a marker that is found by its words.
_BETWEEN = ' :_.-/|'
# Words in names: 'Ann:LeftKnee' has ann, left, knee; 'person0_LKNE' has person, 0, lkne.
_WORD = re.compile('[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+')


@dataclass(frozen=True)
class JointRecording:
    """Joints of S people at T times, in the frame and by the clock of the motion capture system."""

    subjects: Tuple[str, ...]  # names of the people, each once
    times: np.ndarray  # (T,) float64 [s], increasing
    positions: np.ndarray  # (S, T, K, 3) float64 [m]; NaN where missing. The K joints are `MESSAGE_JOINTS`.


def chosen_map(recording: MarkerRecording) -> MarkerMap:
    """Return the shipped map that gives most joints; of several that give as many, the one that knows most markers."""
    def merit(one: MarkerMap) -> Tuple[int, int]:
        groups = _by_subject(recording.names, one)
        counts = [len(_place(recording, one, markers)) for markers in groups.values()]
        return sum(count for count in counts if count >= LEAST_JOINTS), sum(map(len, groups.values()))

    return replace(max(map(read_marker_map, shipped_maps()), key=merit), is_choice=True)


def joints_of(recording: MarkerRecording, marker_map: MarkerMap) -> JointRecording:
    """Return the joints of all people in a recording; prefixes with fewer than `LEAST_JOINTS` joints are left out.

    Raises:
        BadInputError: no person is left; the text names the markers that are there and those that are expected.
    """
    groups = _by_subject(recording.names, marker_map)
    bodies: Dict[str, np.ndarray] = {}
    for subject, markers in groups.items():
        joints = _place(recording, marker_map, markers)
        if len(joints) < LEAST_JOINTS:
            _log.warning("%s has only %d joints by the marker map '%s' (%s), expected %d or more; left out",
                         subject, len(joints), marker_map.name, ', '.join(joints) or 'none', LEAST_JOINTS)
            continue
        bodies[subject] = np.full((len(recording), len(MESSAGE_JOINTS), 3), np.nan)
        for joint, points in joints.items():
            bodies[subject][:, MESSAGE_JOINTS.index(joint)] = points
    if not bodies:
        raise BadInputError(_no_person(recording, marker_map, groups))
    return JointRecording(tuple(bodies), recording.times, np.stack(list(bodies.values())))


def _by_subject(names: Sequence[str], marker_map: MarkerMap) -> Dict[str, Dict[str, int]]:
    """Return by subject and marker the place of the marker in the recording."""
    groups: Dict[str, Dict[str, int]] = {}
    left = {name: place for place, name in enumerate(names)}
    splits: List[Callable[[str], Optional[Tuple[str, str]]]] = [lambda name: _split(name, marker_map.markers)]
    if marker_map.is_shipped:
        known = {_plain(marker): marker for marker in marker_map.markers}
        splits.append(lambda name: _split_words(name, known))
    for split in splits:
        for name, found in [(name, split(name)) for name in left]:
            if found is not None:
                groups.setdefault(found[0], {}).setdefault(found[1], left.pop(name))
    return groups


def _split(name: str, markers: Sequence[str]) -> Optional[Tuple[str, str]]:
    """Return subject and marker of a name in a recording, None if it is none of the markers."""
    known = [marker for marker in markers
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


def _place(recording: MarkerRecording, marker_map: MarkerMap, places: Mapping[str, int]) -> Dict[str, np.ndarray]:
    """Return the joints of a subject that are known at some time, (T, 3) each."""
    markers = {name: recording.positions[:, place] for name, place in places.items()}
    joints: Dict[str, np.ndarray] = {}
    for joint, rule in marker_map.rules.items():
        points = rule.place(markers, joints)
        if points is not None and np.isfinite(points).any():
            joints[joint] = points
    return joints


def _no_person(recording: MarkerRecording, marker_map: MarkerMap, groups: Mapping[str, Mapping[str, int]]) -> str:
    matched = {place for markers in groups.values() for place in markers.values()}
    unmatched = [name for i, name in enumerate(recording.names) if i not in matched]
    text = (f"marker map '{marker_map.name}' gives no person {LEAST_JOINTS} joints: it knows {len(matched)} of "
            f'{len(recording.names)} markers')
    if unmatched:
        text += f', not {_some(unmatched)}'
    text += f'. It expects {_some(marker_map.markers, 60)}'
    if marker_map.is_choice:
        text += f". No shipped map ({', '.join(shipped_maps())}) fits better; write one for these markers"
    return text


def _some(names: Sequence[str], most: int = 30) -> str:
    return ', '.join(names[:most]) + (f', ... ({len(names)} in all)' if len(names) > most else '')

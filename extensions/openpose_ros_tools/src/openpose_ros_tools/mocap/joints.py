"""From the markers of a recording to the joints of its people, by a marker map.

What a name has before the marker names the subject: `Ann:LKNE`, `Ann_LKNE`. Markers are known in any upper and lower
case and with any separators: `Ann lkne`, `Ann.LeftKnee` for left_knee.
"""
import logging
import re
from dataclasses import dataclass
from typing import Dict, Mapping, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.mocap.files import MarkerRecording
from openpose_ros_tools.mocap.marker_map import MarkerMap, place, read_marker_map, shipped_maps

_log = logging.getLogger(__name__)

# Fewer joints than these are no person: a wand, or a map for other markers.
LEAST_JOINTS = 6
# Name of the only subject, where markers have no prefix.
SUBJECT = 'subject'
# What may stand between a subject and a marker.
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
        groups = _by_subject(recording, one)
        counts = [len(_placed(markers, one)) for markers in groups.values()]
        return sum(count for count in counts if count >= LEAST_JOINTS), sum(map(len, groups.values()))

    return max(map(read_marker_map, shipped_maps()), key=merit)


def joints_of(recording: MarkerRecording, marker_map: MarkerMap) -> JointRecording:
    """Return the joints of all people in a recording; prefixes with fewer than `LEAST_JOINTS` joints are left out.

    Raises:
        BadInputError: no person is left; the text names the markers that are there and those that are expected.
    """
    groups, bodies = _by_subject(recording, marker_map), {}
    for subject, markers in groups.items():
        joints = _placed(markers, marker_map)
        if len(joints) < LEAST_JOINTS:
            _log.warning("%s has only %d joints by the marker map '%s' (%s), expected %d or more; left out",
                         subject, len(joints), marker_map.name, ', '.join(joints) or 'none', LEAST_JOINTS)
            continue
        bodies[subject] = np.full((len(recording), len(MESSAGE_JOINTS), 3), np.nan)
        for joint, points in joints.items():
            bodies[subject][:, MESSAGE_JOINTS.index(joint)] = points
    if not bodies:
        raise BadInputError(
            f"marker map '{marker_map.name}' gives no person {LEAST_JOINTS} joints: it knows "
            f'{sum(map(len, groups.values()))} of {len(recording.names)} markers, {_some(recording.names)}. It expects '
            f"{_some(marker_map.markers)}. The shipped maps are {', '.join(shipped_maps())}; or write one for these "
            'markers')
    return JointRecording(tuple(bodies), recording.times, np.stack(list(bodies.values())))


def _by_subject(recording: MarkerRecording, marker_map: MarkerMap) -> Dict[str, Dict[str, np.ndarray]]:
    """Return the positions (T, 3) of markers by subject and name of the marker in the map; the first of equal ones."""
    known = {_plain(marker): marker for marker in marker_map.markers}
    groups: Dict[str, Dict[str, np.ndarray]] = {}
    for number, name in enumerate(recording.names):
        starts = [0, *(word.start() for word in _WORD.finditer(name))]
        start = next((start for start in starts if _plain(name[start:]) in known), None)  # left_hip, not hip
        if start is not None:
            subject = name[:start].rstrip(_BETWEEN) or SUBJECT
            groups.setdefault(subject, {}).setdefault(known[_plain(name[start:])], recording.positions[:, number])
    return groups


def _plain(name: str) -> str:
    """Return a name without upper case and separators."""
    return ''.join(_WORD.findall(name)).lower() or name


def _placed(markers: Mapping[str, np.ndarray], marker_map: MarkerMap) -> Dict[str, np.ndarray]:
    """Return the joints of a subject that are known at some time, (T, 3) each."""
    joints: Dict[str, np.ndarray] = {}
    for joint, rule in marker_map.rules.items():
        points = place(rule, markers, joints)
        if points is not None and np.isfinite(points).any():
            joints[joint] = points
    return joints


def _some(names: Sequence[str], most: int = 40) -> str:
    return ', '.join(names[:most]) + (f', ... ({len(names)} in all)' if len(names) > most else '')

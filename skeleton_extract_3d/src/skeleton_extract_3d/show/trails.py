"""The paths that people took in the last seconds."""
from collections import deque
from typing import Deque, Dict, Optional, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import SkeletonModel
from skeleton_extract_3d.people import People3D

SHOULDERS = ('neck', 'right_shoulder', 'left_shoulder')
HIPS = ('right_hip', 'left_hip', 'mid_hip')
# Points of a trail are at least this far apart [m], so that the trail of a standing person is no tangle.
_TRAIL_STEP = 0.02
# Bounds, whatever the stamps are: points of a trail (33 s at 30 Hz), and people.
_MOST_POINTS, _MOST_PEOPLE = 1000, 1000


class Trails:
    """Remembers the paths of people."""

    def __init__(self) -> None:
        self._paths: Dict[int, Deque[Tuple[float, np.ndarray]]] = {}
        self._last: Optional[Tuple[float, str]] = None

    def update(self, people: People3D, stamp: float, frame_id: str, seconds: float) -> Dict[int, np.ndarray]:
        """Return the path of each person of the frame.

        Whoever returns within `seconds` continues the old path. All paths restart when the stamps jump back or the
        positions are in another frame.

        Args:
            stamp: of the frame [s].
            frame_id: of the positions.
            seconds: positions of this age are forgotten [s].

        Returns:
            By id: (N, 3) float32 [m], the oldest position first.
        """
        if self._last is not None and (stamp < self._last[0] or frame_id != self._last[1]):
            self._paths.clear()
        self._last = stamp, frame_id
        for path in self._paths.values():
            while path and stamp - path[0][0] >= seconds:
                path.popleft()
        for xyz, person in zip(people.xyz, people.ids.tolist()):
            place = middle(people.skeleton, xyz, HIPS)
            place = middle(people.skeleton, xyz, SHOULDERS) if place is None else place
            if place is not None:
                _go_to(self._paths.setdefault(person, deque(maxlen=_MOST_POINTS)), stamp, place)
        self._paths = dict([(person, path) for person, path in self._paths.items() if path][-_MOST_PEOPLE:])
        return {person: np.array([place for _, place in self._paths[person]])
                for person in people.ids.tolist() if person in self._paths}


def _go_to(path: Deque[Tuple[float, np.ndarray]], stamp: float, place: np.ndarray) -> None:
    """Append a place; it replaces the last one if that was less than a step from the one before it."""
    if len(path) > 1 and np.linalg.norm(path[-1][1] - path[-2][1]) < _TRAIL_STEP:
        path.pop()
    path.append((stamp, place))


def finite(xyz: np.ndarray) -> np.ndarray:
    """Return those of (N, 3) positions that are finite."""
    return xyz[np.isfinite(xyz).all(axis=1)]


def middle(skeleton: SkeletonModel, xyz: np.ndarray, joints: Tuple[str, ...]) -> Optional[np.ndarray]:
    """Return the mean of those of the joints that exist and are finite, or None."""
    found = finite(xyz[[skeleton.index[joint] for joint in joints if joint in skeleton.index]])
    return found.mean(axis=0) if len(found) else None

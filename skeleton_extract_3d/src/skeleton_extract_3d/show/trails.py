"""The paths that people took in the last seconds."""
from collections import deque
from typing import Deque, Dict, Optional, Tuple

import numpy as np

# Points of a trail are at least this far apart [m], so that the trail of a standing person is no tangle.
_STEP = 0.02
# Bounds, whatever the stamps are: points of a trail (33 s at 30 Hz), and people.
_MOST_POINTS, _MOST_PEOPLE = 1000, 1000


class Trails:
    """Remembers the paths of people."""

    def __init__(self) -> None:
        self._paths: Dict[int, Deque[Tuple[float, np.ndarray]]] = {}
        self._last: Optional[Tuple[float, str]] = None

    def extended(self, places: Dict[int, np.ndarray], stamp: float, frame_id: str, seconds: float
                 ) -> Dict[int, np.ndarray]:
        """Return the path of each person with a place in the frame, (N, 3) [m] by id, the oldest position first.

        A person who returns within `seconds` continues the old path. All paths restart when the stamps jump back or the
        positions are in another frame.

        Args:
            places: (3,) [m] by id.
            stamp: of the frame [s].
            frame_id: of the places.
            seconds: positions of this age are forgotten [s].
        """
        if self._last is not None and (stamp < self._last[0] or frame_id != self._last[1]):
            self._paths.clear()
        self._last = stamp, frame_id
        for path in self._paths.values():
            while path and stamp - path[0][0] >= seconds:
                path.popleft()
        for person, place in places.items():
            path = self._paths.setdefault(person, deque(maxlen=_MOST_POINTS))
            if len(path) > 1 and np.linalg.norm(path[-1][1] - path[-2][1]) < _STEP:
                path.pop()
            path.append((stamp, place))
        self._paths = dict([(person, path) for person, path in self._paths.items() if path][-_MOST_PEOPLE:])
        return {person: np.array([place for _, place in self._paths[person]])
                for person in places if person in self._paths}

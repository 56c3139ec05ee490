"""Whether two cameras see the same people at different places, by how these move.

Cameras that never see anybody at one place may look at different parts of a room, or one of them may stand elsewhere
than it is believed to. In the second case the joints that one of them measures of somebody over a few seconds become
those that the other measures by one rigid motion of the camera.
"""
from collections import deque
from typing import Deque, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_fusion.constants import FUSION, WayConstants
from openpose_ros_fusion.observations import Sighting
from skeleton_extract_3d.people import MEASURED


class _Sample(NamedTuple):
    """What two cameras with depth saw at a time [s], at which they had nobody in common."""

    stamp: float
    first: Sighting
    second: Sighting


class Ways:
    """The people of two cameras that have nobody in common; not thread-safe."""

    def __init__(self, constants: WayConstants = FUSION.ways) -> None:
        self._constants = constants
        self._samples: Deque[_Sample] = deque()
        self._apart: Optional[float] = None

    def add(self, stamp: float, first: Sighting, second: Sighting) -> None:
        """Note what the cameras saw, if it is long enough since the last time."""
        if self._samples and 0 <= stamp - self._samples[-1].stamp < self._constants.period:
            return
        self._samples.append(_Sample(stamp, first, second))
        self._apart = None
        self.forget_before(stamp)

    def forget_before(self, stamp: float) -> None:
        """Forget what was seen long before a time [s], or after it."""
        while self._samples and not 0 <= stamp - self._samples[0].stamp <= self._constants.memory:
            self._samples.popleft()
            self._apart = None

    def clear(self) -> None:
        """Forget everything."""
        self._samples.clear()
        self._apart = None

    @property
    def apart(self) -> float:
        """Median distance of the joints of people who move as one [m]; NaN: nobody does, or nobody moves enough."""
        if self._apart is None:
            ones = {number for sample in self._samples for number in sample.first.ids.tolist()}
            others = {number for sample in self._samples for number in sample.second.ids.tolist()}
            found = [self._distance(one, other) for one in ones for other in others]
            self._apart = min((distance for distance in found if np.isfinite(distance)), default=np.nan)
        return self._apart

    def _distance(self, one: int, other: int) -> float:
        """Return how far apart the joints of a person of each camera are [m]; NaN where they do not move as one."""
        constants = self._constants
        both = [(sample.stamp, _measured(sample.first, one), _measured(sample.second, other))
                for sample in self._samples if one in sample.first.ids and other in sample.second.ids]
        if not both or both[-1][0] - both[0][0] < constants.least_time:
            return np.nan
        first, second = (np.array([sample[side] for sample in both]) for side in (1, 2))
        known = np.isfinite(first).all(axis=2) & np.isfinite(second).all(axis=2)
        some = known.any(axis=1)
        if known.sum() < constants.least_joints:
            return np.nan
        middles = np.array([joints[row].mean(axis=0) for joints, row in zip(first[some], known[some])])
        apart = float(np.median(np.linalg.norm(first - second, axis=2)[known]))
        if apart > constants.most_apart or np.sqrt(middles.var(axis=0).sum()) < constants.least_walk:
            return np.nan
        rotation, translation = rigid_transform(first[known], second[known], np.ones(known.sum()))
        left = np.linalg.norm(first[known] @ rotation.T + translation - second[known], axis=1)
        turned = np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1))
        return apart if np.median(left) <= constants.gate and turned <= constants.most_turned else np.nan


def _measured(sighting: Sighting, number: int) -> np.ndarray:
    """Return the joints of a person that were measured, (18, 3) [m]; NaN elsewhere."""
    row = int(np.flatnonzero(sighting.ids == number)[0])
    return np.where((sighting.status[row] == MEASURED)[:, np.newaxis], sighting.positions[row], np.nan)


def rigid_transform(points: np.ndarray, truth: np.ndarray, weights: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the rotation (3, 3) and translation (3,) that move points onto the truth with least squared distances.

    Kabsch, Acta Crystallographica A32, 922 (1976); no mirror image, as in Umeyama, PAMI 13, 376 (1991). SciPy has it
    from 1.4 on.

    Args:
        points, truth: (N, 3) [m].
        weights: (N,) not negative.
    """
    share = weights / weights.sum()
    middle, middle_truth = share @ points, share @ truth
    u, _, vt = np.linalg.svd(((truth - middle_truth) * share[:, None]).T @ (points - middle))
    rotation = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return rotation, middle_truth - rotation @ middle

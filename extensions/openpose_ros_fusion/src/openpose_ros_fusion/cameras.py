"""How each camera agrees with the others: its pose and its clock.

Two cameras i and j measured a joint at x_i and x_j, moved to one stamp; it moves at v. If the clocks are to be
corrected by c_i and c_j, and what i measures lies beside what j measures by b,

    x_i - x_j = b + (c_i - c_j) v,

whose least squares over some seconds give |b|, the error of the pair, and the difference of their clocks. Of a camera
without depth, x is the point of the ray that is nearest to the fused joint, and what lies along the ray is left out of
both sides.
"""
import itertools
from collections import deque
from typing import Deque, Dict, Mapping, NamedTuple, Sequence, Tuple

import numpy as np
from scipy.sparse.csgraph import connected_components

from openpose_ros_fusion.association import CameraPerson
from openpose_ros_fusion.constants import FUSION, CameraConstants
from openpose_ros_fusion.observations import Sighting
from skeleton_extract_3d.people import MEASURED, People3D

# A pair of cameras, by name.
_Pair = Tuple[str, str]
# By track (3, 18, 3): joints [m], directions along which they are not known (zero: they are in all), velocities [m/s].
_Measured = Mapping[int, np.ndarray]


class CameraJudgement(NamedTuple):
    """What is known of a camera by its people.

    Attributes:
        error: [m] distance of its people from those of the others; NaN where no other camera sees them.
        clock_offset: [s] to be added to its stamps; NaN where no person moves, or no other camera sees it.
        disagrees: whether it is beside the others, and not they; of two cameras, both.
    """

    error: float = np.nan
    clock_offset: float = np.nan
    disagrees: bool = False


class CameraJudge:
    """Compares the cameras of a rig, by name, the more trusted first; not thread-safe."""

    def __init__(self, cameras: Sequence[str], constants: CameraConstants = FUSION.cameras) -> None:
        self._names, self._constants = tuple(cameras), constants
        # stamps, and differences x_i - x_j [m] and velocities v [m/s] of joints then, both (N, 3)
        self._compared: Dict[_Pair, Deque[Tuple[float, np.ndarray, np.ndarray]]] = {
            pair: deque() for pair in itertools.combinations(self._names, 2)}

    def update(self, sightings: Sequence[Sighting], people: People3D, stamp: float,
               known: Mapping[CameraPerson, int]) -> None:
        """Take what the cameras see at a time [s], the fused people then, and their ids by persons of the cameras."""
        fused = {number: (joints, velocity) for number, joints, velocity in zip(
            people.ids.tolist(), people.xyz.astype(np.float64), people.velocity.astype(np.float64))}
        seen = {sighting.camera: _measured(sighting, stamp, fused, known) for sighting in sightings}
        for pair, compared in self._compared.items():
            if pair[0] in seen and pair[1] in seen:
                compared.append((stamp, *_differences(seen[pair[0]], seen[pair[1]], self._constants.outlier)))
            while compared and not 0 <= stamp - compared[0][0] <= self._constants.memory:
                compared.popleft()

    def judgements(self) -> Dict[str, CameraJudgement]:
        """Return what is known of each camera now."""
        solved = {pair: self._solved(pair) for pair in self._compared}
        solved = {pair: found for pair, found in solved.items() if np.isfinite(found[0])}
        agree = np.array([[solved.get((first, second), (np.inf,))[0] <= self._constants.wrong
                           for second in self._names] for first in self._names])
        _, groups = connected_components(agree, directed=False)
        sizes = np.bincount(groups)
        clock = self._best_clock(solved)
        found = {}
        for name, group in zip(self._names, groups):
            error = min((error for pair, (error, _) in solved.items() if name in pair), default=np.nan)
            offset = (0.0 if name == clock else -solved[clock, name][1] if (clock, name) in solved
                      else solved.get((name, clock), (np.nan, np.nan))[1])
            in_largest = group == sizes.argmax() and sizes[group] > 1
            found[name] = (CameraJudgement(error, offset, error > self._constants.wrong and not in_largest)
                           if np.isfinite(error) else CameraJudgement())
        return found

    def _solved(self, pair: _Pair) -> Tuple[float, float]:
        """Return the error of a pair [m] and the difference of its clocks [s]; NaN where they are not known."""
        none = np.zeros((0, 3))
        apart, velocities = (np.concatenate([none, *(one[which] for one in self._compared[pair])]) for which in (1, 2))
        if len(apart) < self._constants.least_joints:
            return np.nan, np.nan
        # what v varies by beside its mean tells the clock; b holds the rest
        beside = velocities - velocities.mean(axis=0)
        moving = float((beside ** 2).sum())
        if moving > 0:
            clock = float((apart * beside).sum()) / moving
            offset = apart.mean(axis=0) - clock * velocities.mean(axis=0)
            left = apart - offset - clock * velocities
            if np.sqrt((left ** 2).sum() / max(left.size - 4, 1) / moving) <= self._constants.clock_error:
                return float(np.linalg.norm(offset)), clock
        return float(np.linalg.norm(apart.mean(axis=0))), np.nan

    def _best_clock(self, solved: Mapping[_Pair, Tuple[float, float]]) -> str:
        """Return the camera from whose clock those of the others differ least."""
        def differences(name: str) -> Tuple[int, float]:
            clocks = [abs(clock) for pair, (_, clock) in solved.items() if name in pair and np.isfinite(clock)]
            return -len(clocks), float(np.median(clocks)) if clocks else 0.0
        return min(self._names, key=differences)


def _differences(first: _Measured, second: _Measured, outlier: float) -> Tuple[np.ndarray, np.ndarray]:
    """Return x_i - x_j [m] and v [m/s] of the joints that two cameras measured of the same people, both (N, 3)."""
    common = [person for person in first if person in second]
    (joints, rays, moving), (others, other_rays, _) = (
        np.concatenate([np.zeros((3, 0, 3)), *(seen[person] for person in common)], axis=1)
        for seen in (first, second))
    apart = joints - others
    for along in (rays, other_rays):
        apart, moving = (value - (value * along).sum(axis=1, keepdims=True) * along for value in (apart, moving))
    with np.errstate(invalid='ignore'):
        used = np.isfinite(moving).all(axis=1) & (np.linalg.norm(apart, axis=1) <= outlier)
    return apart[used], moving[used]


def _measured(sighting: Sighting, stamp: float, fused: Mapping[int, Tuple[np.ndarray, np.ndarray]],
              known: Mapping[CameraPerson, int]) -> _Measured:
    """Return the joints that a camera measured, moved to the stamp, by fused person."""
    result = {}
    for row, number in enumerate(sighting.ids.tolist()):
        person = known.get((sighting.camera, number), -1)
        if person not in fused:
            continue
        joints, velocities = fused[person]
        moved = (stamp - sighting.stamp) * velocities
        rays = sighting.directions[row]
        on_ray = ((joints - moved - sighting.origin) * rays).sum(axis=1, keepdims=True) * rays + sighting.origin
        has_depth = np.isfinite(sighting.positions[row])
        position = np.where(has_depth, sighting.positions[row], on_ray) + moved
        measured = (sighting.status[row] == MEASURED)[:, np.newaxis]
        result[person] = np.stack([np.where(measured, position, np.nan), np.where(has_depth, 0.0, rays), velocities])
    return result

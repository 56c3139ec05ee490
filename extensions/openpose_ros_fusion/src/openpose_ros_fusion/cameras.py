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
from dataclasses import dataclass
from typing import Deque, Dict, List, Mapping, NamedTuple, Sequence, Set, Tuple

import numpy as np

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


@dataclass(frozen=True, eq=False)
class _Sums:
    """Normal equations of one update for a pair of cameras: unknowns b (3,) [m] and c [s]."""

    stamp: float
    matrix: np.ndarray
    right: np.ndarray
    squares: float
    count: int


class CameraJudge:
    """Compares the cameras of a rig, by name, the more trusted first; not thread-safe."""

    def __init__(self, cameras: Sequence[str], constants: CameraConstants = FUSION.cameras) -> None:
        self._names, self._constants = tuple(cameras), constants
        self._sums: Dict[_Pair, Deque[_Sums]] = {pair: deque() for pair in itertools.combinations(self._names, 2)}

    def update(self, sightings: Sequence[Sighting], people: People3D, stamp: float,
               known: Mapping[CameraPerson, int]) -> None:
        """Take what the cameras see at a time [s], the fused people then, and their ids by persons of the cameras."""
        fused = {number: (joints, velocity) for number, joints, velocity in zip(
            people.ids.tolist(), people.xyz.astype(np.float64), people.velocity.astype(np.float64))}
        seen = {sighting.camera: _measured(sighting, stamp, fused, known) for sighting in sightings}
        for pair, sums in self._sums.items():
            if pair[0] in seen and pair[1] in seen:
                sums.append(self._compared(seen[pair[0]], seen[pair[1]], stamp))
            while sums and not 0 <= stamp - sums[0].stamp <= self._constants.memory:
                sums.popleft()

    def forget(self, camera: str) -> None:
        """Forget what is known of a camera, as its clock has changed."""
        for pair, sums in self._sums.items():
            if camera in pair:
                sums.clear()

    def judgements(self) -> Dict[str, CameraJudgement]:
        """Return what is known of each camera now."""
        solved = {pair: self._solved(pair, sums) for pair, sums in self._sums.items()}
        solved = {pair: found for pair, found in solved.items() if np.isfinite(found[0])}
        agreeing = self._agreeing([pair for pair, (error, _) in solved.items() if error <= self._constants.wrong])
        return {name: self._judged(name, solved, agreeing) for name in self._names}

    def _compared(self, first: _Measured, second: _Measured, stamp: float) -> _Sums:
        """Return the sums of the joints that two cameras measured of the same people."""
        common = [person for person in first if person in second]
        none = np.zeros((3, 0, 3))
        (joints, rays, moving), (others, other_rays, _) = (
            np.concatenate([none, *(seen[person] for person in common)], axis=1) for seen in (first, second))
        apart = joints - others
        for along in (rays, other_rays):
            apart, moving = (value - (value * along).sum(axis=1, keepdims=True) * along for value in (apart, moving))
        used = np.isfinite(apart).all(axis=1) & np.isfinite(moving).all(axis=1)
        apart, moving = apart[used], moving[used]
        near = np.linalg.norm(apart, axis=1) <= self._constants.outlier
        apart, moving = apart[near], moving[near]
        matrix = np.zeros((4, 4))
        matrix[:3, :3] = len(apart) * np.eye(3)
        matrix[:3, 3] = matrix[3, :3] = moving.sum(axis=0)
        matrix[3, 3] = (moving ** 2).sum()
        return _Sums(stamp, matrix, np.r_[apart.sum(axis=0), (apart * moving).sum()], float((apart ** 2).sum()),
                     len(apart))

    def _solved(self, pair: _Pair, sums: Sequence[_Sums]) -> Tuple[float, float]:
        """Return the error of a pair [m] and the difference of its clocks [s]; NaN where they are not known."""
        count = sum(one.count for one in sums)
        if count < self._constants.least_joints:
            return np.nan, np.nan
        matrix = np.sum([one.matrix for one in sums], axis=0)
        right = np.sum([one.right for one in sums], axis=0)
        # what v varies by beside its mean tells the clock; b holds the rest
        moving = matrix[3, 3] - matrix[:3, 3] @ matrix[:3, 3] / count
        offset = right[:3] / count
        if moving <= 0:
            return float(np.linalg.norm(offset)), np.nan
        clock = (right[3] - matrix[:3, 3] @ offset) / moving
        offset = offset - clock * matrix[:3, 3] / count
        squares = sum(one.squares for one in sums) - right[:3] @ offset - right[3] * clock
        spread = np.sqrt(max(squares, 0.0) / max(3 * count - 4, 1) / moving)
        if spread > self._constants.clock_error:
            return float(np.linalg.norm(right[:3] / count)), np.nan
        return float(np.linalg.norm(offset)), float(clock)

    def _agreeing(self, pairs: Sequence[_Pair]) -> List[str]:
        """Return the largest group of cameras that agree with one another, one after the other."""
        groups: Dict[str, Set[str]] = {name: {name} for name in self._names}
        for first, second in pairs:
            joined = groups[first] | groups[second]
            for name in joined:
                groups[name] = joined
        largest = max(len(group) for group in groups.values())
        return next(sorted(group, key=self._names.index) for group in groups.values() if len(group) == largest)

    def _judged(self, name: str, solved: Mapping[_Pair, Tuple[float, float]], agreeing: Sequence[str]
                ) -> CameraJudgement:
        errors = [error for pair, (error, _) in solved.items() if name in pair]
        if not errors:
            return CameraJudgement()
        disagrees = min(errors) > self._constants.wrong and (name not in agreeing or len(agreeing) < 2)
        clock = self._clock(solved)
        if (clock, name) in solved:
            offset = -solved[clock, name][1]
        else:
            offset = 0.0 if name == clock else solved.get((name, clock), (np.nan, np.nan))[1]
        return CameraJudgement(min(errors), offset, disagrees)

    def _clock(self, solved: Mapping[_Pair, Tuple[float, float]]) -> str:
        """Return the camera from whose clock those of the others differ least."""
        def apart(name: str) -> Tuple[int, float]:
            clocks = [abs(clock) for pair, (_, clock) in solved.items() if name in pair and np.isfinite(clock)]
            return -len(clocks), float(np.median(clocks)) if clocks else 0.0
        return min(self._names, key=apart)


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

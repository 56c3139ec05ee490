"""People in space: the one type that passes between lifting, markers and converters."""
from dataclasses import dataclass
from typing import Any, Tuple

import numpy as np

from openpose_ros_pkg.people import checked_existence
from openpose_ros_pkg.skeletons import SkeletonModel

# Values of `status`, as in openpose_ros_msgs/BodypartDetection_3d.
MISSING, MEASURED, INFERRED = 0, 1, 2


def check_points_of(record: Any, shape: Tuple[int, ...], more: Tuple[Tuple[str, type, Tuple[int, ...]], ...] = ()
                    ) -> None:
    """Give the arrays of a new record their types, and check them: xyz, confidence, status and sigma of its points.

    Args:
        shape: of `status`.
        more: names, types and shapes of other arrays.

    Raises:
        ValueError: an array has the wrong shape, a status is unknown, or status and position disagree.
    """
    for name, dtype, expected in (('xyz', np.float32, (*shape, 3)), ('confidence', np.float32, shape),
                                  ('status', np.uint8, shape), ('sigma', np.float32, shape), *more):
        value: np.ndarray = np.asarray(getattr(record, name), dtype)
        if value.shape != expected:
            raise ValueError(f'{name}: expected {expected}, got {value.shape}')
        object.__setattr__(record, name, value)
    if record.status.max(initial=MISSING) > INFERRED:
        raise ValueError(f'status of a point is {record.status.max()}, expected {MISSING}, {MEASURED} or {INFERRED}')
    if not np.array_equal(record.status != MISSING, np.isfinite(record.xyz).all(axis=-1)):
        raise ValueError('status must be MISSING exactly where x, y and z are not finite')


@dataclass(frozen=True)
class People3D:
    """The joints of P people in one frame of reference.

    Attributes:
        skeleton: names of the K joints.
        xyz: (P, K, 3) float32 [m]; NaN where MISSING.
        confidence: (P, K) float32 [0..1] of the 2D detection; 0 where the joint was not detected.
        status: (P, K) uint8: MISSING, MEASURED or INFERRED.
        sigma: (P, K) float32 [m], root mean square distance of the true position from xyz; of people by one camera with
            depth 95 of 100 joints are within 2 sigma, see `track.calibration`; NaN where MISSING or not estimated.
        ids: (P,) int64 track ids.
        velocity: (P, K, 3) float32 [m/s]; NaN where MISSING or not estimated, which is everywhere by default.
        existence: (P,) float64 probability that each person is there [0..1]; 1 by default.

    Raises:
        ValueError: see `check_points_of` and `checked_existence`.
    """

    skeleton: SkeletonModel
    xyz: np.ndarray
    confidence: np.ndarray
    status: np.ndarray
    sigma: np.ndarray
    ids: np.ndarray
    velocity: np.ndarray = None  # type: ignore[assignment]  # NaN everywhere
    existence: np.ndarray = None  # type: ignore[assignment]  # 1

    def __post_init__(self) -> None:
        people, joints = len(self.xyz), len(self.skeleton.joints)
        if self.velocity is None:
            object.__setattr__(self, 'velocity', np.full((people, joints, 3), np.nan))
        check_points_of(self, (people, joints), (('ids', np.int64, (people,)),
                                                 ('velocity', np.float32, (people, joints, 3))))
        object.__setattr__(self, 'existence', checked_existence(self.existence, people))

    @classmethod
    def empty(cls, skeleton: SkeletonModel) -> 'People3D':
        """Return no person."""
        none = np.zeros((0, len(skeleton.joints)))
        return cls(skeleton, np.zeros((*none.shape, 3)), none, none, none, np.zeros(0))

    def __len__(self) -> int:
        return len(self.xyz)

"""People in space: the one type that passes between lifting, markers and converters."""
from dataclasses import dataclass

import numpy as np

from openpose_ros_pkg.skeletons import SkeletonModel

# Values of `status`, as in openpose_ros_msgs/BodypartDetection_3d.
MISSING, MEASURED, INFERRED = 0, 1, 2


@dataclass(frozen=True)
class People3D:
    """The joints of P people in one frame of reference.

    Attributes:
        skeleton: names of the K joints.
        xyz: (P, K, 3) float32 [m]; NaN where MISSING.
        confidence: (P, K) float32 [0..1] of the 2D detection; 0 where the joint was not detected.
        status: (P, K) uint8: MISSING, MEASURED or INFERRED.
        sigma: (P, K) float32 [m], root mean square distance of the true position from xyz; NaN where MISSING or not
            estimated.
        ids: (P,) int64 track ids.
        velocity: (P, K, 3) float32 [m/s]; NaN where MISSING or not estimated, which is everywhere by default.

    Raises:
        ValueError: an array has the wrong shape, a status is unknown, or status and position disagree.
    """

    skeleton: SkeletonModel
    xyz: np.ndarray
    confidence: np.ndarray
    status: np.ndarray
    sigma: np.ndarray
    ids: np.ndarray
    velocity: np.ndarray = None  # type: ignore[assignment]  # NaN everywhere

    def __post_init__(self) -> None:
        people, joints = len(self.xyz), len(self.skeleton.joints)
        if self.velocity is None:
            object.__setattr__(self, 'velocity', np.full((people, joints, 3), np.nan))
        fields = (('xyz', np.float32, (people, joints, 3)), ('confidence', np.float32, (people, joints)),
                  ('status', np.uint8, (people, joints)), ('sigma', np.float32, (people, joints)),
                  ('ids', np.int64, (people,)), ('velocity', np.float32, (people, joints, 3)))
        for name, dtype, shape in fields:
            value = np.asarray(getattr(self, name), dtype)
            if value.shape != shape:
                raise ValueError(f'{name} of {self.skeleton.name}: expected {shape}, got {value.shape}')
            object.__setattr__(self, name, value)
        if self.status.max(initial=MISSING) > INFERRED:
            raise ValueError(f'status of a joint is {self.status.max()}, expected {MISSING}, {MEASURED} or {INFERRED}')
        if not np.array_equal(self.status != MISSING, np.isfinite(self.xyz).all(axis=2)):
            raise ValueError('status must be MISSING exactly where x, y and z are not finite')

    @classmethod
    def empty(cls, skeleton: SkeletonModel) -> 'People3D':
        """Return no person."""
        none = np.zeros((0, len(skeleton.joints)))
        return cls(skeleton, np.zeros((*none.shape, 3)), none, none, none, np.zeros(0))

    def __len__(self) -> int:
        return len(self.xyz)

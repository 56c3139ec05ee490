"""The frame of the room: z up from the floor on which people stand.

Bodies tell the vertical roughly, from the ankles to the neck. The ankles of feet that stand lie in a plane,
`ankle_height` above the floor. It is fitted to the ankles with robust weights that leave lifted feet out, and with the
vertical of the bodies as a prior. The origin is on the floor below the first camera, which looks along x.
"""
from typing import NamedTuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.body.body import NECK, joint_indices
from skeleton_extract_3d.points.transform import Transform

_ANKLES = joint_indices('left_ankle', 'right_ankle')
_ROUNDS = 10
# Height of the ankle of a foot that stands, with the sole of a shoe (Winter, Biomechanics and Motor Control of Human
# Movement, 2009, fig. 4.1), and above the floor that of feet that do not [m].
_ANKLE_HEIGHT, _LIFT = 0.09, 0.04
# Standard deviation of the floor to the mean of the bodies that stand on it [rad], and of an ankle [m]; this many
# ankles count as one beside that prior.
_UPRIGHT, _NOISE, _DEPENDENT = 0.05, 0.03, 10.0


class Floor(NamedTuple):
    """The floor in the frame of the root.

    Attributes:
        up: (3,) unit vector.
        height: of the origin of that frame over the floor [m].
        ankles: number of ankles of standing feet.
        std: standard deviation of `up` [degrees].
    """

    up: np.ndarray
    height: float
    ankles: int
    std: float


def find_floor(people: np.ndarray) -> Floor:
    """Return the floor below people.

    Args:
        people: (N, 18, 3) [m] in the frame of the root, each at one time; NaN where not known.

    Raises:
        BadInputError: no ankles are visible, or no necks.
    """
    ankles = people[:, _ANKLES].reshape(-1, 3)
    ankles = ankles[np.isfinite(ankles).all(axis=1)]
    if len(ankles) < 10:
        raise BadInputError(f'two cameras see {len(ankles)} ankles together, expected 10 or more: the floor can not be '
                            'found; let people walk where their feet are seen')
    bones = people[:, NECK, None] - people[:, _ANKLES]
    bones = bones[np.isfinite(bones).all(axis=2)]
    if not len(bones):
        raise BadInputError('no neck is seen with an ankle: it can not be told what is up')
    upright = np.median(bones / np.linalg.norm(bones, axis=1, keepdims=True), axis=0)
    upright = upright / np.linalg.norm(upright)
    side = np.linalg.svd(upright[np.newaxis])[2][1:]  # two horizontal directions
    middle = ankles.mean(axis=0)
    rows = np.column_stack([(ankles - middle) @ side.T, np.ones(len(ankles))])
    heights = (ankles - middle) @ upright
    prior = np.diag([_UPRIGHT ** -2, _UPRIGHT ** -2, 0.0])
    plane = np.array([0.0, 0.0, np.percentile(heights, 25)])  # half of all feet stand
    for _ in range(_ROUNDS):
        above = heights - rows @ plane
        weights = np.where(above > _LIFT / 2, 0.0, 1 / (1 + (above / _LIFT) ** 2)) / _NOISE ** 2 / _DEPENDENT
        normal = (rows * weights[:, None]).T @ rows + prior
        plane = np.linalg.solve(normal, (rows * weights[:, None]).T @ heights)
    up = upright - plane[:2] @ side
    up = up / np.linalg.norm(up)
    std = float(np.degrees(np.sqrt(np.trace(np.linalg.inv(normal)[:2, :2]))))
    return Floor(up, float(_ANKLE_HEIGHT - (middle + plane[2] * upright) @ up), int((weights > 0).sum()), std)


def room_frame(floor: Floor) -> Transform:
    """Return the transform from the frame of the root to that of the room: z up, origin on the floor below the root."""
    forwards = np.array([0.0, 0, 1]) - floor.up[2] * floor.up
    if np.linalg.norm(forwards) < 0.1:  # it looks down or up: the lower edge of its image is in front
        forwards = np.array([0.0, -1, 0]) + floor.up[1] * floor.up
    forwards = forwards / np.linalg.norm(forwards)
    return np.stack([forwards, np.cross(floor.up, forwards), floor.up]), np.array([0.0, 0.0, floor.height])

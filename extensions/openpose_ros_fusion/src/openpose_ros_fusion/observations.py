"""What cameras see at a time: people in space, or rays through their keypoints."""
from dataclasses import dataclass
from functools import cached_property
from typing import Optional, Union

import numpy as np

from openpose_ros_fusion.constants import FUSION
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18, SkeletonModel
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.transform import Transform

_JOINTS = len(COCO_18.joints)
# sigma of positions is that in space: three axes.
_AXES = np.sqrt(3.0)


@dataclass(frozen=True, eq=False)
class Sighting:
    """The people whom one camera saw at one time, in the common frame.

    Attributes:
        camera: name.
        stamp: [s].
        origin: (3,) [m], centre of the camera.
        ids: (P,) int64, ids of the camera.
        positions: (P, 18, 3) [m]; of a camera without depth NaN.
        directions: (P, 18, 3), unit vectors from the origin to the joints; NaN where a joint is missing.
        sigma: (P, 18) standard deviation per axis across the line of sight: [m] of positions, [rad] of rays.
        status: (P, 18) uint8, as in People3D; MEASURED for all joints of rays.
        confidence: (P, 18) [0..1].
    """

    camera: str
    stamp: float
    origin: np.ndarray
    ids: np.ndarray
    positions: np.ndarray
    directions: np.ndarray
    sigma: np.ndarray
    status: np.ndarray
    confidence: np.ndarray

    @cached_property
    def has_depth(self) -> bool:
        """Whether the camera measures positions."""
        return bool(np.isfinite(self.positions).any())

    def __len__(self) -> int:
        return len(self.ids)

    def distances(self, joints: np.ndarray) -> np.ndarray:
        """Return the distances of joints (F, 18, 3) from these people, or from their rays, (P, F, 18) [m]."""
        if self.has_depth:
            return np.linalg.norm(joints - self.positions[:, np.newaxis], axis=-1)
        offsets, rays = joints - self.origin, self.directions[:, np.newaxis]
        depth = (offsets * rays).sum(axis=-1, keepdims=True)
        return np.linalg.norm(offsets - np.maximum(depth, 0.0) * rays, axis=-1)

    def information(self, joints: np.ndarray, rows: np.ndarray, variance: Union[float, np.ndarray] = 0.0
                    ) -> np.ndarray:
        """Return the inverse covariances of some people's joints, if these are at (N, 18, 3), (N, 18, 3, 3) [1/m^2].

        Zero where a joint is missing.

        Args:
            variance: of what else the joints err by, per axis, (N, 18) or of all [m^2].
        """
        estimate, directions, sigma = FUSION.estimate, self.directions[rows], self.sigma[rows]
        distance = 1.0 if self.has_depth else np.linalg.norm(joints - self.origin, axis=-1)
        across = (1.0 / ((estimate.across * sigma * distance) ** 2 + variance))[..., np.newaxis, np.newaxis]
        along = 0.0
        if self.has_depth:
            along = (1.0 / ((estimate.along * sigma) ** 2 + variance))[..., np.newaxis, np.newaxis]
        result = across * np.eye(3) + (along - across) * directions[..., :, np.newaxis] * directions[..., np.newaxis, :]
        return np.where(np.isfinite(result), result, 0.0)

    def points(self, rows: np.ndarray) -> np.ndarray:
        """Return a point of which the information of `information` holds: the position, or the centre of the camera."""
        positions = self.positions[rows]
        return np.where(np.isfinite(positions), positions, self.origin)


def from_space(camera: str, stamp: float, people: People3D, pose: Transform) -> Sighting:
    """Return the people in space of a camera in the common frame.

    Args:
        people: in the optical frame of the camera; joints that COCO_18 has not are left out.
        pose: from that frame to the common one.
    """
    rotation, origin = np.asarray(pose[0], np.float64), np.asarray(pose[1], np.float64)
    positions = _in_coco(people.xyz.astype(np.float64), people.skeleton, np.nan) @ rotation.T + origin
    directions = positions - origin
    with np.errstate(invalid='ignore', divide='ignore'):
        directions = directions / np.linalg.norm(directions, axis=2, keepdims=True)
    sigma = _in_coco(people.sigma.astype(np.float64), people.skeleton, np.nan) / _AXES
    status = _in_coco(people.status, people.skeleton, MISSING)
    with np.errstate(invalid='ignore'):
        sigma = np.where(sigma > 0, np.maximum(sigma, FUSION.estimate.least_sigma), FUSION.estimate.unknown_sigma)
    return Sighting(camera, stamp, origin, people.ids, positions, directions,
                    np.where(status == MISSING, np.nan, sigma), status,
                    _in_coco(people.confidence, people.skeleton, 0.0))


def from_image(camera: str, stamp: float, people: People2D, model: CameraModel, pose: Transform,
               sigma: Optional[float] = None) -> Sighting:
    """Return the rays through the keypoints of a camera without depth, in the common frame.

    Args:
        people: pixels of the camera's image, with ids; joints that COCO_18 has not are left out.
        pose: from the optical frame to the common one.
        sigma: error of a keypoint per axis [px]; None: `EstimateConstants.pixel_sigma`.
    """
    rotation, origin = np.asarray(pose[0], np.float64), np.asarray(pose[1], np.float64)
    pixels = _in_coco(people.xy, people.skeleton, np.nan)
    rays = model.rays(pixels.reshape(-1, 2)).reshape(len(people), _JOINTS, 3)
    directions = rays / np.linalg.norm(rays, axis=2, keepdims=True) @ rotation.T
    sigma = FUSION.estimate.pixel_sigma if sigma is None else sigma
    angle = sigma / float(np.sqrt(model.matrix[0, 0] * model.matrix[1, 1]))
    known = np.isfinite(directions).all(axis=2)
    return Sighting(camera, stamp, origin, people.ids, np.full(directions.shape, np.nan), directions,
                    np.where(known, angle, np.nan), np.where(known, MEASURED, MISSING).astype(np.uint8),
                    _in_coco(people.confidence, people.skeleton, 0.0))


def _in_coco(values: np.ndarray, skeleton: SkeletonModel, missing: float) -> np.ndarray:
    """Return values (P, K, ...) of the joints of a joint set for those of COCO_18, (P, 18, ...)."""
    if skeleton == COCO_18:
        return values
    result = np.full((len(values), _JOINTS, *values.shape[2:]), missing, values.dtype)
    for row, joint in enumerate(COCO_18.joints):
        if joint in skeleton.index:
            result[:, row] = values[:, skeleton.index[joint]]
    return result


def is_inferred(sighting: Sighting) -> np.ndarray:
    """Return which joints a camera did not see but inferred, (P, 18) bool."""
    return sighting.status == INFERRED

"""What cameras see at a time: people in space, or rays through their keypoints; and how keypoints lie beside joints.

A camera with depth measures a joint x at x + B b + a r, one without depth at x + B b: networks put keypoints beside the
centres of joints by an offset b that turns with the body, whose axes are the columns of B, and the depth under the skin
that a camera alone adds is too great by a along the line of sight r. Both are means over people
(`ShapeConstants.keypoints`).
"""
from dataclasses import dataclass, replace
from functools import cached_property
from typing import List, Union

import numpy as np

from openpose_ros_fusion.constants import FUSION, EstimateConstants, ShapeConstants
from openpose_ros_pkg.people import People2D, distinct_ids, values_in
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.body import HIPS, SHOULDERS
from skeleton_extract_3d.people import MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.transform import Transform

# sigma of positions is that in space: three axes.
_AXES = np.sqrt(3.0)


@dataclass(frozen=True, eq=False)
class Sighting:
    """The people that one camera sees at one time, in the common frame.

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

    def select(self, rows: np.ndarray) -> 'Sighting':
        """Return some of the people, by indices."""
        return replace(self, **{name: getattr(self, name)[rows] for name in
                                ('ids', 'positions', 'directions', 'sigma', 'status', 'confidence')})

    def distinct(self) -> 'Sighting':
        """Return the people of rays without those that a detector found twice: half of their joints are the same."""
        if self.has_depth:
            return self
        angles = np.linalg.norm(self.directions[:, np.newaxis] - self.directions, axis=3)
        with np.errstate(invalid='ignore'):
            common, same = np.isfinite(angles).sum(axis=2), (angles < self.sigma).sum(axis=2)
        kept: List[int] = []
        for person in np.argsort(-np.isfinite(self.sigma).sum(axis=1), kind='stable').tolist():
            if not any(2 * same[person, other] >= common[person, other] > 0 for other in kept):
                kept.append(person)
        return self.select(np.array(sorted(kept), int))

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
        directions, sigma = self.directions[rows], self.sigma[rows]
        distance = 1.0 if self.has_depth else np.linalg.norm(joints - self.origin, axis=-1)
        across = (1.0 / ((sigma * distance) ** 2 + variance))[..., np.newaxis, np.newaxis]
        along = across if self.has_depth else 0.0
        result = across * np.eye(3) + (along - across) * directions[..., :, np.newaxis] * directions[..., np.newaxis, :]
        return np.where(np.isfinite(result), result, 0.0)

    def points(self, rows: np.ndarray) -> np.ndarray:
        """Return a point of which the information of `information` holds: the position, or the centre of the camera."""
        positions = self.positions[rows]
        return np.where(np.isfinite(positions), positions, self.origin)


class KeypointOffsets:
    """Where keypoints lie beside joints; see the module's equations."""

    def __init__(self, constants: ShapeConstants = FUSION.shape) -> None:
        by_name = {name: np.array(values) for name, *values in constants.keypoints}
        rows = np.array([by_name[joint.replace('left_', '').replace('right_', '')] for joint in COCO_18.joints])
        rows[[joint.startswith('right_') for joint in COCO_18.joints], 0] *= -1
        self._beside, self._deeper = rows[:, :3], rows[:, 3]  # (18, 3) left, up and forwards, (18,) deeper [m]

    def of_bodies(self, joints: np.ndarray) -> np.ndarray:
        """Return B b of the joints of people (P, 18, 3) [m], of the same shape; zero where the axes are not known."""
        offsets = np.matmul(self._beside, np.swapaxes(body_axes(joints), 1, 2))
        return np.where(np.isfinite(offsets), offsets, 0.0)

    def of_depth(self, directions: np.ndarray) -> np.ndarray:
        """Return a r of joints seen along directions (P, 18, 3), of the same shape [m]; zero where missing."""
        offsets = self._deeper[:, np.newaxis] * directions
        return np.where(np.isfinite(offsets), offsets, 0.0)


def body_axes(joints: np.ndarray) -> np.ndarray:
    """Return the directions left, up and forwards of bodies, the columns of (P, 3, 3); NaN where they are not known.

    Args:
        joints: (P, 18, 3) [m]; up leads from the hips to the shoulders.
    """
    shoulders, hips = joints[:, SHOULDERS], joints[:, HIPS]
    up = shoulders.mean(axis=1) - hips.mean(axis=1)
    left = shoulders[:, 0] - shoulders[:, 1]
    with np.errstate(invalid='ignore', divide='ignore'):
        up = up / np.linalg.norm(up, axis=1, keepdims=True)
        left = left - (left * up).sum(axis=1, keepdims=True) * up
        width = np.linalg.norm(left, axis=1, keepdims=True)
        left = np.where(width > 0, left / width, np.nan)
    return np.stack([left, up, np.cross(left, up)], axis=2)


def from_space(camera: str, stamp: float, people: People3D, pose: Transform,
               constants: EstimateConstants = FUSION.estimate) -> Sighting:
    """Return the people in space of a camera in the common frame.

    Args:
        people: in the optical frame of the camera; joints that COCO_18 has not are left out.
        pose: from that frame to the common one.
    """
    rotation, origin = (np.asarray(part, np.float64) for part in pose)
    positions, sigma = (values_in(values.astype(np.float64), people.skeleton, COCO_18, np.nan)
                        for values in (people.xyz, people.sigma))
    positions = positions @ rotation.T + origin
    status = values_in(people.status, people.skeleton, COCO_18, MISSING)
    with np.errstate(invalid='ignore', divide='ignore'):
        directions = positions - origin
        directions = directions / np.linalg.norm(directions, axis=2, keepdims=True)
        sigma = np.where(sigma > 0, np.maximum(sigma / _AXES, constants.common_sigma), constants.unknown_sigma)
    return Sighting(camera, stamp, origin, distinct_ids(people.ids), positions, directions,
                    np.where(status == MISSING, np.nan, sigma), status,
                    values_in(people.confidence, people.skeleton, COCO_18, 0.0))


def from_image(camera: str, stamp: float, people: People2D, model: CameraModel, pose: Transform,
               constants: EstimateConstants = FUSION.estimate) -> Sighting:
    """Return the rays through the keypoints of a camera without depth, in the common frame; as `from_space`.

    Args:
        people: pixels of the camera's image, with ids.
    """
    rotation, origin = (np.asarray(part, np.float64) for part in pose)
    pixels = values_in(people.xy, people.skeleton, COCO_18, np.nan)
    rays = model.rays(pixels.reshape(-1, 2)).reshape(*pixels.shape[:2], 3)
    directions = rays / np.linalg.norm(rays, axis=2, keepdims=True) @ rotation.T
    angle = constants.pixel_sigma / float(np.sqrt(model.matrix[0, 0] * model.matrix[1, 1]))
    known = np.isfinite(directions).all(axis=2)
    return Sighting(camera, stamp, origin, distinct_ids(people.ids), np.full(directions.shape, np.nan), directions,
                    np.where(known, angle, np.nan), np.where(known, MEASURED, MISSING).astype(np.uint8),
                    values_in(people.confidence, people.skeleton, COCO_18, 0.0))

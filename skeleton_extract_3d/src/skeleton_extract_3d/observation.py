"""What a frame shows of each person: keypoints on the grid of the points, their rays, and the surfaces around them."""
from typing import NamedTuple, Tuple

import numpy as np

from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d import surfaces
from skeleton_extract_3d.body import ENDS, HIPS, MIDDLES, NECK, ROOTS, SHOULDERS
from skeleton_extract_3d.camera import CameraModel
from skeleton_extract_3d.point_grid import PointGrid

# A person of unknown size is looked at as from here [m].
_USUAL_DEPTH = 3.0


class Observation(NamedTuple):
    """P people of one frame, with the joints of COCO_18.

    Attributes:
        uv: (P, 18, 2) [px of the points' grid], NaN where there is no keypoint.
        scores: (P, 18), 0 where there is none.
        known: (P, 18) bool.
        rays: (P, 18, 3) with z = 1; of joints without a keypoint, a guess near the rest of the person.
        depth: (P, 18, 25) samples of the surfaces [m].
        size: (P,) depth at which an adult looks as large [m]; infinite where unknown.
        focal: focal length [px], mean of both axes.
    """

    uv: np.ndarray
    scores: np.ndarray
    known: np.ndarray
    rays: np.ndarray
    depth: np.ndarray
    size: np.ndarray
    focal: float

    @property
    def known_rays(self) -> np.ndarray:
        """(P, 18, 3) rays, NaN where there is no keypoint."""
        return np.where(self.known[..., None], self.rays, np.nan)


def observe(people: People2D, image_size: Tuple[int, int], points: PointGrid, camera: CameraModel) -> Observation:
    """Look at each person's surroundings in the points.

    Args:
        people: keypoints [px of the image], each person with at least one.
        image_size: width and height of the image [px].
        camera: of the points.
    """
    keypoints = keypoints_in(people.keypoints, people.skeleton, COCO_18)
    uv = grid_positions(keypoints[..., :2], image_size, (points.width, points.height))
    known = np.isfinite(uv).all(axis=2)
    scores = np.where(known, keypoints[..., 2].astype(np.float64), 0.0)
    rays = camera.rays(_with_guesses(uv, known).reshape(-1, 2)).reshape(*known.shape, 3)
    # where the lens can not be inverted there is no ray
    known &= np.isfinite(rays).all(axis=2)
    scores[~known], uv[~known] = 0.0, np.nan
    rays = np.where(np.isfinite(rays), rays, [0.0, 0.0, 1.0])
    focal = float(camera.matrix[0, 0] + camera.matrix[1, 1]) / 2
    size = surfaces.size_depth(np.where(known[..., None], rays, np.nan), scores)
    radius = np.clip(surfaces.WINDOW * focal / np.where(np.isfinite(size), size, _USUAL_DEPTH), *surfaces.WINDOW_LIMITS)
    return Observation(uv, scores, known, rays, surfaces.window_depths(points, uv, radius), size, focal)


def grid_positions(xy: np.ndarray, image_size: Tuple[int, int], grid_size: Tuple[int, int]) -> np.ndarray:
    """Return where (..., 2) positions in the image [px] lie on another grid of the same view, float64 [px]."""
    scale = np.asarray(grid_size, np.float64) / np.asarray(image_size)
    return (np.asarray(xy, np.float64) + 0.5) * scale - 0.5


def _with_guesses(uv: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the positions with missing ones put where the next joint towards the trunk is, (P, 18, 2) [px]."""
    count = np.maximum(known.sum(axis=1), 1)[:, None]
    middle = np.where(known[..., None], uv, 0.0).sum(axis=1) / count
    uv = uv.copy()

    def fill(joint: int, *sources: np.ndarray) -> None:
        for source in sources:
            missing = ~np.isfinite(uv[:, joint, 0])
            if not missing.any():
                return
            uv[missing, joint] = source[missing]

    for one, other in (SHOULDERS, SHOULDERS[::-1], HIPS, HIPS[::-1]):
        fill(one, uv[:, other], uv[:, NECK] if one in SHOULDERS else middle, middle)
    fill(NECK, uv[:, SHOULDERS].mean(axis=1))
    for joint, parent in (*zip(MIDDLES, ROOTS), *zip(ENDS, MIDDLES)):
        fill(joint, uv[:, parent])
    uv[~np.isfinite(uv)] = 0.0  # the head's joints: their rays are not used
    return uv

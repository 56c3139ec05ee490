"""From the outputs of MoveNet, SimCC (RTMPose) and PP-TinyPose, which see one person on a crop, to the person."""
from typing import Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.people import Poses

# Side of the Gaussian that smooths a map, [cells]: PaddleDetection, keypoint_postprocess.py, get_final_preds.
_KERNEL = 3


def decode_single_person(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int]) -> Poses:
    """Return the person, or none, of MoveNet for one person.

    It gives (1, 17, 3): y, x as shares of the input, and score. The person's score is the mean of those of the joints.
    """
    joints = np.asarray(outputs[0], np.float64)[..., [1, 0, 2]]
    joints[..., :2] = joints[..., :2] * net_size - 0.5
    scores = joints[..., 2].mean(axis=1)
    sure = scores >= least
    return Poses(joints[sure], scores[sure])


def decode_simcc(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int]) -> Poses:
    """Return the person on a crop, or none; its score is the mean of those of COCO's joints, the first 17 points.

    A point lies where its row of bins along x, and that along y, has the greatest value; a side of the input has a
    fixed number of bins per pixel (2 in all of RTMPose). Its score is the smaller of both values; 0 or less: missing.
    mmpose 1.3.2, `SimCCLabel.decode` and `get_simcc_maximum`, and mmdeploy 1.3.1, codebase/mmpose/codecs; rtmlib takes
    the mean of both. Values are about 1 at most: they were trained on Gaussians of the height 1.

    Args:
        outputs: (K, bins along x) and (K, bins along y).
    """
    along_x, along_y = outputs
    places = [axis.argmax(axis=1) * (side / axis.shape[1]) for axis, side in zip((along_x, along_y), net_size)]
    values = np.minimum(along_x.max(axis=1), along_y.max(axis=1)).astype(np.float64)
    points = np.stack([*places, np.clip(np.where(np.isfinite(values), values, 0), 0, 1)], axis=1)[np.newaxis]
    scores = points[:, :17, 2].mean(axis=1)
    sure = scores >= least
    return Poses(points[sure], scores[sure])


def heat_map_points(maps: np.ndarray) -> np.ndarray:
    """Return the points (K, 3) float64 of maps (K, H, W): x, y [cells] and score, the greatest value of a map.

    Each lies where its smoothed map is greatest, refined by a Newton step on the logarithm (DARK: Zhang et al., CVPR
    2020), as in PaddleDetection's `HRNetPostProcess`; within two cells of the border it is not refined.
    """
    height, width = maps.shape[1:]
    rows, columns = np.divmod(maps.reshape(len(maps), -1).argmax(axis=1), width)
    scores = maps.reshape(len(maps), -1).max(axis=1).astype(np.float64)
    points = np.stack([columns, rows, np.where(np.isfinite(scores), scores, 0)], axis=1).astype(np.float64)
    for point, one, x, y in zip(points, maps, columns, rows):
        if 1 < x < width - 2 and 1 < y < height - 2 and point[2] > 0:
            # of the smoothed map around the point; its scale does not matter to the step
            near = cv2.GaussianBlur(np.ascontiguousarray(one, np.float64), (_KERNEL, _KERNEL), 0,
                                    borderType=cv2.BORDER_CONSTANT)[y - 2:y + 3, x - 2:x + 3]
            log = np.log(np.maximum(near, 1e-10))
            slope = 0.5 * np.array([log[2, 3] - log[2, 1], log[3, 2] - log[1, 2]])
            cross = 0.25 * (log[3, 3] - log[1, 3] - log[3, 1] + log[1, 1])
            bend = np.array([[0.25 * (log[2, 4] - 2 * log[2, 2] + log[2, 0]), cross],
                             [cross, 0.25 * (log[4, 2] - 2 * log[2, 2] + log[0, 2])]])
            if np.linalg.det(bend) != 0:
                point[:2] -= np.linalg.solve(bend, slope)
    return points


def decode_heat_maps(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int]) -> Poses:
    """Return the person on a crop, or none; its score is the mean of the points'.

    Scores are the squares of the maps' values: so they are as high as those of MoveNet Thunder on the same crops.
    """
    maps = outputs[0]
    points = heat_map_points(maps)[np.newaxis]
    points[..., :2] *= np.array(net_size) / maps.shape[:0:-1]
    points[..., 2] = np.clip(points[..., 2], 0, 1) ** 2
    scores = points[..., 2].mean(axis=1)
    return Poses(points[scores >= least], scores[scores >= least])

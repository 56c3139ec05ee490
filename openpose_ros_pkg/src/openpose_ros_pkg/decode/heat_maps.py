"""From the heat maps of a network that sees one person on a crop (PP-TinyPose) to the person."""
from typing import Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.decode.points import Decoded

# Side of the Gaussian that smooths a map, [cells]: PaddleDetection, keypoint_postprocess.py, get_final_preds.
_KERNEL = 3


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


def decode_heat_maps(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int]) -> Decoded:
    """Return the person on a crop, or none; its score is the mean of the points'.

    Scores are the squares of the maps' values: so they are as high as those of MoveNet Thunder on the same crops.
    """
    maps = outputs[0]
    points = heat_map_points(maps)[np.newaxis]
    points[..., :2] *= np.array(net_size) / maps.shape[:0:-1]
    points[..., 2] = np.clip(points[..., 2], 0, 1) ** 2
    scores = points[..., 2].mean(axis=1)
    return Decoded(points[scores >= least], scores[scores >= least])

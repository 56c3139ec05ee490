"""From the outputs of SimCC networks (RTMPose), which see one person on a crop, to the person."""
from typing import Sequence, Tuple

import numpy as np

from openpose_ros_pkg.decode.points import Decoded


def simcc_points(outputs: Sequence[np.ndarray], net_size: Tuple[int, int]) -> np.ndarray:
    """Return the points (K, 3) float64: x, y [px of the input, an integer is a pixel's centre] and score.

    A point lies where its row of bins along x, and that along y, has the greatest value; a side of the input has a
    fixed number of bins per pixel (2 in all of RTMPose). Its score is the smaller of both values; 0 or less: missing.
    mmpose 1.3.2, `SimCCLabel.decode` and `get_simcc_maximum`, and mmdeploy 1.3.1, codebase/mmpose/codecs; rtmlib takes
    the mean of both. Values are about 1 at most: they were trained on Gaussians of the height 1.

    Args:
        outputs: (K, bins along x) and (K, bins along y).
        net_size: (width, height) of the input [px].
    """
    along_x, along_y = outputs
    places = [axis.argmax(axis=1) * (side / axis.shape[1]) for axis, side in zip((along_x, along_y), net_size)]
    scores = np.minimum(along_x.max(axis=1), along_y.max(axis=1)).astype(np.float64)
    return np.stack([*places, np.where(np.isfinite(scores), scores, 0)], axis=1)


def decode_simcc(outputs: Sequence[np.ndarray], least: float, net_size: Tuple[int, int]) -> Decoded:
    """Return the person on a crop, or none; its score is the mean of those of COCO's joints, the first 17 points."""
    points = simcc_points(outputs, net_size)[np.newaxis]
    points[..., 2] = np.clip(points[..., 2], 0, 1)
    scores = points[:, :17, 2].mean(axis=1)
    sure = scores >= least
    return Decoded(points[sure], scores[sure])

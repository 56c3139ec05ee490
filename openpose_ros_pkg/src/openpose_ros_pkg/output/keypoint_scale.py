"""OpenPose's `keypoint_scale`: the units in which keypoints are published."""
from dataclasses import dataclass
from typing import Tuple

import numpy as np

from openpose_ros_pkg.params.parameters import Parameters, parameter


@dataclass(frozen=True)
class KeypointScaleParams(Parameters):
    """Units of the keypoints on the topic `detected_poses_keypoints`; the service always answers in image pixels."""

    keypoint_scale: int = parameter(
        0, 'Units on the topic detected_poses_keypoints: 0 pixels of the input image, 1 pixels of the net output, '
           '2 pixels of the final output, 3 the range [0, 1], 4 the range [-1, 1].', choices=(0, 1, 2, 3, 4))
    net_output_width: int = parameter(
        656, 'Width of the net output that keypoint_scale 1 refers to.', unit='px', minimum=1)
    net_output_height: int = parameter(
        368, 'Height of the net output that keypoint_scale 1 refers to.', unit='px', minimum=1)
    output_width: int = parameter(
        1024, 'Width of the final output that keypoint_scale 2 refers to; -1: as the image.', unit='px', minimum=-1)
    output_height: int = parameter(
        1024, 'Height of the final output that keypoint_scale 2 refers to; -1: as the image.', unit='px', minimum=-1)


def scale_keypoints(keypoints: np.ndarray, image_size: Tuple[int, int], params: KeypointScaleParams) -> np.ndarray:
    """Return keypoints, (P, K, 3) float32, of an image of (width, height) in the units of `keypoint_scale`.

    Source: OpenPose src/openpose/core/keypointScaler.cpp and scaleAndSizeExtractor.cpp (the image is fitted into the
    net output or the final output with its aspect kept).
    """
    width, height = image_size
    offset = 0.0
    if params.keypoint_scale < 3:
        fitted = {0: image_size, 1: (params.net_output_width, params.net_output_height),
                  2: (params.output_width if params.output_width > 0 else width,
                      params.output_height if params.output_height > 0 else height)}[params.keypoint_scale]
        factor = np.full(2, min(fitted[0] / width, fitted[1] / height))
    else:
        factor = 1.0 / np.maximum([width - 1, height - 1], 1)
        if params.keypoint_scale == 4:
            factor, offset = 2.0 * factor, -1.0
    scaled = keypoints.copy()
    scaled[..., :2] = keypoints[..., :2] * factor + offset
    return scaled

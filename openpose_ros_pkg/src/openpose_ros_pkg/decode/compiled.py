"""The compiled twin of the decoder, in the module `openpose_ros_decode`, which catkin builds where it finds pybind11.

Results are those of the modules `peaks`, `limbs` and `assembly` to the last bit.
"""
import functools
from types import ModuleType
from typing import Optional, Tuple

import numpy as np

from openpose_ros_pkg.decode.limbs import foreshortened_length, sample_steps
from openpose_ros_pkg.decode.peaks import framed_maps
from openpose_ros_pkg.skeletons import SkeletonModel


@functools.lru_cache(maxsize=1)
def load() -> Tuple[Optional[ModuleType], str]:
    """Return the compiled module, or None and why there is none. It is looked for once in a process."""
    try:
        import openpose_ros_decode
    except ImportError as error:
        return None, str(error)
    return openpose_ros_decode, ''


def decode_compiled(heatmaps: np.ndarray, pafs: np.ndarray, skeleton: SkeletonModel, stride: int,
                    params: 'DecodeParams', valid_size: Optional[Tuple[int, int]]  # noqa: F821
                    ) -> Tuple[np.ndarray, np.ndarray]:
    """Find the people as `decode` does. Other threads run meanwhile.

    Args:
        heatmaps: (K, h, w) float32, one per joint.
        pafs: (2 L, h, w) float32.
        stride: network pixels per cell.
        params: DecodeParams.
        valid_size: (width, height) [px of the network's input]; peaks beyond are left out.
    """
    limit = (np.inf, np.inf) if valid_size is None else (valid_size[0] - 0.5, valid_size[1] - 0.5)
    index = skeleton.index
    limbs = np.array([(index[limb.start], index[limb.end], *limb.paf, limb.starts_person)
                      for limb in skeleton.limbs], np.int32)
    return load()[0].decode(
        maps=framed_maps(heatmaps, params.heatmap_upsample), pafs=pafs, limbs=limbs,
        steps=sample_steps(params.limb_samples), stride=stride, upsample=params.heatmap_upsample,
        peak_threshold=params.peak_threshold, max_peaks_per_joint=params.max_peaks_per_joint,
        max_peaks=params.max_peaks, max_x=limit[0], max_y=limit[1], sample_threshold=params.limb_sample_threshold,
        min_support=params.limb_min_support, foreshortened=foreshortened_length(pafs, stride),
        min_joints=params.person_min_joints, min_score=params.person_min_score)

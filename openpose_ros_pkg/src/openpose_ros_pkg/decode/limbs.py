"""Line integrals of part affinity fields: which pairs of joints may be limbs."""
import math
from dataclasses import dataclass
from typing import Tuple

import numpy as np

from openpose_ros_pkg.decode.peaks import Peaks
from openpose_ros_pkg.skeletons import SkeletonModel

# Joints closer than this share of the root of the input's area are one limb whatever the field says; 3.3 px at
# 656x368. Source: OpenPose src/openpose/pose/bodyPartConnectorBase.cpp, getScoreAB.
_FORESHORTENED = 1 / 150


@dataclass(frozen=True)
class LimbCandidates:
    """M possible limbs.

    Attributes:
        limb: (M,) int64, index into the skeleton's limbs.
        start, end: (M,) int64, indices of the two peaks.
        score: (M,) float32, mean affinity along the limb, less a penalty for length; 0 if only nearness speaks for it.
    """

    limb: np.ndarray
    start: np.ndarray
    end: np.ndarray
    score: np.ndarray

    def __len__(self) -> int:
        return len(self.limb)


def score_limbs(pafs: np.ndarray, peaks: Peaks, skeleton: SkeletonModel, stride: int, samples: int,
                sample_threshold: float, min_support: float) -> LimbCandidates:
    """Rate every pair of peaks that a limb may connect, and keep those with support.

    The score is OpenPose's: the mean over samples of the field's component along the limb, plus
    min(0, 0.5 * height / length - 1), which counts against limbs longer than half the image's height. Peaks that are
    almost in one place are kept with score 0.
    Source: OpenPose src/openpose/pose/bodyPartConnectorBase.cpp and its Python ancestor.

    Args:
        pafs: (2 L, h, w) float32.
        stride: network pixels per cell.
        samples: number of points along a limb, both ends among them.
        sample_threshold: component along the limb that a sample needs to count as support.
        min_support: share of samples that must be support [0..1].
    """
    limb, start, end = _all_pairs(peaks, skeleton)
    cells = (peaks.xy + 0.5) / stride - 0.5
    vector = cells[end] - cells[start]
    length = np.maximum(np.sqrt((vector ** 2).sum(axis=1)), 1e-3)

    affinity = _sample_along(pafs, skeleton, limb, cells[start], vector, samples, vector / length[:, None])
    score = _row_sum(affinity) / samples + np.minimum(0.5 * pafs.shape[1] / length - 1, 0)
    support = (affinity > sample_threshold).sum(axis=0) / samples
    kept = (support >= min_support - 1e-6) & (score > 0)
    # Seen along its own axis a limb has no direction that a field could show: the shoulder of a person in profile.
    foreshortened = ~kept & (length * stride < foreshortened_length(pafs, stride))
    score[foreshortened] = 0
    kept |= foreshortened
    return LimbCandidates(limb[kept], start[kept], end[kept], score[kept].astype(np.float32))


def foreshortened_length(pafs: np.ndarray, stride: int) -> float:
    """Return the length below which a limb needs no support [px of the network's input]."""
    return _FORESHORTENED * stride * math.sqrt(pafs.shape[1] * pafs.shape[2])


def sample_steps(samples: int) -> np.ndarray:
    """Return where limbs are sampled: (samples,) float32, 0 at the start .. 1 at the end."""
    return np.linspace(0, 1, samples, dtype=np.float32)


def _all_pairs(peaks: Peaks, skeleton: SkeletonModel) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return limb, start peak and end peak of every possible pair."""
    bounds = np.searchsorted(peaks.joint, np.arange(len(skeleton.joints) + 1))
    index = skeleton.index
    limb, start, end = [], [], []
    for i, pair in enumerate(skeleton.limbs):
        first, last = bounds[index[pair.start]], bounds[index[pair.start] + 1]
        starts, ends = np.arange(first, last), np.arange(bounds[index[pair.end]], bounds[index[pair.end] + 1])
        start.append(np.repeat(starts, len(ends)))
        end.append(np.tile(ends, len(starts)))
        limb.append(np.full(len(starts) * len(ends), i))
    return np.concatenate(limb), np.concatenate(start), np.concatenate(end)


def _sample_along(pafs: np.ndarray, skeleton: SkeletonModel, limb: np.ndarray, origin: np.ndarray,
                  vector: np.ndarray, samples: int, direction: np.ndarray) -> np.ndarray:
    """Return the fields' component along each limb at evenly spaced points, (samples, M) float32."""
    _, height, width = pafs.shape
    steps = sample_steps(samples)[:, None]
    x = np.rint(origin[:, 0] + steps * vector[:, 0]).astype(np.int64).clip(0, width - 1)
    y = np.rint(origin[:, 1] + steps * vector[:, 1]).astype(np.int64).clip(0, height - 1)
    cell = y * width + x
    flat = pafs.reshape(-1)
    offset = np.array([pair.paf for pair in skeleton.limbs])[limb] * (height * width)
    return flat[cell + offset[:, 0]] * direction[:, 0] + flat[cell + offset[:, 1]] * direction[:, 1]


def _row_sum(rows: np.ndarray) -> np.ndarray:
    """Add rows one after the other, where numpy's sum chooses its own order: the compiled twin does the same."""
    total = rows[0].copy()
    for row in rows[1:]:
        total += row
    return total

"""Sigma as it is told: what lift, filter and completion state, calibrated by errors that were measured."""
from dataclasses import replace
from functools import lru_cache
from typing import Sequence, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18, SkeletonModel
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.people import INFERRED, MEASURED, People3D
from skeleton_extract_3d.track.constants import SIGMA_JOINTS, SigmaConstants

# Other words that joints' names end with.
_ALIKE = {'nose': 'head', 'eye': 'head', 'ear': 'head', 'top': 'head', 'chest': 'shoulder'}


def calibrated(people: People3D, constants: SigmaConstants = METHOD.track.sigma) -> People3D:
    """Return people, in the optical frame of a camera, with a sigma such that 95 of 100 joints are within 2 sigma."""
    kinds, body = _columns(people.skeleton)
    evidence = people.sigma, share_measured(people.status[:, body]), people.xyz[..., 2]
    return replace(people, sigma=people.sigma * np.exp(change(evidence, people.status == INFERRED, kinds, constants)))


def change(evidence: Sequence[np.ndarray], inferred: np.ndarray, kinds: np.ndarray,
           constants: SigmaConstants = METHOD.track.sigma) -> np.ndarray:
    """Return the logarithms of the change of sigma of joints, (...): the sum of one by the kind and of one by each
    evidence, see `SigmaConstants`; arrays of a shape, or that broadcast to it.
    """
    total = constants.joints[inferred.astype(int), kinds]
    for value, knots, of_status in zip(evidence, constants.knots, constants.evidence):
        total = total + np.where(inferred, *(np.interp(value, knots, of_status[row]) for row in (1, 0)))
    return total


def share_measured(status: np.ndarray) -> np.ndarray:
    """Return the shares of the joints of people, in COCO_18, that are MEASURED, (P, 1)."""
    return (status == MEASURED).mean(axis=1, keepdims=True)


def kinds_of(joints: Sequence[str]) -> np.ndarray:
    """Return the rows of joints in `SIGMA_JOINTS`, (K,); any for those that are never placed."""
    rows = {word: row for row, word in enumerate(SIGMA_JOINTS)}
    words = [name.split('_')[-1] for name in joints]
    return np.array([rows.get(_ALIKE.get(word, word), 0) for word in words])


@lru_cache(maxsize=8)
def _columns(skeleton: SkeletonModel) -> Tuple[np.ndarray, np.ndarray]:
    """Return `kinds_of` the joints of a set, and which of them COCO_18 has."""
    return kinds_of(skeleton.joints), np.flatnonzero([name in COCO_18.index for name in skeleton.joints])

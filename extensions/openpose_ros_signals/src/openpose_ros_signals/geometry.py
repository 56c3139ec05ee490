"""Lengths and angles of a body, from its joints; all in one frame with a known vertical."""
import math
from typing import NamedTuple, Tuple

import numpy as np

from openpose_ros_pkg.people import values_in
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.constants import SIGNALS, PersonConstants, Ramp
from skeleton_extract_3d.body.body import (
    BODY,
    HIPS,
    MEASURED_BONES,
    MEASURED_KINDS,
    NECK,
    SHOULDERS,
    BodyConstants,
    joint_indices,
)
from skeleton_extract_3d.people import MEASURED, MISSING, People3D

# Shoulder, elbow, wrist and hip, knee, ankle of the left and the right side, (2, 3).
ARMS, LEGS = (np.stack([joint_indices(*(f'{side}_{joint}' for joint in limb)) for side in ('left', 'right')])
              for limb in (('shoulder', 'elbow', 'wrist'), ('hip', 'knee', 'ankle')))
EYES, EARS = joint_indices('left_eye', 'right_eye'), joint_indices('left_ear', 'right_ear')
NOSE = int(joint_indices('nose')[0])
# Stamps of frames are this exact [s].
TICK = 0.005
_NONE = np.full(3, np.nan)


class Body(NamedTuple):
    """A person at one time."""

    stamp: float  # [s]
    joints: np.ndarray  # (18, 3) [m], in the order of COCO_18; NaN where hidden
    sigma: np.ndarray  # (18,) [m]; NaN where hidden or not estimated
    up: np.ndarray  # (3,) unit vector
    stature: float  # [m]
    sure: np.ndarray = np.ones(len(COCO_18.joints), bool)  # (18,), joints whose place is known well: `PersonConstants`

    @property
    def shoulders(self) -> np.ndarray:
        """Middle of the shoulders, (3,) [m]."""
        return middle(self.joints, SHOULDERS)

    @property
    def hips(self) -> np.ndarray:
        """Middle of the hips, (3,) [m]."""
        return middle(self.joints, HIPS)

    @property
    def place(self) -> np.ndarray:
        """Middle of the trunk, (3,) [m]."""
        return np.asarray((self.shoulders + self.hips) / 2)

    @property
    def eyes(self) -> np.ndarray:
        """Middle of the eyes, (3,) [m]; of nose or ears, where the eyes are hidden."""
        for joints in (EYES, np.array([NOSE]), EARS):
            known = self.joints[joints][np.isfinite(self.joints[joints, 0])]
            if len(known):
                return np.asarray(known.mean(axis=0))
        return _NONE

    @property
    def left(self) -> np.ndarray:
        """Level unit vector to the person's left, by shoulders and hips, (3,)."""
        shoulders, hips = (self.joints[left] - self.joints[right] for left, right in (SHOULDERS, HIPS))
        across = hips if math.isnan(shoulders[0]) else shoulders if math.isnan(hips[0]) else shoulders + hips
        return unit(across - (across @ self.up) * self.up)

    @property
    def axes(self) -> np.ndarray:
        """Unit vectors to the person's left, level and forwards out of the chest, and up: (3, 3), one per row."""
        left, up = self.left, self.up
        return np.array([left, (left[1] * up[2] - left[2] * up[1], left[2] * up[0] - left[0] * up[2],
                                left[0] * up[1] - left[1] * up[0]), up])

    def height(self, point: np.ndarray, over: np.ndarray) -> float:
        """Return how far a point is over another, (3,) each, in statures."""
        return float((point - over) @ self.up) / self.stature


def middle(joints: np.ndarray, pair: np.ndarray) -> np.ndarray:
    """Return the middle of two of the joints, (3,); one where the other is hidden."""
    first, second = joints[pair]
    if math.isnan(first[0]):
        return np.asarray(second)
    return np.asarray(first if math.isnan(second[0]) else (first + second) / 2)


def joints_of(people: People3D) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return joints (P, 18, 3) [m], status (P, 18) and sigma (P, 18) [m] in the order of COCO_18."""
    joints, status, sigma = (values_in(values, people.skeleton, COCO_18, missing) for values, missing in (
        (people.xyz, np.nan), (people.status, MISSING), (people.sigma, np.nan)))
    return joints.astype(np.float64), status, np.where(status == MISSING, np.nan, sigma.astype(np.float64))


def told_joints(people: People3D, constants: PersonConstants = SIGNALS.person
                ) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return joints (P, 18, 3) [m], which of them the image tells (P, 18), and sigma (P, 18) [m], as of COCO_18.

    The image tells measured joints; of a person without one, those with a keypoint. All joints of such a person share
    the error of the distance, which moves none against another: it is left out. See also
    `PersonConstants.inferred_share`.
    """
    joints, status, sigma = joints_of(people)
    told, score = status == MEASURED, values_in(people.confidence, people.skeleton, COCO_18, 0.0)
    inferred = ~told.any(axis=1, keepdims=True) & (status != MISSING) & (score > 0)
    shared = np.where(inferred, sigma, np.inf).min(axis=1, keepdims=True)
    against = np.sqrt(np.maximum(sigma ** 2 - np.where(inferred, shared, 0.0) ** 2, 0.0))
    sigma = np.where(inferred, constants.inferred_share * against, sigma)
    return joints, told | inferred, np.where(told | (score > 0), sigma, np.nan)


def body_of(stamp: float, joints: Tuple[np.ndarray, np.ndarray, np.ndarray], up: np.ndarray, stature: float,
            constants: PersonConstants = SIGNALS.person) -> Body:
    """Return a person of joints, see `told_joints`, without those that are not known well."""
    xyz, told, sigma = joints
    with np.errstate(invalid='ignore'):
        known, sure = ((sigma <= most * stature) | (np.isnan(sigma) & told)
                       for most in (constants.most_sigma, constants.sure_sigma))
    return Body(stamp, np.where(known[:, np.newaxis], xyz, np.nan), np.where(known, sigma, np.nan), up, stature, sure)


def stature_of(joints: np.ndarray, told: np.ndarray, constants: PersonConstants = SIGNALS.person,
               body: BodyConstants = BODY) -> float:
    """Return the stature [m] by the median bone between told joints, see `told_joints`; NaN: too few, or too small."""
    seen = np.where(told[:, np.newaxis], joints, np.nan)
    bones = seen[MEASURED_BONES]
    trunk = seen[NECK] - seen[HIPS].mean(axis=0)
    lengths = np.append(np.linalg.norm(bones[:, 0] - bones[:, 1], axis=1), np.linalg.norm(trunk))
    ratios = (lengths / body.bone_lengths[MEASURED_KINDS])[np.isfinite(lengths)]
    stature = float(np.median(ratios)) * body.adult_stature if len(ratios) >= 3 else np.nan
    return stature if stature >= constants.least_stature else np.nan


def angle(first: np.ndarray, second: np.ndarray) -> float:
    """Return the angle between two vectors (3,) [deg]; NaN where one is not known."""
    cosine = float(first @ second) / (length(first) * length(second) + 1e-12)
    return math.nan if math.isnan(cosine) else math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))


def length(vector: np.ndarray) -> float:
    """Return the length of a vector (3,)."""
    return math.sqrt(vector @ vector)


def ramp(value: float, ends: Ramp, error: float = 0.0) -> float:
    """Return how far a condition holds: 0 at the first end, 1 at the second, linear between; NaN of NaN.

    The ends are at least as far from their middle as the value's error, so that an uncertain value tells little.
    """
    middle, half = (ends[0] + ends[1]) / 2, (ends[1] - ends[0]) / 2
    share = 0.5 + (value - middle) / (2 * math.copysign(max(abs(half), error), half))
    return share if math.isnan(share) else min(max(share, 0.0), 1.0)


def least(*degrees: float) -> float:
    """Return how far all conditions hold: 0 if one does not at all, else NaN if one is not known."""
    if any(math.isnan(degree) for degree in degrees):
        return 0.0 if 0.0 in degrees else math.nan
    return min(degrees)


def unless_hidden(degree: float) -> float:
    """Return how far a condition holds that is left out where its joints are hidden."""
    return 1.0 if math.isnan(degree) else degree


def most(*degrees: float) -> float:
    """Return how far any condition holds: 1 if one does wholly, else NaN if one is not known."""
    return 1 - least(*(1 - degree for degree in degrees))


def unit(vector: np.ndarray) -> np.ndarray:
    """Return a vector (3,) with length 1; NaN of zeros."""
    size = length(vector)
    return np.asarray(vector / size) if size > 1e-9 else _NONE

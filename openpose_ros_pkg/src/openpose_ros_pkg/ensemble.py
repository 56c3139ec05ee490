"""Ensemble: how alike poses are, which show one person, and one pose out of several opinions.

Each source gives poses, its opinions. A joint is placed where the opinions, weighted by their
scores, promise the greatest object keypoint similarity. Its score is the share of the opinions that agree:
high where all networks see the joint, low where one sees it alone.

Object keypoint similarity (OKS) is COCO's measure (cocodataset.org, keypoints evaluation):
exp(-d^2 / (2 area (2 sigma)^2)) for two places of a joint that are d apart, with the deviation sigma of annotators for
each kind of joint.
"""
from dataclasses import dataclass
from typing import Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import People2D, Poses
from openpose_ros_pkg.skeletons import SkeletonModel

# Standard deviations of annotators, in units of the root of a person's area: pycocotools, cocoeval.py,
# kpt_oks_sigmas; feet: COCO-WholeBody (Jin et al., ECCV 2020). COCO has no joint on the body's midline below the head:
# those get the figure of the joints that they lie between.
_SIGMAS: Dict[str, float] = {
    'nose': .026, 'eye': .025, 'ear': .035, 'shoulder': .079, 'elbow': .072, 'wrist': .062, 'hip': .107, 'knee': .087,
    'ankle': .089, 'big_toe': .068, 'small_toe': .066, 'heel': .066, 'neck': .079, 'mid_hip': .107, 'chest': .107,
    'head_top': .035}


@dataclass(frozen=True)
class AreaConstants:
    """From the bounding box of a person's joints to the area that the person covers."""

    area_share: float = constant(
        0.53 * 1.3, 'Area of the person per area of the box: about half of a bounding box (COCO), and the box of the '
                    "joints is smaller by the head's top, hands and feet.")
    least_aspect: float = constant(
        0.4, 'Least width of the box as a share of its height: it is narrow where a person is seen from the side.')


AREA = AreaConstants()


@dataclass(frozen=True)
class EnsembleConstants:
    """How opinions become people."""

    same_person: float = constant(0.3, 'Poses with a lower similarity are different people.')
    duplicate: float = constant(0.6, 'Of two people with a greater similarity one is left out.')
    mean_shift_steps: int = constant(3, 'Steps from the opinion with the most support to the place of a joint.')


ENSEMBLE = EnsembleConstants()

Opinions = Dict[int, np.ndarray]
"""Poses of one person, (K, 3) float32 each, by the number of the source."""


@dataclass(frozen=True, eq=False)
class Sources:
    """The S sources of opinions on a person."""

    sigmas: np.ndarray  # (K,) float, see `sigmas`
    weights: Sequence[float]  # (S,) on the scores of joints
    place_weights: Sequence[float]  # (S,) on their places
    known: np.ndarray  # (S, K) bool, the joints that each can tell of


@dataclass(frozen=True)
class Acceptance:
    """Which poses are people."""

    skeleton: SkeletonModel  # of the people
    joint_score: float  # least scores
    person_score: float
    person_joints: int  # least number
    voted: bool  # False: one opinion alone; the decoder has applied its own thresholds


def sigmas(skeleton: SkeletonModel) -> np.ndarray:
    """Return twice the standard deviation of each joint, (K,) float64, in units of the root of the person's area."""
    return np.array([2 * _SIGMAS[joint.replace('left_', '').replace('right_', '')] for joint in skeleton.joints])


def extent(keypoints: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return least and greatest x and y, (2,) each [px], of a person, (K, 3), NaN where missing; one joint is there."""
    there = keypoints[np.isfinite(keypoints[:, 0]), :2]
    return there.min(axis=0), there.max(axis=0)


def area(keypoints: np.ndarray, constants: AreaConstants = AREA) -> float:
    """Return the area [px^2] that a person, (K, 3) float, covers in the image, by the box round its joints."""
    if not np.isfinite(keypoints[:, 0]).any():
        return 0.0
    low, high = extent(keypoints)
    width, height = high - low
    return constants.area_share * max(width * height, (constants.least_aspect * max(width, height)) ** 2, 1.0)


def similarity(one: np.ndarray, other: np.ndarray, joint_sigmas: np.ndarray) -> float:
    """Return how alike two poses, (K, 3) each, are, 0..1, over the joints that both have, weighted by their scores."""
    both = np.isfinite(one[:, 0]) & np.isfinite(other[:, 0])
    if both.sum() < 2:
        return 0.0
    spread = 2 * max(area(one), area(other)) * joint_sigmas[both] ** 2
    alike = np.exp(-((one[both, :2] - other[both, :2]) ** 2).sum(axis=1) / spread)
    weight = np.sqrt(one[both, 2] * other[both, 2])
    return float((weight * alike).sum() / weight.sum())


def group(sources: Sequence[np.ndarray], joint_sigmas: np.ndarray, constants: EnsembleConstants = ENSEMBLE
          ) -> List[Opinions]:
    """Group the poses of several sources, (P, K, 3) float32 each, by person.

    Returns:
        One dictionary per person; each source gives a person one pose at most.
    """
    people: List[Opinions] = []
    for number, poses in enumerate(sources):
        alike = sorted(((max(similarity(pose, known, joint_sigmas) for known in person.values()), i, j)
                        for i, pose in enumerate(poses) for j, person in enumerate(people)),
                       key=lambda item: -item[0])
        taken, given = set(), set()
        for value, i, j in alike:
            if value < constants.same_person:
                break
            if i not in taken and j not in given:
                taken.add(i)
                given.add(j)
                people[j][number] = poses[i]
        people.extend({number: pose} for i, pose in enumerate(poses) if i not in taken)
    return people


def vote(opinions: Opinions, weights: Sequence[float], joint_sigmas: np.ndarray,
         constants: EnsembleConstants = ENSEMBLE) -> np.ndarray:
    """Place each joint of a person where the opinions promise the greatest similarity.

    The start is the opinion with the most support; a mean shift with the joint's own kernel follows. The score is the
    root of the mean support over all sources, including those that do not see the person: measured on annotated
    images, joints with a score of 0.5 have a similarity of 0.7 to 0.8, those with 0.7 one of 0.9.

    Args:
        opinions: of the sources that see the person.
        weights: of all sources, (S,).

    Returns:
        (K, 3) float32: x, y [px], score [0..1]; NaN, NaN, 0 where no source has the joint.
    """
    poses = np.stack(list(opinions.values())).astype(np.float64)
    weight = np.array([weights[number] for number in opinions])
    spread = 2 * np.median([area(pose) for pose in poses]) * joint_sigmas ** 2
    there = np.isfinite(poses[..., 0])
    xy = np.where(there[..., None], poses[..., :2], 0.0)
    belief = np.where(there, np.minimum(poses[..., 2], 1.0) * weight[:, None], 0.0)
    apart = ((xy[:, None] - xy[None]) ** 2).sum(axis=3)
    support = (np.exp(-apart / spread) * belief[None]).sum(axis=1)
    place = xy[np.where(there, support, -1.0).argmax(axis=0), np.arange(xy.shape[1])]
    for _ in range(constants.mean_shift_steps):
        pull = belief * np.exp(-((xy - place) ** 2).sum(axis=2) / spread)
        place = (pull[..., None] * xy).sum(axis=0) / np.maximum(pull.sum(axis=0), 1e-12)[:, None]
    agreed = (belief * np.exp(-((xy - place) ** 2).sum(axis=2) / spread)).sum(axis=0)
    result = np.full((len(place), 3), np.nan, np.float32)
    result[:, 2] = np.sqrt(agreed / sum(weights))
    found = result[:, 2] > 0
    result[found, :2] = place[found]
    return result


def vote_with_crops(opinions: Opinions, sources: Sources) -> np.ndarray:
    """Vote on a person with the opinions on crops; see `vote`.

    Joints that the networks of the crops do not know, as the feet of BODY_25, keep what those of the full image say.
    """
    keypoints = vote(opinions, sources.weights, sources.sigmas)
    keypoints[:, :2] = vote(opinions, sources.place_weights, sources.sigmas)[:, :2]
    asked, total = np.array(sources.weights) @ sources.known, sum(sources.weights)
    keypoints[:, 2] *= np.sqrt(total / np.where(asked > 0, asked, total))
    return keypoints


def person_scores(keypoints: np.ndarray) -> np.ndarray:
    """Return the scores of people, (P, K, 3): the root mean square of their joints' scores, missing ones being 0."""
    return np.sqrt((keypoints[..., 2] ** 2).mean(axis=1))


def accepted_people(poses: Poses, acceptance: Acceptance, image_size: Tuple[int, int]) -> Tuple[People2D, np.ndarray]:
    """Return the accepted people in an image of (width, height) [px], without ids, and their indices.

    Of several opinions: the surest first, without duplicates, and without joints and people below their thresholds.
    """
    kept = np.arange(len(poses.scores))
    if acceptance.voted:
        distinct = without_duplicates(poses, sigmas(acceptance.skeleton), acceptance.skeleton.swap)
        keypoints, scores = poses.keypoints[distinct], poses.scores[distinct]
        keypoints[keypoints[..., 2] < acceptance.joint_score] = (np.nan, np.nan, 0)
        joints = (keypoints[..., 2] > 0).sum(axis=1)
        sure = (scores >= acceptance.person_score) & (joints >= acceptance.person_joints)
        poses, kept = Poses(keypoints[sure], scores[sure]), distinct[sure]
    # half a pixel beyond the centre of the outermost pixel is still that pixel
    keypoints = poses.keypoints.copy()
    keypoints[..., :2] = np.clip(keypoints[..., :2], 0, np.subtract(image_size, 1))
    return People2D(acceptance.skeleton, keypoints, poses.scores, np.full(len(poses.scores), -1)), kept


def surest(scores: np.ndarray, same: Callable[[int, int], bool]) -> np.ndarray:
    """Return the indices of people with (P,) scores, the surest first, without those that are like a surer one."""
    kept: List[int] = []
    for i in np.argsort(-scores, kind='stable').tolist():
        if not any(same(i, j) for j in kept):
            kept.append(i)
    return np.array(kept, np.int64)


def without_duplicates(poses: Poses, joint_sigmas: np.ndarray, swap: Sequence[int],
                       constants: EnsembleConstants = ENSEMBLE) -> np.ndarray:
    """Return the indices of the people, the surest first, without duplicates of surer ones.

    Args:
        swap: channel of each joint's mirror partner: left and right may be exchanged.
    """
    mirrored = poses.keypoints[:, list(swap)]
    return surest(poses.scores, lambda i, j: any(
        not similarity(view[i], poses.keypoints[j], joint_sigmas) < constants.duplicate
        for view in (poses.keypoints, mirrored)))


def most_alike(keypoints: np.ndarray, person: np.ndarray, people: np.ndarray, joint_sigmas: np.ndarray,
               constants: EnsembleConstants = ENSEMBLE) -> Optional[np.ndarray]:
    """Return the pose, of (N, K, 3), that is the person, (K, 3), and none of the other (P, K, 3) people; else None."""
    alike = [similarity(person, pose, joint_sigmas) for pose in keypoints]
    if not alike or max(alike) < constants.same_person:
        return None
    pose = keypoints[int(np.argmax(alike))]
    if any(similarity(pose, other, joint_sigmas) > max(alike)
           and similarity(person, other, joint_sigmas) < constants.duplicate for other in people):
        return None
    return pose

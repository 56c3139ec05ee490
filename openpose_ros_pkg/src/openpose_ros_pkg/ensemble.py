"""Ensemble: how alike poses are, which show one person, and one pose out of several opinions.

Each source gives poses, its opinions. A joint is placed where the opinions, weighted by their
scores, promise the greatest object keypoint similarity. Its score is the share of the opinions that agree:
high where all networks see the joint, low where one sees it alone.

Object keypoint similarity (OKS) is COCO's measure (cocodataset.org, keypoints evaluation):
exp(-d^2 / (2 area (2 sigma)^2)) for two places of a joint that are d apart, with the deviation sigma of annotators for
each kind of joint.
"""
from dataclasses import dataclass
from typing import Dict, List, Mapping, Optional, Sequence, Tuple

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
    weights: np.ndarray  # (S,) or, of each of P people, (P, S) float, on the scores of joints
    place_weights: np.ndarray  # the same, on their places
    known: np.ndarray  # (S, K) bool, the joints that each can tell of

    def observable(self, opinions: Sequence[Mapping[int, Optional[np.ndarray]]]) -> np.ndarray:
        """Return which joints the sources of the opinions on each of P people can tell of, (P, K) bool."""
        return np.stack([self.known[list(of_person)].any(axis=0) for of_person in opinions]
                        or [self.known[:0]]).reshape(-1, len(self.sigmas))


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
    return np.fmin.reduce(keypoints[:, :2]), np.fmax.reduce(keypoints[:, :2])


def area(keypoints: np.ndarray, constants: AreaConstants = AREA) -> np.ndarray:
    """Return the areas [px^2] that people, (..., K, 3) float, cover in the image, by the boxes round their joints.

    Returns:
        (...,) float64; 0 for people without a joint.
    """
    xy = keypoints[..., :2]
    sides = (np.fmax.reduce(xy, axis=-2) - np.fmin.reduce(xy, axis=-2)).astype(np.float64)
    width, height = sides[..., 0], sides[..., 1]
    longer = np.maximum(width, height)
    covered = np.maximum(np.maximum(width * height, (constants.least_aspect * longer) ** 2), 1.0)
    return np.where(np.isnan(longer), 0.0, constants.area_share * covered)


def similarity(one: np.ndarray, other: np.ndarray, joint_sigmas: np.ndarray) -> np.ndarray:
    """Return how alike poses are, 0..1, over the joints that both have, weighted by their scores.

    Args:
        one, other: (..., K, 3) float; their leading axes are broadcast against each other.

    Returns:
        (...,) float64; 0 with less than two such joints.
    """
    both = np.isfinite(one[..., 0]) & np.isfinite(other[..., 0])
    spread = 2 * np.maximum(area(one), area(other))[..., None] * joint_sigmas ** 2
    apart = ((one[..., :2] - other[..., :2]) ** 2).sum(axis=-1)
    alike = np.exp(-np.where(both, apart, 0.0) / np.where(both, spread, 1.0))
    weight = np.sqrt(np.where(both, one[..., 2] * other[..., 2], 0.0))
    total, count = weight.sum(axis=-1), both.sum(axis=-1)
    with np.errstate(invalid='ignore'):
        return np.where(count < 2, 0.0, (weight * alike).sum(axis=-1) / total)


def medians(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the median of the known values, (..., K) each, along the last axis, (...,); infinite without any."""
    ordered = np.sort(np.where(known, values, values.dtype.type(np.inf)), axis=-1)
    count = np.broadcast_to(known, values.shape).sum(axis=-1)
    middle = np.stack([np.maximum(count - 1, 0) // 2, np.minimum(count // 2, values.shape[-1] - 1)], axis=-1)
    return np.take_along_axis(ordered, middle, axis=-1).mean(axis=-1)


def group(sources: Sequence[np.ndarray], joint_sigmas: np.ndarray, constants: EnsembleConstants = ENSEMBLE
          ) -> List[Opinions]:
    """Group the poses of several sources, (P, K, 3) float32 each, by person.

    Returns:
        One dictionary per person; each source gives a person one pose at most.
    """
    people: List[Opinions] = []
    for number, poses in enumerate(sources):
        taken, given = set(), set()
        if people and len(poses):
            known = np.stack([pose for person in people for pose in person.values()])
            first = np.cumsum([0] + [len(person) for person in people[:-1]])
            alike = np.maximum.reduceat(similarity(poses[:, None], known, joint_sigmas), first, axis=1)
            for index in np.argsort(-alike, axis=None, kind='stable').tolist():
                i, j = divmod(index, len(people))
                if alike[i, j] < constants.same_person:
                    break
                if i not in taken and j not in given:
                    taken.add(i)
                    given.add(j)
                    people[j][number] = poses[i]
        people.extend({number: pose} for i, pose in enumerate(poses) if i not in taken)
    return people


def stacked(opinions: Sequence[Mapping[int, Optional[np.ndarray]]], sources: int, joints: int) -> np.ndarray:
    """Return opinions of S sources on P people as an array, (P, S, K, 3) float32; NaN, NaN, 0 where there is none."""
    result = np.full((len(opinions), sources, joints, 3), (np.nan, np.nan, 0), np.float32)
    for of_person, poses in zip(result, opinions):
        for number, pose in poses.items():
            if pose is not None:
                of_person[number] = pose
    return result


def vote(opinions: np.ndarray, weights: np.ndarray, joint_sigmas: np.ndarray,
         constants: EnsembleConstants = ENSEMBLE) -> np.ndarray:
    """Place each joint of people where the opinions promise the greatest similarity.

    The start is the opinion with the most support; a mean shift with the joint's own kernel follows. The score is the
    root of the mean support over all sources, including those that do not see the person: measured on annotated
    images, joints with a score of 0.5 have a similarity of 0.7 to 0.8, those with 0.7 one of 0.9.

    Args:
        opinions: (..., S, K, 3) float32, of all sources; NaN, NaN, 0 of those that do not see a person, and where a
            pose has no such joint.
        weights: (..., S) float64 of the sources; its leading axes, which may be more, are broadcast.

    Returns:
        (..., K, 3) float32: x, y [px], score [0..1]; NaN, NaN, 0 where no source has the joint.
    """
    poses, areas = opinions.astype(np.float64), area(opinions)
    spread = 2 * medians(areas, areas > 0)[..., None, None] * joint_sigmas ** 2  # (..., 1, K)
    there = np.isfinite(poses[..., 0])
    xy = np.where(there[..., None], poses[..., :2], 0.0)
    belief = np.where(there, np.minimum(poses[..., 2], 1.0) * weights[..., None], 0.0)
    apart = ((xy[..., :, None, :, :] - xy[..., None, :, :, :]) ** 2).sum(axis=-1)  # (..., S, S, K)
    support = (np.exp(-apart / spread[..., None, :]) * belief[..., None, :, :]).sum(axis=-2)
    best = np.where(there, support, -1.0).argmax(axis=-2)[..., None, :, None]
    place = np.take_along_axis(np.broadcast_to(xy, (*belief.shape, 2)), best, axis=-3)  # (..., 1, K, 2)
    for _ in range(constants.mean_shift_steps):
        pull = belief * np.exp(-((xy - place) ** 2).sum(axis=-1) / spread)
        total = np.maximum(pull.sum(axis=-2, keepdims=True), 1e-12)
        place = (pull[..., None] * xy).sum(axis=-3, keepdims=True) / total[..., None]
    agreed = (belief * np.exp(-((xy - place) ** 2).sum(axis=-1) / spread)).sum(axis=-2)
    score = np.sqrt(agreed / np.maximum(weights.sum(axis=-1, keepdims=True), 1e-12)).astype(np.float32)
    place = np.where(score[..., None] > 0, place[..., 0, :, :], np.nan)
    return np.concatenate([place.astype(np.float32), score[..., None]], axis=-1)


def vote_with_crops(opinions: np.ndarray, sources: Sources) -> np.ndarray:
    """Vote on people with the opinions on crops; see `vote`.

    Joints that the networks of the crops do not know, as the feet of BODY_25, keep what those of the full image say.
    """
    weights, place_weights = (np.broadcast_to(one, opinions.shape[:-2])
                              for one in (sources.weights, sources.place_weights))
    scored, placed = vote(opinions, np.stack([weights, place_weights]), sources.sigmas)
    observed, total = weights @ sources.known, np.maximum(weights.sum(axis=-1, keepdims=True), 1e-12)
    scores = scored[..., 2] * np.sqrt(total / np.where(observed > 0, observed, total))
    return np.concatenate([placed[..., :2], scores[..., None].astype(np.float32)], axis=-1)


def person_scores(keypoints: np.ndarray, observable: np.ndarray) -> np.ndarray:
    """Return the scores of people, (P, K, 3): the root mean square of their joints' scores, missing ones being 0.

    Args:
        observable: (P, K) bool, the joints that count: no score falls for want of a source that knows feet.
    """
    count = np.maximum(observable.sum(axis=1), 1).astype(keypoints.dtype)
    return np.sqrt((keypoints[..., 2] ** 2 * observable).sum(axis=1) / count)


def mean_scores(poses: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the mean scores, (...,), of the joints of poses, (..., K, 3), that their source can know, (K,) bool.

    Missing joints do not count, up to three quarters: half of a person may lie beyond the border of the image.
    """
    there = np.isfinite(poses[..., 0]) & known
    count = np.maximum(there.sum(axis=-1), known.sum() / 4)
    return ((poses[..., 2] * there).sum(axis=-1) / count).astype(poses.dtype)


def accepted_people(poses: Poses, acceptance: Acceptance, image_size: Tuple[int, int]) -> Tuple[People2D, np.ndarray]:
    """Return the accepted people in an image of (width, height) [px], without ids, and their indices.

    Of several opinions: the surest first, without duplicates, and without joints and people below their thresholds;
    standard deviations are those of one opinion alone.
    """
    kept = np.arange(len(poses.scores))
    if acceptance.voted:
        distinct = without_duplicates(poses, sigmas(acceptance.skeleton), acceptance.skeleton.swap)
        keypoints, scores = poses.keypoints[distinct], poses.scores[distinct]
        keypoints[keypoints[..., 2] < acceptance.joint_score] = (np.nan, np.nan, 0)
        joints = (keypoints[..., 2] > 0).sum(axis=1)
        sure = (scores >= acceptance.person_score) & (joints >= acceptance.person_joints)
        kept = distinct[sure]
        poses = Poses(keypoints[sure], scores[sure], None if poses.points is None else poses.points[kept])
    # half a pixel beyond the centre of the outermost pixel is still that pixel
    keypoints = poses.keypoints.copy()
    keypoints[..., :2] = np.clip(keypoints[..., :2], 0, np.subtract(image_size, 1))
    return People2D(acceptance.skeleton, keypoints, poses.scores, np.full(len(poses.scores), -1),
                    points=poses.points), kept


def surest(scores: np.ndarray, same: np.ndarray) -> np.ndarray:
    """Return the indices of people, the surest first, without those that are like a surer one.

    Args:
        scores: (P,) of the people.
        same: (P, P) bool, whether the first is like the second.
    """
    kept: List[int] = []
    for i in np.argsort(-scores, kind='stable').tolist():
        if not same[i, kept].any():
            kept.append(i)
    return np.array(kept, np.int64)


def without_duplicates(poses: Poses, joint_sigmas: np.ndarray, swap: Sequence[int],
                       constants: EnsembleConstants = ENSEMBLE) -> np.ndarray:
    """Return the indices of the people, the surest first, without duplicates of surer ones.

    Args:
        swap: channel of each joint's mirror partner: left and right may be exchanged.
    """
    views = np.stack([poses.keypoints, poses.keypoints[:, list(swap)]])
    different = similarity(views[:, :, None], poses.keypoints, joint_sigmas) < constants.duplicate
    return surest(poses.scores, ~different.all(axis=0))


def most_alike(keypoints: np.ndarray, person: np.ndarray, people: np.ndarray, joint_sigmas: np.ndarray,
               least: float = ENSEMBLE.same_person, constants: EnsembleConstants = ENSEMBLE) -> Optional[np.ndarray]:
    """Return the pose, of (N, K, 3), that is the person, (K, 3), and none of the other (P, K, 3) people; else None.

    Args:
        least: similarity that it needs.
    """
    if not len(keypoints):
        return None
    alike = similarity(person, keypoints, joint_sigmas)
    best = int(np.argmax(alike))
    if alike[best] < least:
        return None
    if ((similarity(keypoints[best], people, joint_sigmas) > alike[best])
            & (similarity(person, people, joint_sigmas) < constants.duplicate)).any():
        return None
    return keypoints[best]

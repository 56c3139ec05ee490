"""Ensemble: poses of several networks, sizes and crops are grouped by person and voted on.

Each source gives poses, its opinions. A joint is placed where the opinions, weighted by their
scores, promise the greatest object keypoint similarity (`oks`). Its score is the share of the opinions that agree:
high where all networks see the joint, low where one sees it alone.
"""
from dataclasses import dataclass, replace
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.decode.direct import DirectDecodeParams
from openpose_ros_pkg.decode.paf import DecodeParams
from openpose_ros_pkg.detect.detection import DepthView
from openpose_ros_pkg.detect.recipes import DetectorParams, Recipe
from openpose_ros_pkg.detect.views import NetworkSetup
from openpose_ros_pkg.networks.backends import BackendParams, LiveBackendParams
from openpose_ros_pkg.oks import area, sigmas, similarity
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import People2D, Poses, keypoints_in


@dataclass(frozen=True)
class EnsembleParams(Parameters):
    """Thresholds where several opinions become one."""

    joint_min_score: float = parameter(
        0.15, 'Score that a joint needs where several opinions were put together (mode accurate: 0.8 of it). '
             'Raise it (0.5) where only joints count that are surely right.', minimum=0.0, maximum=1.0)


@dataclass(frozen=True)
class DetectorSettings:
    """All parameters of the detector."""

    detector: DetectorParams
    backend: BackendParams
    decode: DecodeParams
    direct: DirectDecodeParams
    ensemble: EnsembleParams


@dataclass(frozen=True)
class LiveDetectorSettings(DetectorSettings):
    """All parameters of the detector, with the defaults of nodes."""

    backend: LiveBackendParams


@dataclass(frozen=True)
class Setup(NetworkSetup):
    """What a frame is computed with, whatever is reconfigured in the meantime."""

    settings: DetectorSettings


@dataclass(frozen=True)
class EnsembleConstants:
    """How opinions become people, and from which scores on they count: what one network doubts, others may confirm."""

    candidate_share: float = constant(
        0.8, 'Share of `person_min_score` that a candidate of a network with part affinity fields needs.')
    candidate_most: float = constant(0.2, 'That score is at most this.')
    candidate_person: float = constant(0.05, 'Person score that a candidate of MoveNet or RTMO needs.')
    candidate_joint: float = constant(0.0, 'Joint score that a candidate of MoveNet or RTMO needs.')
    same_person: float = constant(0.3, 'Poses with a lower similarity are different people.')
    duplicate: float = constant(0.6, 'Of two people with a greater similarity one is left out.')
    mean_shift_steps: int = constant(3, 'Steps from the opinion with the most support to the place of a joint.')


ENSEMBLE = EnsembleConstants()

Opinions = Dict[int, np.ndarray]
"""Poses of one person, (K, 3) float32 each, by the number of the source."""


class Candidates(NamedTuple):
    """Candidates for people after the vote, also below the thresholds.

    Attributes:
        opinions: of each person.
        keypoints: (P, K, 3) float32: x, y [px of the image], score; where the opinions place the joints.
        depth: of the image; None: it is not known.
    """

    opinions: List[Opinions]
    keypoints: np.ndarray
    depth: Optional[DepthView] = None

    @property
    def poses(self) -> Poses:
        """The people without the opinions on them."""
        return Poses(self.keypoints, person_scores(self.keypoints))


def candidate_thresholds(decode: DecodeParams, direct: DirectDecodeParams, constants: EnsembleConstants = ENSEMBLE
                         ) -> Tuple[DecodeParams, DirectDecodeParams]:
    """Return thresholds of the decoders for candidates, on which other networks vote."""
    score = min(constants.candidate_share * decode.person_min_score, constants.candidate_most)
    return replace(decode, person_min_score=score), replace(
        direct, direct_person_score=constants.candidate_person, direct_joint_score=constants.candidate_joint)


def vote_on_people(opinions: Sequence[Poses], recipe: Recipe) -> Candidates:
    """Group the opinions of the passes by person, and vote on each person."""
    joint_sigmas = sigmas(recipe.skeleton)
    people = group([poses.keypoints for poses in opinions], joint_sigmas)
    weights = recipe.weights[:recipe.pass_opinions]
    keypoints = [vote(person, weights, joint_sigmas) for person in people]
    return Candidates(people, np.array(keypoints, np.float32).reshape(-1, len(joint_sigmas), 3))


def group(sources: Sequence[np.ndarray], joint_sigmas: np.ndarray, constants: EnsembleConstants = ENSEMBLE
          ) -> List[Opinions]:
    """Group the poses of several sources by person.

    Args:
        sources: (P, K, 3) float32 each: x, y [px of the image], score.
        joint_sigmas: (K,) float, of `oks.sigmas`.

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
        joint_sigmas: (K,) float, of `oks.sigmas`.

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


def vote_with_crops(opinions: Opinions, recipe: Recipe, weights: Sequence[float],
                    place_weights: Sequence[float]) -> np.ndarray:
    """Vote on a person with the opinions on crops; see `vote`.

    Joints that the networks of the crops do not know, as the feet of BODY_25, keep what those of the full image say.

    Args:
        weights, place_weights: of all sources, (S,), on the scores and on the places of joints.
    """
    joint_sigmas = sigmas(recipe.skeleton)
    keypoints = vote(opinions, weights, joint_sigmas)
    keypoints[:, :2] = vote(opinions, place_weights, joint_sigmas)[:, :2]
    crops = [one.model.skeleton for one in recipe.refinements]
    # a crop tells of the joints that its skeleton has, or makes, of those of the recipe
    in_all = [np.ones(len(joint_sigmas), bool)] * recipe.pass_opinions
    in_crops = [keypoints_in(np.zeros((1, len(one.joints), 3)), one, recipe.skeleton)[0, :, 0] for one in crops]
    known = np.array(in_all + [np.isfinite(one) for one in in_crops])
    asked = np.array(weights) @ known
    keypoints[:, 2] *= np.sqrt(sum(weights) / np.where(asked > 0, asked, sum(weights)))
    return keypoints


def person_scores(keypoints: np.ndarray) -> np.ndarray:
    """Return the scores of people, (P, K, 3): the root mean square of their joints' scores, missing ones being 0."""
    return np.sqrt((keypoints[..., 2] ** 2).mean(axis=1))


def accepted_people(poses: Poses, setup: Setup, image_size: Tuple[int, int]) -> Tuple[People2D, np.ndarray]:
    """Return the accepted people in an image of (width, height) [px], without ids, and their indices."""
    kept = np.arange(len(poses.scores))
    if setup.recipe.is_ensemble:
        poses, kept = accepted(poses, setup.recipe, setup.settings.decode, setup.settings.ensemble)
    # half a pixel beyond the centre of the outermost pixel is still that pixel
    keypoints = poses.keypoints.copy()
    keypoints[..., :2] = np.clip(keypoints[..., :2], 0, np.subtract(image_size, 1))
    return People2D(setup.recipe.skeleton, keypoints, poses.scores, np.full(len(poses.scores), -1)), kept


def accepted(poses: Poses, recipe: Recipe, decode: DecodeParams, params: EnsembleParams) -> Tuple[Poses, np.ndarray]:
    """Return people without duplicates, and without joints and people below their thresholds.

    Returns:
        The people, the surest first, and their indices.
    """
    distinct = without_duplicates(poses, sigmas(recipe.skeleton), recipe.skeleton.swap)
    keypoints = poses.keypoints[distinct]
    keypoints[keypoints[..., 2] < recipe.acceptance * params.joint_min_score] = (np.nan, np.nan, 0)
    joints = (keypoints[..., 2] > 0).sum(axis=1)
    scores = poses.scores[distinct]
    kept = (scores >= recipe.acceptance * decode.person_min_score) & (joints >= decode.person_min_joints)
    return Poses(keypoints[kept], scores[kept]), distinct[kept]


def without_duplicates(poses: Poses, joint_sigmas: np.ndarray, swap: Sequence[int],
                       constants: EnsembleConstants = ENSEMBLE) -> np.ndarray:
    """Return the indices of the people, the surest first, without duplicates of surer ones.

    Args:
        swap: channel of each joint's mirror partner: left and right may be exchanged.
    """
    kept: List[int] = []
    for i in np.argsort(-poses.scores, kind='stable'):
        views = (poses.keypoints[i], poses.keypoints[i][list(swap)])
        if all(similarity(view, poses.keypoints[j], joint_sigmas) < constants.duplicate
               for j in kept for view in views):
            kept.append(int(i))
    return np.array(kept, np.int64)


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

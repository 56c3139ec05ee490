"""Crop refinement: a network sees each person a second time, on a crop, and the opinions are voted on again."""
import time
from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.decode.direct import DirectDecodeParams, decode_direct
from openpose_ros_pkg.detect.ensemble import (
    ENSEMBLE,
    Candidates,
    Opinions,
    most_alike,
    person_scores,
)
from openpose_ros_pkg.detect.occlusion_masks import COVER, Foreground, cover_others, foregrounds, vote_behind
from openpose_ros_pkg.detect.recipes import CropRefinement, Recipe
from openpose_ros_pkg.detect.views import ComputedView, PreparedView, View, compute_views
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.models import Model
from openpose_ros_pkg.networks.preprocess import fit_image
from openpose_ros_pkg.oks import extent, sigmas, similarity
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import Poses, keypoints_in
from openpose_ros_pkg.skeletons import SkeletonModel


@dataclass(frozen=True)
class CropConstants:
    """How a person is cut out of the image."""

    least_side: int = constant(16, 'Least side of a crop; below, there is nothing to see.', unit='px')
    most_area: float = constant(
        9.0, 'A crop is at most this many times as large as the image: a person who was taken to be in a long thin '
             'image, or is expected close before the camera, shall not take gigabytes.')
    sure_joint: float = constant(
        0.25, 'Joints with a lower score do not widen the crop: they are guesses, often of what is out of sight.')
    least_tilt: float = constant(
        60.0, 'People who are tilted by more, from ankles to shoulders, are turned upright.', unit='deg')


CROP = CropConstants()


def refine(people: Candidates, bgr: np.ndarray, recipe: Recipe, networks: Dict[str, Backend],
           direct: DirectDecodeParams, min_score: float) -> Tuple[Candidates, float]:
    """Let the networks see the surest people on crops; doubtful ones seldom become people by it.

    Args:
        bgr: (H, W, 3) uint8 BGR, the image.
        recipe: how people are refined, and how many at most.
        networks: by the models' names.
        direct: thresholds of the decoder.
        min_score: of a person, before the recipe's acceptance.

    Returns:
        The people with what crops show of them, and the time that the networks took [s].
    """
    joint_sigmas, scores = sigmas(recipe.skeleton), person_scores(people.keypoints)
    surest = np.argsort(-scores, kind='stable')[:recipe.max_refined]
    refined = surest[scores[surest] >= recipe.acceptance * min_score].tolist()
    shown = people.keypoints[refined]
    before = foregrounds(shown, recipe.skeleton, people.depth, (bgr.shape[1], bgr.shape[0]))
    crops = [[prepare_crop(bgr, person, one, shown, recipe.skeleton, foreground)
              for person, foreground in zip(shown, before)] for one in recipe.refinements]
    begin = time.perf_counter()
    computed = [compute_views(views, networks[one.model.name]) for one, views in zip(recipe.refinements, crops)]
    seconds = time.perf_counter() - begin
    opinions: List[Opinions] = [dict(known) for known in people.opinions]
    for number, (one, views) in enumerate(zip(recipe.refinements, computed), start=recipe.pass_opinions):
        for i, crop in zip(refined, views):
            found = decode_crop(crop, one.model, direct, recipe.skeleton).keypoints
            pose = most_alike(found, people.keypoints[i], joint_sigmas)
            if pose is not None and not _shows_another(pose, people.keypoints[i], shown, joint_sigmas):
                opinions[i][number] = pose
    keypoints = people.keypoints.copy()
    for i, foreground in zip(refined, before):
        keypoints[i] = vote_behind(opinions[i], foreground, recipe, recipe.weights, recipe.place_weights)
    return people._replace(opinions=opinions, keypoints=keypoints), seconds


def prepare_crop(bgr: np.ndarray, person: np.ndarray, refinement: CropRefinement, people: Sequence[np.ndarray],
                 skeleton: SkeletonModel, foreground: Optional[Foreground] = None) -> PreparedView:
    """Cut a person out of an image; for a network that shows one person, others are covered, and who lies is upright.

    Args:
        bgr: (H, W, 3) uint8 BGR.
        person: (K, 3) float: x, y [px of the image], score; NaN where missing. One joint at least is there.
        people: the same of all people in the image.
        skeleton: their K joints.
        foreground: what is in front of the person; None: nobody, or it is not known.
    """
    size = (bgr.shape[1], bgr.shape[0])
    left, top, right, bottom = _crop_square(person, refinement.margin, size)
    if not refinement.centred:
        left, top, right, bottom = max(left, 0), max(top, 0), min(right, size[0]), min(bottom, size[1])
    recipe = refinement.model.input
    plan = fit_image((right - left, bottom - top), refinement.side, refinement.side, recipe.multiple_of, whole_box=True)
    crop = View(plan, refinement.mirror, (left, top), size).prepare(bgr, recipe.padding)
    if refinement.model.decoder != 'movenet_singlepose':
        return crop
    turns = quarter_turns(person, skeleton)
    if len(people) < 2:
        return crop.turned(turns)
    joint_sigmas = sigmas(skeleton)
    nearer = np.zeros(len(people), bool) if foreground is None else foreground.nearer
    others = [other for other, is_nearer in zip(people, nearer)
              if not is_nearer and _reaches(other, (left, top), (right, bottom))
              and similarity(other, person, joint_sigmas) < ENSEMBLE.duplicate]
    return cover_others(crop, person, others, skeleton, foreground).turned(turns)


def quarter_turns(person: np.ndarray, skeleton: SkeletonModel) -> int:
    """Return by how many quarter turns, counter-clockwise, a person has to be turned to be upright: 0 to 3.

    Args:
        person: (K, 3) float: x, y, score; NaN where missing.
        skeleton: their K joints.
    """
    shoulders, hips, knees, ankles = (
        _middle(person, skeleton, joint) for joint in ('shoulder', 'hip', 'knee', 'ankle'))
    # somebody who bends down stands all the same: the legs tell, where they are seen
    along = [shoulders - end for end in (ankles, knees, hips) if np.isfinite(end).all()]
    if not along or not np.isfinite(shoulders).all() or not np.isfinite(hips).all():
        return 0
    angle = np.degrees(np.arctan2(along[0][0], -along[0][1]))
    return 0 if abs(angle) < CROP.least_tilt else int(np.rint(angle / 90)) % 4


def _middle(person: np.ndarray, skeleton: SkeletonModel, joint: str) -> np.ndarray:
    """Return the middle of left and right joint of a person, (2,) [px]; of one, if the other is unsure; else NaN."""
    pair = person[[skeleton.index[f'{side}_{joint}'] for side in ('left', 'right')]]
    sure = pair[pair[:, 2] >= CROP.sure_joint, :2]
    return sure.mean(axis=0) if len(sure) else np.full(2, np.nan)


def _reaches(person: np.ndarray, corner: Tuple[int, int], opposite: Tuple[int, int]) -> bool:
    """Return whether a body may reach into a part of the image: its limbs and head are broader than its joints."""
    low, high = extent(person)
    border = COVER.head * (high - low).max()
    return bool((high + border >= corner).all() and (low - border <= opposite).all())


def _shows_another(pose: np.ndarray, person: np.ndarray, people: np.ndarray, joint_sigmas: np.ndarray) -> bool:
    """Return whether a crop of a person shows another one of (P, K, 3) people rather."""
    alike = similarity(pose, person, joint_sigmas)
    return any(similarity(pose, other, joint_sigmas) > alike
               and similarity(person, other, joint_sigmas) < ENSEMBLE.duplicate for other in people)


def decode_crop(crop: ComputedView, model: Model, params: DirectDecodeParams, skeleton: SkeletonModel) -> Poses:
    """Find the people in a crop, in pixels of the image and the joints of a skeleton; those beyond it are missing."""
    plan = crop.view.plan
    poses = crop.view.in_image(decode_direct(crop.outputs, model, params, plan.net_size, plan.scaled_size),
                               model.skeleton)
    return Poses(keypoints_in(poses.keypoints, model.skeleton, skeleton), poses.scores)


def _crop_square(person: np.ndarray, margin: float, size: Tuple[int, int]) -> Tuple[int, int, int, int]:
    """Return left, top, right, bottom [px] of the square around a person; its centre lies in the image."""
    sure = person[person[:, 2] >= CROP.sure_joint]
    low, high = extent(sure if len(sure) > 1 else person)
    most = np.sqrt(CROP.most_area * size[0] * size[1])
    half = max(min(margin * (high - low).max(), most), CROP.least_side) / 2
    left, top = np.floor(np.clip((low + high) / 2, 0, np.subtract(size, 1)) - half).astype(int).tolist()
    side = int(np.ceil(2 * half)) + 1
    return left, top, left + side, top + side

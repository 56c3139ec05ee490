"""Crops: what a network sees of one person, the people that it finds there, and the refinement of a search by them."""
import time
from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.decode.direct import DirectDecodeParams, decode_direct
from openpose_ros_pkg.detect.occlusion_masks import COVER, Foreground, cover_others, foregrounds, vote_behind
from openpose_ros_pkg.detect.recipes import CropRefinement
from openpose_ros_pkg.detect.views import ComputedView, PreparedImage, PreparedView, View
from openpose_ros_pkg.ensemble import (
    ENSEMBLE,
    EnsembleConstants,
    Opinions,
    extent,
    most_alike,
    person_scores,
    sigmas,
    similarity,
)
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.model_types import Decoder, Model
from openpose_ros_pkg.networks.preprocess import fit_image
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import Poses, keypoints_in
from openpose_ros_pkg.skeletons import SkeletonModel


@dataclass(frozen=True)
class CropConstants:
    """How a person is cut out of the image."""

    least_side: int = constant(16, 'Least side of a crop; below, there is nothing to see.', unit='px')
    most_area: float = constant(
        9.0, 'Greatest area of a crop per area of the image: a person close before the camera, or in a long thin '
             'image, shall not take gigabytes.')


CROP = CropConstants()


class CrowdImage(NamedTuple):
    """An image, (H, W, 3) uint8 BGR, and its people, (K, 3) float each, with the joints of a skeleton."""

    bgr: np.ndarray
    people: Sequence[np.ndarray]
    skeleton: SkeletonModel


def prepare_crop(image: CrowdImage, person: np.ndarray, refinement: CropRefinement,
                 foreground: Optional[Foreground] = None, constants: CropConstants = CROP) -> PreparedView:
    """Cut a person out of an image; for a network that shows one person, upright and with the others covered.

    Args:
        person: (K, 3) float: x, y [px of the image], score; NaN where missing. One joint at least is there.
        foreground: in front of the person; None: no person, or unknown.
    """
    bgr, people, skeleton = image
    size = (bgr.shape[1], bgr.shape[0])
    left, top, right, bottom = _crop_square(person, refinement.margin, size, constants)
    if not refinement.centred:
        left, top, right, bottom = max(left, 0), max(top, 0), min(right, size[0]), min(bottom, size[1])
    recipe = refinement.model.input
    plan = fit_image((right - left, bottom - top), refinement.side, refinement.side, recipe.multiple_of, whole_box=True)
    crop = View(plan, refinement.mirror, (left, top), size).prepare(bgr, recipe.padding)
    if refinement.model.decoder != Decoder.MOVENET_SINGLEPOSE:
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


def compute_crops(views: Sequence[PreparedView], network: Backend) -> List[ComputedView]:
    """Let the network compute crops, side by side where it can; see `Backend.infer_many`."""
    begin = time.perf_counter()
    outputs = network.infer_many([view.input[np.newaxis] for view in views])
    seconds = (time.perf_counter() - begin) / max(len(views), 1)
    return [ComputedView(view.view, tuple(output[0] for output in of_view), seconds)
            for view, of_view in zip(views, outputs)]


def decode_crop(crop: ComputedView, model: Model, params: DirectDecodeParams, skeleton: SkeletonModel) -> Poses:
    """Find the people in a crop, in pixels of the image and the joints of a skeleton; those beyond it are missing."""
    plan = crop.view.plan
    poses = crop.view.in_image(decode_direct(crop.outputs, model, params, plan.net_size, (0, 0, *plan.scaled_size)),
                               model.skeleton)
    return Poses(keypoints_in(poses.keypoints, model.skeleton, skeleton), poses.scores)


class Candidates(NamedTuple):
    """Candidates for people after the vote, also below the thresholds."""

    opinions: List[Opinions]  # of each person
    keypoints: np.ndarray  # (P, K, 3) float32: x, y [px of the image], score; where the opinions place the joints

    @property
    def poses(self) -> Poses:
        """The people without the opinions on them."""
        return Poses(self.keypoints, person_scores(self.keypoints))


def refine(frame: PreparedImage, people: Candidates, ensemble: EnsembleConstants = ENSEMBLE
           ) -> Tuple[Candidates, float]:
    """Vote again on the surest people with crops of them; doubtful ones seldom become people by it.

    Returns:
        The people with the opinions on crops, and the time that the networks took [s].
    """
    bgr, setup, recipe, skeleton = frame.bgr, frame.setup, frame.setup.recipe, frame.setup.recipe.skeleton
    joint_sigmas, scores = sigmas(skeleton), person_scores(people.keypoints)
    surest = np.argsort(-scores, kind='stable')[:recipe.max_refined]
    refined = surest[scores[surest] >= setup.acceptance.person_score].tolist()
    shown = people.keypoints[refined]
    in_front = foregrounds(shown, skeleton, frame.depth, (bgr.shape[1], bgr.shape[0]))
    crops = [[prepare_crop(CrowdImage(bgr, shown, skeleton), person, one, foreground)
              for person, foreground in zip(shown, in_front)] for one in recipe.refinements]
    begin = time.perf_counter()
    computed = [compute_crops(views, setup.networks[one.model.name]) for one, views in zip(recipe.refinements, crops)]
    seconds = time.perf_counter() - begin
    opinions: List[Opinions] = [dict(known) for known in people.opinions]
    for number, (one, views) in enumerate(zip(recipe.refinements, computed), start=recipe.pass_opinions):
        for i, crop in zip(refined, views):
            found = decode_crop(crop, one.model, setup.direct, skeleton).keypoints
            pose = most_alike(found, people.keypoints[i], shown, joint_sigmas, ensemble)
            if pose is not None:
                opinions[i][number] = pose
    keypoints = people.keypoints.copy()
    for i, foreground in zip(refined, in_front):
        keypoints[i] = vote_behind(opinions[i], foreground, recipe)
    return people._replace(opinions=opinions, keypoints=keypoints), seconds


def quarter_turns(person: np.ndarray, skeleton: SkeletonModel) -> int:
    """Return by how many quarter turns, counter-clockwise, a person, (K, 3), has to be turned to be upright: 0 to 3."""
    shoulders, hips, knees, ankles = (
        _middle(person, skeleton, joint, COVER.sure_joint) for joint in ('shoulder', 'hip', 'knee', 'ankle'))
    # a person who bends down stands all the same: visible legs tell the direction
    along = [shoulders - end for end in (ankles, knees, hips) if np.isfinite(end).all()]
    if not along or not np.isfinite(shoulders).all() or not np.isfinite(hips).all():
        return 0
    angle = np.degrees(np.arctan2(along[0][0], -along[0][1]))
    return int(np.rint(angle / 90)) % 4


def _middle(person: np.ndarray, skeleton: SkeletonModel, joint: str, least: float) -> np.ndarray:
    """Return the middle of left and right joint of a person, (2,) [px]; of one, if the other is unsure; else NaN."""
    pair = person[[skeleton.index[f'{side}_{joint}'] for side in ('left', 'right')]]
    sure = pair[pair[:, 2] >= least, :2]
    return sure.mean(axis=0) if len(sure) else np.full(2, np.nan)


def _reaches(person: np.ndarray, corner: Tuple[int, int], opposite: Tuple[int, int]) -> bool:
    """Return whether a body may reach into a part of the image: its limbs and head are broader than its joints."""
    low, high = extent(person)
    border = COVER.breadth * (high - low).max()
    return bool((high + border >= corner).all() and (low - border <= opposite).all())


def _crop_square(person: np.ndarray, margin: float, size: Tuple[int, int], constants: CropConstants
                 ) -> Tuple[int, int, int, int]:
    """Return left, top, right, bottom [px] of the square around a person; its centre lies in the image."""
    sure = person[person[:, 2] >= COVER.sure_joint]
    low, high = extent(sure if len(sure) > 1 else person)
    most = np.sqrt(constants.most_area * size[0] * size[1])
    half = max(min(margin * (high - low).max(), most), constants.least_side) / 2
    left, top = np.floor(np.clip((low + high) / 2, 0, np.subtract(size, 1)) - half).astype(int).tolist()
    side = int(np.ceil(2 * half)) + 1
    return left, top, left + side, top + side

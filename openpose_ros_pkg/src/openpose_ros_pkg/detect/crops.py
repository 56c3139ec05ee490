"""Crops: what a network sees of one person, the people that it finds there, and the refinement of a search by them."""
import time
from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.decode.direct import DirectDecodeParams, decode_direct
from openpose_ros_pkg.detect.following import FOLLOWING, disagreement
from openpose_ros_pkg.detect.joint_assignment import Tracked, share_out
from openpose_ros_pkg.detect.occlusion_masks import (
    COVER,
    LAYERS,
    Foreground,
    cover_others,
    foregrounds,
    median_depths,
    vote_behind,
)
from openpose_ros_pkg.detect.recipes import CropRefinement
from openpose_ros_pkg.detect.views import ComputedView, PreparedImage, PreparedView, View
from openpose_ros_pkg.ensemble import (
    ENSEMBLE,
    Opinions,
    most_alike,
    person_scores,
    sigmas,
    similarity,
)
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.model_types import Decoder, Model
from openpose_ros_pkg.networks.preprocess import fit_image
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import ExpectedPeople, Poses, keypoints_in
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
    """An image, (H, W, 3) uint8 BGR, and its people, (P, K, 3) float, with the joints of a skeleton."""

    bgr: np.ndarray
    people: np.ndarray
    skeleton: SkeletonModel


def prepare_crops(image: CrowdImage, persons: np.ndarray, refinement: CropRefinement,
                  in_front: Sequence[Optional[Foreground]] = (), constants: CropConstants = CROP
                  ) -> List[PreparedView]:
    """Cut people out of an image; for a network that shows one person, upright and with the others covered.

    Args:
        persons: (N, K, 3) float: x, y [px of the image], score; NaN where missing. One joint at least is there.
        in_front: of each; None: no person, or unknown.
    """
    bgr, people, skeleton = image
    size, recipe = (bgr.shape[1], bgr.shape[0]), refinement.model.input
    squares = _crop_squares(persons, refinement, size, constants)
    if not refinement.centred:
        squares = np.concatenate([np.maximum(squares[:, :2], 0), np.minimum(squares[:, 2:], size)], axis=1)
    crops = []
    for left, top, right, bottom in squares.tolist():
        plan = fit_image((right - left, bottom - top), refinement.side, refinement.side, recipe.multiple_of,
                         whole_box=True)
        crops.append(View(plan, refinement.mirror, (left, top), size).prepare(bgr, recipe.padding))
    if refinement.model.decoder != Decoder.MOVENET_SINGLEPOSE:
        return crops
    if len(people) > 1:
        others = _reach(people, squares) & (
            similarity(people, persons[:, None], sigmas(skeleton)) < ENSEMBLE.duplicate)
        crops = [cover_others(crop, person, people[other if front is None else other & ~front.nearer], skeleton, front)
                 for crop, person, other, front in zip(crops, persons, others, in_front or len(crops) * [None])]
    return [crop.turned(turns) for crop, turns in zip(crops, quarter_turns(persons, skeleton).tolist())]


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


def refine(frame: PreparedImage, people: Candidates, expected: Optional[ExpectedPeople] = None
           ) -> Tuple[Candidates, float]:
    """Vote again on the surest people with crops of them; doubtful ones seldom become people by it.

    Tracked people who are missing are looked for on crops too, see `joint_assignment`.

    Args:
        expected: by tracks in space; None: no such tracks.

    Returns:
        The people with the opinions on crops, and the time that the networks took [s].
    """
    setup, recipe, skeleton = frame.setup, frame.setup.recipe, frame.setup.recipe.skeleton
    size, scores = (frame.bgr.shape[1], frame.bgr.shape[0]), person_scores(people.keypoints)
    surest = np.argsort(-scores, kind='stable')[:recipe.max_refined]
    refined = surest[scores[surest] >= setup.acceptance.person_score].tolist()
    tracked = Tracked.within(expected, skeleton, size)
    shared = share_out([people.opinions[i] for i in refined], [people.keypoints[i] for i in refined], tracked)
    shown = np.array(shared.poses, np.float32).reshape(-1, len(skeleton.joints), 3)
    in_front = foregrounds(shown, skeleton, frame.depth, size)
    found, seconds = _crop_opinions(frame, shown, in_front)
    opinions, keypoints = list(people.opinions), list(people.keypoints)
    for row, (of_person, on_crops, foreground) in enumerate(zip(shared.opinions, found, in_front)):
        if row < len(refined):
            opinions[refined[row]] = {**of_person, **on_crops}
            keypoints[refined[row]] = vote_behind(opinions[refined[row]], foreground, recipe)
            continue
        track = shared.missing[row - len(refined)]
        on_crops = {number: pose for number, pose in on_crops.items()
                    if _is_there(pose, tracked.poses[track], tracked.depths[track], frame)}
        if on_crops:
            opinions.append({**of_person, **on_crops})
            keypoints.append(vote_behind(opinions[-1], foreground, recipe))
    return Candidates(opinions, np.array(keypoints, np.float32).reshape(-1, len(skeleton.joints), 3)), seconds


def _crop_opinions(frame: PreparedImage, people: np.ndarray, in_front: Sequence[Optional[Foreground]]
                   ) -> Tuple[List[Opinions], float]:
    """Return the opinions on crops of people, (P, K, 3), by person, and the time that the networks took [s]."""
    setup, recipe, skeleton = frame.setup, frame.setup.recipe, frame.setup.recipe.skeleton
    crops = [prepare_crops(CrowdImage(frame.bgr, people, skeleton), people, one, in_front)
             for one in recipe.refinements]
    begin = time.perf_counter()
    computed = [compute_crops(views, setup.networks[one.model.name]) for one, views in zip(recipe.refinements, crops)]
    seconds = time.perf_counter() - begin
    opinions: List[Opinions] = [{} for _ in people]
    for number, (one, views) in enumerate(zip(recipe.refinements, computed), start=recipe.pass_opinions):
        for i, crop in enumerate(views):
            found = decode_crop(crop, one.model, setup.direct, skeleton).keypoints
            pose = most_alike(found, people[i], people, sigmas(skeleton))
            if pose is not None:
                opinions[i][number] = pose
    return opinions, seconds


def _is_there(pose: np.ndarray, expected: np.ndarray, depth: float, frame: PreparedImage) -> bool:
    """Return whether a pose on a crop, (K, 3), is of a person who is expected, and some joints are at the depth."""
    if pose[:, 2].mean() < COVER.sure_joint or disagreement(pose, expected) > FOLLOWING.agreement:
        return False
    sure = pose[:, 2] >= COVER.sure_joint
    if frame.depth is not None:
        surfaces = median_depths(frame.depth, pose[:, :2], (frame.bgr.shape[1], frame.bgr.shape[0]))
        with np.errstate(invalid='ignore'):
            sure &= np.abs(surfaces - depth) < LAYERS.reach
    return bool(sure.sum() >= frame.setup.acceptance.person_joints)


def quarter_turns(people: np.ndarray, skeleton: SkeletonModel) -> np.ndarray:
    """Return by how many quarter turns, counter-clockwise, people, (P, K, 3), have to be turned to be upright.

    Returns:
        (P,) int, 0 to 3.
    """
    pairs = np.array([[skeleton.index[f'{side}_{joint}'] for side in ('left', 'right')]
                      for joint in ('shoulder', 'ankle', 'knee', 'hip')])
    shoulders, *ends = np.moveaxis(_middles(people[:, pairs], COVER.sure_joint), 1, 0)
    # a person who bends down stands all the same: visible legs tell the direction
    along = shoulders - np.select([np.isfinite(end) for end in ends], ends, np.nan)
    angles = np.degrees(np.arctan2(along[:, 0], -along[:, 1]))
    upright = np.isnan(angles) | np.isnan(ends[-1][:, 0])
    return np.rint(np.where(upright, 0.0, angles) / 90).astype(np.int64) % 4


def _middles(pairs: np.ndarray, least: float) -> np.ndarray:
    """Return the middles of pairs of joints, (..., 2, 3), as (..., 2) [px]; of one, if the other is unsure; else NaN.
    """
    sure = (pairs[..., 2] >= least)[..., None]
    with np.errstate(invalid='ignore'):
        return np.where(sure, pairs[..., :2], 0.0).sum(axis=-2) / sure.sum(axis=-2)


def _reach(people: np.ndarray, squares: np.ndarray) -> np.ndarray:
    """Return which of P bodies, (P, K, 3), may reach into which of N parts of the image, (N, 4), as (N, P) bool.

    Limbs and head are broader than the joints.
    """
    low, high = np.fmin.reduce(people[..., :2], axis=1), np.fmax.reduce(people[..., :2], axis=1)
    border = COVER.breadth * (high - low).max(axis=1, keepdims=True)
    return ((high + border >= squares[:, None, :2]) & (low - border <= squares[:, None, 2:])).all(axis=2)


def _crop_squares(people: np.ndarray, refinement: CropRefinement, size: Tuple[int, int], constants: CropConstants
                  ) -> np.ndarray:
    """Return left, top, right, bottom of the squares around people, (P, 4) int64 [px]; centres lie in the image.

    Squares that are halved or more have sides that are multiples of a whole factor, by which that is fast.
    """
    sure = people[..., 2] >= COVER.sure_joint
    sure |= (sure.sum(axis=1) < 2)[:, None]
    xy = np.where(sure[..., None], people[..., :2], np.nan)
    low, high = np.fmin.reduce(xy, axis=1), np.fmax.reduce(xy, axis=1)
    most = np.sqrt(constants.most_area * size[0] * size[1])
    longer = (high - low).max(axis=1, keepdims=True).astype(np.float64)
    half = np.maximum(np.minimum(refinement.margin * longer, most), constants.least_side) / 2
    middle = np.minimum(np.maximum((low + high) / 2, 0), np.subtract(size, 1))
    corner, side = np.floor(middle - half).astype(np.int64), np.ceil(2 * half).astype(np.int64) + 1
    side += -side % np.maximum(side // refinement.side, 1)
    return np.concatenate([corner, corner + side], axis=1)

"""Crop refinement: a network sees each person a second time, on a crop, and the opinions are voted on again."""
from dataclasses import dataclass
from typing import Tuple

import numpy as np

from openpose_ros_pkg.decode.direct import DirectDecodeParams, decode_direct
from openpose_ros_pkg.detect.ensemble import Candidates, Opinions, most_alike, person_scores, vote
from openpose_ros_pkg.detect.recipes import CROP_MODEL, CropRefinement, Recipe
from openpose_ros_pkg.detect.views import ComputedView, PreparedView, View
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.preprocess import fit_image
from openpose_ros_pkg.oks import extent, sigmas
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import Poses


@dataclass(frozen=True)
class CropConstants:
    """How a person is cut out of the image."""

    least_side: int = constant(16, 'Least side of a crop; below, there is nothing to see.', unit='px')
    sure_joint: float = constant(
        0.25, 'Joints with a lower score do not widen the crop: they are guesses, often of what is out of sight.')


CROP = CropConstants()


def refine(people: Candidates, bgr: np.ndarray, recipe: Recipe, network: Backend, direct: DirectDecodeParams,
           min_score: float) -> Tuple[Candidates, float]:
    """Let the network see the surest people on crops; doubtful ones seldom become people by it.

    Args:
        bgr: (H, W, 3) uint8 BGR, the image.
        recipe: how people are refined, and how many at most.
        direct: thresholds of the decoder.
        min_score: of a person, before the recipe's acceptance.

    Returns:
        The people, and the time that the network took [s].
    """
    joint_sigmas, scores = sigmas(recipe.skeleton), person_scores(people.keypoints)
    surest = np.argsort(-scores, kind='stable')[:recipe.max_refined]
    keypoints, seconds = people.keypoints.copy(), 0.0
    for i in surest[scores[surest] >= recipe.acceptance * min_score]:
        opinions: Opinions = dict(people.opinions[i])
        for number, refinement in enumerate(recipe.refinements, start=recipe.pass_opinions):
            crop = prepare_crop(bgr, people.keypoints[i], refinement, recipe.crop_side).compute(network)
            seconds += crop.seconds
            pose = most_alike(decode_crop(crop, direct).keypoints, people.keypoints[i], joint_sigmas)
            if pose is not None:
                opinions[number] = pose
        keypoints[i] = vote(opinions, recipe.weights, joint_sigmas)
    return Candidates(people.opinions, keypoints), seconds


def prepare_crop(bgr: np.ndarray, person: np.ndarray, refinement: CropRefinement, side: int) -> PreparedView:
    """Cut a person out of an image.

    Args:
        bgr: (H, W, 3) uint8 BGR.
        person: (K, 3) float: x, y [px of the image], score.
        side: of the network's input [px].
    """
    left, top, right, bottom = _crop_box(person, refinement.margin, bgr.shape)
    recipe = CROP_MODEL.input
    plan = fit_image((right - left, bottom - top), side, side, recipe.multiple_of, whole_box=True)
    return View(plan, refinement.mirror, (left, top)).prepare(bgr, recipe.padding)


def decode_crop(crop: ComputedView, params: DirectDecodeParams) -> Poses:
    """Find the people in a crop, in pixels of the image."""
    plan = crop.view.plan
    poses = decode_direct(crop.outputs, CROP_MODEL, params, plan.net_size, plan.scaled_size)
    return crop.view.in_image(poses, CROP_MODEL.skeleton)


def _crop_box(person: np.ndarray, margin: float, shape: Tuple[int, ...]) -> Tuple[int, int, int, int]:
    """Return left, top, right, bottom [px] of the square around a person, clipped to the image."""
    sure = person[person[:, 2] >= CROP.sure_joint]
    low, high = extent(sure if len(sure) > 1 else person)
    half = max(margin * (high - low).max(), CROP.least_side) / 2
    centre = (low + high) / 2
    left, top = np.maximum(np.floor(centre - half), 0).astype(int).tolist()
    right, bottom = np.minimum(np.ceil(centre + half) + 1, shape[1::-1]).astype(int).tolist()
    return left, top, right, bottom

"""Crop refinement: networks compute crops of the people of a full search, and all opinions are voted on again."""
import time
from typing import List, NamedTuple, Tuple

import numpy as np

from openpose_ros_pkg.detect.crops import CrowdImage, compute_crops, decode_crop, prepare_crop
from openpose_ros_pkg.detect.occlusion_masks import foregrounds, vote_behind
from openpose_ros_pkg.detect.views import PreparedImage
from openpose_ros_pkg.ensemble import ENSEMBLE, EnsembleConstants, Opinions, most_alike, person_scores, sigmas
from openpose_ros_pkg.people import Poses


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

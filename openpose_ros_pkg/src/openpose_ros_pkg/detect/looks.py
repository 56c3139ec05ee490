"""How networks look at a picture: all of it, in one or more sizes, or one person cut out of it."""
from dataclasses import dataclass
from typing import List, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.decode.direct import DirectDecodeParams, decode_direct
from openpose_ros_pkg.decode.fields import average_fields
from openpose_ros_pkg.decode.paf import DecodeParams, decode_fields
from openpose_ros_pkg.detect.ensemble import most_alike
from openpose_ros_pkg.detect.oks import extent
from openpose_ros_pkg.detect.recipes import CLOSE_MODEL, CloserLook, Look
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.preprocess import ImageToNet, fit_image
from openpose_ros_pkg.skeletons import SkeletonModel

# A person's cut-out has sides of so many pixels at least; below, there is nothing to see.
_LEAST_CUT = 16
# Joints with a lower score are guesses, often of what is out of sight: they would make the cut-out too large.
_SURE_JOINT = 0.25

People = Tuple[np.ndarray, np.ndarray]
"""Keypoints (P, K, 3) float32: x, y [px of the image], score, NaN, NaN, 0 where missing; scores (P,) float32."""


@dataclass
class View:
    """The picture as a network sees it once, and what the network says.

    Attributes:
        plan: how the picture became the network's input.
        mirror: whether it is the mirror image.
        image: (H, W, 3) uint8 BGR, the network's input.
        outputs: of the network, without the axis of the pictures.
    """

    plan: ImageToNet
    mirror: bool
    image: np.ndarray
    outputs: Tuple[np.ndarray, ...] = ()

    def compute(self, network: Backend) -> None:
        """Let the network look."""
        self.outputs = tuple(output[0] for output in network.infer(self.image[np.newaxis]))


def plans_of(size: Tuple[int, int], look: Look) -> List[ImageToNet]:
    """Return how a picture of (width, height) [px] is brought to each size of a look.

    Raises:
        BadInputError: it is too long and thin.
    """
    recipe = look.model.input
    width, height = recipe.fixed_size or look.box
    return [fit_image(size, width, height, recipe.multiple_of, zoom, whole_box=recipe.fixed_size is not None)
            for zoom in look.zooms]


def views_of(bgr: np.ndarray, look: Look) -> List[View]:
    """Bring a picture, (H, W, 3) uint8 BGR, to the sizes of a look.

    Raises:
        BadInputError: it is too long and thin.
    """
    padding = look.model.input.padding
    views = []
    for plan in plans_of((bgr.shape[1], bgr.shape[0]), look):
        views.append(View(plan, False, plan.apply(bgr, padding)))
        if look.mirror:
            # what pads the picture stays at the right, where the plan has it
            views.append(View(plan, True, plan.apply(np.ascontiguousarray(bgr[:, ::-1]), padding)))
    return views


def people_of_look(look: Look, views: Sequence[View], decode_params: DecodeParams,
                   direct_params: DirectDecodeParams) -> List[People]:
    """Decode what a network said: one opinion of its averaged fields, or one for each view."""
    model = look.model
    if model.decoder == 'paf':
        fields = [view.outputs[0] if len(view.outputs) == 1 else np.concatenate(view.outputs) for view in views]
        plan = views[0].plan
        mean = average_fields(fields, [view.plan for view in views], [view.mirror for view in views], model)
        keypoints, scores = decode_fields(mean, model, decode_params, plan.scaled_size)
        keypoints[..., :2] = plan.to_image(keypoints[..., :2])
        return [(keypoints, scores)]
    return [_direct(look.model.skeleton, view, decode_direct(view.outputs, model, direct_params, view.plan.net_size,
                                                             view.plan.scaled_size)) for view in views]


def look_closer(bgr: np.ndarray, person: np.ndarray, look: CloserLook, side: int, network: Backend,
                params: DirectDecodeParams, joint_sigmas: np.ndarray) -> Optional[np.ndarray]:
    """Cut a person out of the picture, let the network look at it, and return what it says of this person.

    Args:
        bgr: (H, W, 3) uint8 BGR.
        person: (K, 3) float: x, y [px of the picture], score.
        side: of the network's input [px].
        joint_sigmas: (K,) float, of `oks.sigmas`.

    Returns:
        (K, 3) float32, or None where it sees nobody like that.
    """
    left, top, right, bottom = _cut(person, look.margin, bgr.shape)
    cut = bgr[top:bottom, left:right]
    if look.mirror:
        cut = np.ascontiguousarray(cut[:, ::-1])
    recipe = CLOSE_MODEL.input
    plan = fit_image((right - left, bottom - top), side, side, recipe.multiple_of, whole_box=True)
    view = View(plan, look.mirror, plan.apply(cut, recipe.padding))
    view.compute(network)
    poses, _ = _direct(CLOSE_MODEL.skeleton, view,
                       decode_direct(view.outputs, CLOSE_MODEL, params, plan.net_size, plan.scaled_size))
    poses[..., :2] += (left, top)
    return most_alike(poses, person, joint_sigmas)


def _direct(skeleton: SkeletonModel, view: View, people: People) -> People:
    """Turn people in pixels of the network's input into those in pixels of the picture."""
    keypoints, scores = people
    keypoints[..., :2] = view.plan.to_image(keypoints[..., :2])
    if view.mirror:
        keypoints[..., 0] = view.plan.image_size[0] - 1 - keypoints[..., 0]
        keypoints = keypoints[:, list(skeleton.swap)]
    return keypoints, scores


def _cut(person: np.ndarray, margin: float, shape: Tuple[int, ...]) -> Tuple[int, int, int, int]:
    """Return left, top, right, bottom [px] of the square round a person, as far as it lies within the picture."""
    sure = person[person[:, 2] >= _SURE_JOINT]
    low, high = extent(sure if len(sure) > 1 else person)
    half = max(margin * (high - low).max(), _LEAST_CUT) / 2
    centre = (low + high) / 2
    left, top = np.maximum(np.floor(centre - half), 0).astype(int)
    right, bottom = np.minimum(np.ceil(centre + half) + 1, shape[1::-1]).astype(int)
    return left, top, right, bottom

"""What a network sees of an image: all of it at some sizes, or its mirror image; and the people it finds there."""
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Dict, List, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.decode.direct import DirectThresholds, decode_direct
from openpose_ros_pkg.decode.fields import average_fields
from openpose_ros_pkg.decode.paf import DECODE, DecodeParams, decode_fields
from openpose_ros_pkg.detect.recipes import DetectorSettings, NetworkPass, Recipe
from openpose_ros_pkg.ensemble import Acceptance
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.light import lit
from openpose_ros_pkg.networks.model_types import CROP_DECODERS, Decoder, InputRecipe, Model
from openpose_ros_pkg.networks.preprocess import ImageToNet, cut, fit_image, fit_recipe
from openpose_ros_pkg.people import Poses
from openpose_ros_pkg.skeletons import BODY_25, COCO_18, WHOLE_BODY_133, SkeletonModel

if TYPE_CHECKING:
    from openpose_ros_pkg.landmarks.body_landmarks import BodyLandmarkNetwork


@dataclass(frozen=True)
class Setup:
    """What a frame is computed with, whatever is reconfigured in the meantime."""

    recipe: Recipe
    networks: Dict[str, Backend]  # of the recipe, by the models' names
    decode: DecodeParams  # thresholds of the decoders; where several opinions follow, those of candidates
    direct: DirectThresholds
    settings: DetectorSettings  # as the user gave them
    feet: Optional['BodyLandmarkNetwork'] = None  # finds toes and heels; None: not wanted, or not there

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people: that of the recipe, and feet where they are wanted."""
        joints = self.recipe.skeleton
        return BODY_25 if joints == COCO_18 and self.settings.detector.feet else joints

    def of_crops(self, model: Model) -> DirectThresholds:
        """Return the thresholds for what a network sees on crops.

        SimCC networks place all joints also where there is no person, with scores that are not near 0, and between
        searches no other network tells that a person left: they have to be as sure as their makers ask.
        """
        if model.decoder not in CROP_DECODERS:
            return self.direct
        return replace(self.direct, person_score=DirectThresholds.person_score)

    @property
    def acceptance(self) -> Acceptance:
        """Which of the people that the networks find are reported."""
        factor, decode = self.recipe.acceptance, self.settings.decode
        return Acceptance(self.recipe.skeleton, factor * self.settings.ensemble.joint_min_score,
                          factor * decode.person_min_score, DECODE.person_joints, self.recipe.is_ensemble)


@dataclass(frozen=True)
class View:
    """A part of an image, brought to the size of a network's input."""

    plan: ImageToNet  # how the part becomes the input; its `image_size` is the size of the part
    mirror: bool = False  # whether the network sees the mirror image of the part
    # left and top of the part in the image [px]; the part may reach beyond the image, whose border is then repeated
    origin: Tuple[int, int] = (0, 0)
    # (width, height) of the image [px], beyond which joints are missing; None: the part is all of it
    within: Optional[Tuple[int, int]] = None
    turns: int = 0  # quarter turns, counter-clockwise, by which the network sees its input turned

    @property
    def net_size(self) -> Tuple[int, int]:
        """(width, height) of what the network sees [px]."""
        return self.seen.net_size

    @property
    def seen(self) -> ImageToNet:
        """How what the network sees lies in its input; an input that is turned has no padding."""
        return self.plan if self.turns % 2 == 0 else ImageToNet(
            *(size[::-1] for size in (self.plan.image_size, self.plan.scaled_size, self.plan.net_size)))

    def prepare(self, bgr: np.ndarray, recipe: InputRecipe) -> 'PreparedView':
        """Bring the part of an image, (H, W, 3) uint8 BGR, to a network's input; see `ImageToNet.apply` and `lit`."""
        part = cut(bgr, (*self.origin, *self.plan.image_size), recipe.padding)
        if self.mirror:
            # the padding stays at the right, where the plan has it
            part = np.ascontiguousarray(part[:, ::-1])
        scaled = self.plan.apply(part, recipe.padding)
        return PreparedView(self, lit(scaled) if recipe.lit else scaled)

    def boxes_in_image(self, boxes: np.ndarray) -> np.ndarray:
        """Turn boxes, (N, 4) x1, y1, x2, y2, in pixels of the network's input into boxes in pixels of the image."""
        corners = self.plan.to_image(boxes.reshape(-1, 2, 2))
        if self.mirror:
            corners[..., 0] = self.plan.image_size[0] - 1 - corners[:, ::-1, 0]
        return (corners + self.origin).reshape(-1, 4)

    def in_image(self, poses: Poses, skeleton: SkeletonModel) -> Poses:
        """Turn people in pixels of the network's input into people in pixels of the image, without those beyond it."""
        keypoints = self._in_image(poses.keypoints, skeleton)
        there = (keypoints[..., 2] > 0).any(axis=1)
        return Poses(keypoints[there], poses.scores[there],
                     None if poses.points is None else self._in_image(poses.points[there], WHOLE_BODY_133))

    def _in_image(self, keypoints: np.ndarray, skeleton: SkeletonModel) -> np.ndarray:
        """Return keypoints, (P, K, 3), of the network's input in pixels of the image; missing beyond it."""
        keypoints = keypoints.copy()
        for turn in reversed(range(self.turns)):
            x, y = keypoints[..., 0].copy(), keypoints[..., 1].copy()
            keypoints[..., 0], keypoints[..., 1] = self.plan.net_size[turn % 2] - 1 - y, x
        keypoints[..., :2] = self.plan.to_image(keypoints[..., :2])
        if self.mirror:
            keypoints[..., 0] = self.plan.image_size[0] - 1 - keypoints[..., 0]
            keypoints = keypoints[:, list(skeleton.swap)]
        keypoints[..., :2] += self.origin
        if self.within is not None:
            # a pixel reaches half a pixel beyond its centre
            there = (np.abs(keypoints[..., :2] + 0.5 - np.divide(self.within, 2)) <= np.divide(self.within, 2))
            keypoints[~there.all(axis=-1)] = (np.nan, np.nan, 0)
        return keypoints


@dataclass(frozen=True)
class PreparedView:
    """A view before the network has computed it; input: (H, W, 3) uint8 BGR."""

    view: View
    input: np.ndarray

    def turned(self, turns: int) -> 'PreparedView':
        """Return it with its input, which has to be without padding, turned by quarter turns counter-clockwise."""
        if not turns:
            return self
        return PreparedView(replace(self.view, turns=turns), np.ascontiguousarray(np.rot90(self.input, turns)))

    def compute(self, network: Backend) -> 'ComputedView':
        """Let the network compute it."""
        return ComputedView(self.view, tuple(output[0] for output in network.infer(self.input[np.newaxis])))


@dataclass(frozen=True)
class ComputedView:
    """A view after the network; outputs: of the network, without the axis of the images."""

    view: View
    outputs: Tuple[np.ndarray, ...]


def views_of(size: Tuple[int, int], network_pass: NetworkPass, columns: Optional[Tuple[int, int]] = None
             ) -> List[View]:
    """Return what a pass sees of an image, each size with its mirror image where that is wanted.

    Args:
        size: (width, height) of the image [px].
        columns: left and right end of a part of the image, which is seen as large as in the full image; None: all.

    Raises:
        BadInputError: it is too long and thin.
    """
    plans = [fit_recipe(size, network_pass.model.input, network_pass.box, zoom) for zoom in network_pass.zooms]
    left = 0
    if columns is not None and columns != (0, size[0]):
        left, right = columns
        plans = [fit_image((right - left, size[1]), -1, plan.scaled_size[1], network_pass.model.input.multiple_of)
                 for plan in plans]
    return [View(plan, mirror, (left, 0)) for plan in plans
            for mirror in ((False, True) if network_pass.mirror else (False,))]


def prepare_views(bgr: np.ndarray, network_pass: NetworkPass, columns: Optional[Tuple[int, int]] = None
                  ) -> List[PreparedView]:
    """Bring an image, (H, W, 3) uint8 BGR, to what a pass sees; see `views_of`."""
    return [view.prepare(bgr, network_pass.model.input)
            for view in views_of((bgr.shape[1], bgr.shape[0]), network_pass, columns)]


def decode_views(network_pass: NetworkPass, views: Sequence[ComputedView], setup: Setup) -> List[Poses]:
    """Find the people, in pixels of the image: one opinion from averaged fields, or one from each view."""
    model = network_pass.model
    if model.decoder == Decoder.PAF:
        first, fields = views[0].view, averaged_fields(views, model)
        poses = decode_fields(fields, model, setup.decode, first.plan.scaled_size)
        return [first.in_image(poses, model.skeleton)]
    return [view.view.in_image(decode_direct(view.outputs, model, setup.direct, view.view.seen), model.skeleton)
            for view in views]


def averaged_fields(views: Sequence[ComputedView], model: Model) -> np.ndarray:
    """Return the mean of what a network with part affinity fields gives, (C, h, w) float32 on the first view's grid."""
    fields = [view.outputs[0] if len(view.outputs) == 1 else np.concatenate(view.outputs) for view in views]
    return average_fields(fields, [view.view.plan for view in views], [view.view.mirror for view in views], model)

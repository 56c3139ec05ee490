"""Crops: what a network sees of one person, and the people that it finds there."""
from dataclasses import dataclass, replace
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.decode.boxes import BOXES, Boxes, decode_boxes, overlaps, without_overlap
from openpose_ros_pkg.decode.direct import decode_direct
from openpose_ros_pkg.detect.occlusion_masks import COVER, Foreground, cover_others
from openpose_ros_pkg.detect.recipes import PERSON_BOX, CropRefinement, NetworkPass
from openpose_ros_pkg.detect.views import ComputedView, PreparedView, Setup, View, decode_views
from openpose_ros_pkg.ensemble import ENSEMBLE, sigmas, similarity, surest
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.model_types import Decoder, Model
from openpose_ros_pkg.networks.preprocess import ImageToNet, fit_image
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
    most_boxes: int = constant(
        20, 'Boxes of an image in which people are looked for, the surest first, beside those of known people; bounds '
            'the time.')
    turned_box: float = constant(
        0.3, 'Score of a box in which a person may be upside down or lie.', source='trials.md, PP-TinyPose')
    turned_below: float = constant(
        0.3, 'Score of a pose in an upright box below which the box is seen turned, too.',
        source='trials.md, PP-TinyPose')
    turned_margin: float = constant(0.05, 'By so much a pose in a turned box has to be surer.')
    explained: float = constant(
        0.3, 'A box is of a person where both share more of their union.',
        source='rtmlib, pose_tracker.py, tracking_thr')


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
    turns = quarter_turns(persons, skeleton) if refinement.one_person else np.zeros(len(persons), np.int64)
    sizes = np.where(turns[:, None] % 2 == 1, refinement.size[::-1], refinement.size)
    regions = _regions(_boxes(persons), sizes, refinement, (bgr.shape[1], bgr.shape[0]), constants)
    crops = _cut_out(bgr, regions, sizes, refinement)
    if not refinement.one_person:
        return crops
    if len(people) > 1:
        others = _reach(people, regions) & (
            similarity(people, persons[:, None], sigmas(skeleton)) < ENSEMBLE.duplicate)
        crops = [cover_others(crop, person, people[other if front is None else other & ~front.nearer], skeleton, front)
                 for crop, person, other, front in zip(crops, persons, others, in_front or len(crops) * [None])]
    # in the mirror image, a person who lies on one side lies on the other
    return [crop.turned(-turn % 4 if refinement.mirror else turn) for crop, turn in zip(crops, turns.tolist())]


def alone(persons: np.ndarray, image: CrowdImage) -> np.ndarray:
    """Return which of N persons, (N, K, 3), are upright with no other person of the image near, (N,) bool.

    A crop of theirs shows what a network saw in the box of the person.
    """
    regions = _enlarged(_boxes(persons), 2 * PERSON_BOX - 1)
    others = similarity(image.people, persons[:, None], sigmas(image.skeleton)) < ENSEMBLE.duplicate
    return (quarter_turns(persons, image.skeleton) == 0) & ~(_reach(image.people, regions) & others).any(axis=1)


def _cut_out(bgr: np.ndarray, regions: np.ndarray, sizes: np.ndarray, refinement: CropRefinement
             ) -> List[PreparedView]:
    """Bring regions of an image, (N, 4) [px], to inputs of (N, 2) sizes [px]."""
    recipe, size = refinement.model.input, (bgr.shape[1], bgr.shape[0])
    crops = []
    for (left, top, right, bottom), (width, height) in zip(regions.tolist(), sizes.tolist()):
        part = right - left, bottom - top
        # the sides of a region are rounded to whole pixels
        plan = (ImageToNet(part, (width, height), (width, height)) if refinement.centred else
                fit_image(part, width, height, recipe.multiple_of, whole_box=True))
        crops.append(View(plan, refinement.mirror, (left, top), size).prepare(bgr, recipe))
    return crops


def found_by(one: NetworkPass, views: Sequence[ComputedView], bgr: np.ndarray, setup: Setup,
             known: Optional[np.ndarray] = None) -> List[Poses]:
    """Return the people that a pass found, one opinion each, with the joints of the recipe.

    A network of boxes has no joints: its people are what the network for crops finds in the boxes.

    Args:
        known: (P, K, 3) people whose place in the image is known: a box of one of them takes no crop, it confirms the
            person. None: there are none.
    """
    joints = setup.recipe.skeleton
    if one.crop is None:
        return [in_joints(poses, one.skeleton, joints) for poses in decode_views(one, views, setup)]
    people = np.zeros((0, len(joints.joints), 3), np.float32) if known is None else known
    found = [decode_boxes(view.outputs, 0.0, view.view.net_size, one.model.decoder) for view in views]
    boxes = np.concatenate([view.view.boxes_in_image(each.boxes) for view, each in zip(views, found)])
    scores = np.concatenate([each.scores for each in found])
    overlap = BOXES.picodet_overlap if one.model.decoder == Decoder.PICODET else BOXES.yolox_overlap
    kept = without_overlap(boxes, scores, overlap) if len(views) > 1 else np.arange(len(boxes))
    return [_in_boxes(Boxes(boxes[kept], scores[kept]), one.crop, bgr, setup, people)]


def _in_boxes(found: Boxes, one: CropRefinement, bgr: np.ndarray, setup: Setup, known: np.ndarray,
              constants: CropConstants = CROP) -> Poses:
    """Return the people in boxes of an image, the known ones first, the others on crops of the boxes."""
    recipe, size = setup.recipe, (bgr.shape[1], bgr.shape[0])
    boxes = np.clip(found.boxes.reshape(-1, 2, 2), 0, np.subtract(size, 1)).reshape(-1, 4)
    around = _enlarged(_boxes(known), PERSON_BOX) if len(known) else np.zeros((0, 4))
    shared = overlaps(around, boxes)
    pairs = match(1 - shared, shared >= constants.explained)
    others = np.delete(np.arange(len(boxes)), [box for _, box in pairs])[:constants.most_boxes]
    boxes, trust = boxes[others], found.scores[others]
    seen = _upright(bgr, boxes, trust, one, setup, constants)
    # a network for crops is sure of joints that are none; the box tells that a person is there
    seen = [poses._replace(keypoints=poses.keypoints * np.array([1, 1, share], np.float32), scores=poses.scores * share)
            for poses, share in zip(seen, trust)]
    people = np.concatenate([known[[person for person, _ in pairs]], *(poses.keypoints[:1] for poses in seen)])
    scores = np.concatenate([np.full(len(pairs), np.inf), *(poses.scores[:1] for poses in seen)])
    kept = surest(scores, similarity(people[:, None], people, sigmas(recipe.skeleton)) > ENSEMBLE.duplicate)
    return Poses(people[kept].astype(np.float32), np.minimum(scores[kept], 1).astype(np.float32))


def _upright(bgr: np.ndarray, boxes: np.ndarray, trust: np.ndarray, one: CropRefinement, setup: Setup,
             constants: CropConstants) -> List[Poses]:
    """Return the person in each of N boxes, (N, 4) [px] with scores (N,), seen turned where it is not sure upright."""
    def seen(chosen: Sequence[int], turns: int) -> List[Poses]:
        sizes = np.tile(one.size[::-1] if turns % 2 else one.size, (len(chosen), 1))
        in_box, size = replace(one, margin=one.margin / PERSON_BOX), (bgr.shape[1], bgr.shape[0])
        crops = _cut_out(bgr, _regions(boxes[chosen], sizes, in_box, size, constants), sizes, one)
        views = compute_crops([crop.turned(turns) for crop in crops], setup.networks[one.model.name])
        return [decode_crop(view, one.model, setup) for view in views]

    result = seen(range(len(boxes)), 0)
    scores = np.array([_person_score(poses) for poses in result])
    unsure = np.flatnonzero((scores < constants.turned_below) & (trust >= constants.turned_box)).tolist()
    least = scores + constants.turned_margin
    for turns in (1, 2, 3) if unsure else ():
        for i, poses in zip(unsure, seen(unsure, turns)):
            if _person_score(poses) > least[i]:
                result[i], least[i] = poses, _person_score(poses)
    return result


def _person_score(poses: Poses) -> float:
    return float(poses.scores[0]) if len(poses.scores) else 0.0


def _enlarged(boxes: np.ndarray, factor: float) -> np.ndarray:
    """Return boxes, (N, 4), with sides longer by a factor."""
    more = (boxes[:, 2:] - boxes[:, :2]) * (factor - 1) / 2
    return np.concatenate([boxes[:, :2] - more, boxes[:, 2:] + more], axis=1)


def compute_crops(views: Sequence[PreparedView], network: Backend) -> List[ComputedView]:
    """Let the network compute crops, side by side where it can; see `Backend.infer_many`."""
    outputs = network.infer_many([view.input[np.newaxis] for view in views])
    return [ComputedView(view.view, tuple(output[0] for output in of_view)) for view, of_view in zip(views, outputs)]


def decode_crop(crop: ComputedView, model: Model, setup: Setup) -> Poses:
    """Find the people in a crop, in pixels of the image and the joints of the recipe; those beyond it are missing."""
    view = crop.view
    poses = view.in_image(decode_direct(crop.outputs, model, setup.of_crops(model), view.seen), model.skeleton)
    return in_joints(poses, model.skeleton, setup.recipe.skeleton)


def in_joints(poses: Poses, source: SkeletonModel, target: SkeletonModel) -> Poses:
    """Return poses of one joint set in another; see `keypoints_in`."""
    return poses._replace(keypoints=keypoints_in(poses.keypoints, source, target))


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


def _reach(people: np.ndarray, regions: np.ndarray) -> np.ndarray:
    """Return which of P bodies, (P, K, 3), may reach into which of N parts of the image, (N, 4), as (N, P) bool.

    Limbs and head are broader than the joints.
    """
    low, high = np.fmin.reduce(people[..., :2], axis=1), np.fmax.reduce(people[..., :2], axis=1)
    border = COVER.breadth * (high - low).max(axis=1, keepdims=True)
    return ((high + border >= regions[:, None, :2]) & (low - border <= regions[:, None, 2:])).all(axis=2)


def _boxes(people: np.ndarray) -> np.ndarray:
    """Return left, top, right, bottom of the sure joints of people, (P, K, 3), as (P, 4) [px]."""
    sure = people[..., 2] >= COVER.sure_joint
    sure |= (sure.sum(axis=1) < 2)[:, None]
    xy = np.where(sure[..., None], people[..., :2], np.nan)
    return np.concatenate([np.fmin.reduce(xy, axis=1), np.fmax.reduce(xy, axis=1)], axis=1)


def _regions(boxes: np.ndarray, sizes: np.ndarray, refinement: CropRefinement, image_size: Tuple[int, int],
             constants: CropConstants) -> np.ndarray:
    """Return left, top, right, bottom of what networks see of boxes, (N, 4) int64 [px]; the middles lie in the image.

    Regions that are halved or more have sides that are multiples of a whole factor, by which that is fast.

    Args:
        boxes: (N, 4) of the joints of people [px].
        sizes: (N, 2) width and height of the inputs, whose aspect the regions have [px].
    """
    low, high = boxes[:, :2], boxes[:, 2:]
    aspect = sizes / sizes.max(axis=1, keepdims=True)
    most = np.sqrt(constants.most_area * image_size[0] * image_size[1])
    longer = ((high - low) / aspect).max(axis=1, keepdims=True)
    half = np.maximum(np.minimum(refinement.margin * longer, most), constants.least_side) * aspect / 2
    middle = np.minimum(np.maximum((low + high) / 2, 0), np.subtract(image_size, 1))
    corner, sides = np.floor(middle - half).astype(np.int64), np.ceil(2 * half).astype(np.int64) + 1
    sides += -sides % np.maximum((sides // sizes).min(axis=1, keepdims=True), 1)
    regions = np.concatenate([corner, corner + sides], axis=1)
    if not refinement.centred:
        regions = np.concatenate([np.maximum(regions[:, :2], 0), np.minimum(regions[:, 2:], image_size)], axis=1)
    return regions

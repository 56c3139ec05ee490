"""People whom the networks missed, though the depth shows their heads: each such head gets a crop of its own.

A head stands out: beside and above it, all is farther away or belongs to somebody nearer, and a body is below. A head
that no skeleton explains gets a crop in which all that is nearer is covered. The network has to find a head right
there, and joints on surfaces at that distance, so that furniture becomes nobody.
"""
import time
from dataclasses import dataclass
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.decode.direct import DirectDecodeParams
from openpose_ros_pkg.detect.detection import DepthView
from openpose_ros_pkg.detect.occlusion_masks import Foreground, cover_others
from openpose_ros_pkg.detect.recipes import CropRefinement, Recipe
from openpose_ros_pkg.detect.refinement import decode_crop
from openpose_ros_pkg.detect.views import PreparedView, View, compute_views
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.preprocess import fit_image
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import Poses
from openpose_ros_pkg.skeletons import SkeletonModel


@dataclass(frozen=True)
class MissedConstants:
    """What looks like a head, and who is believed there."""

    grid: int = constant(320, 'Greatest width and height of the grid on which heads are looked for.', unit='px')
    nearest: float = constant(0.8, 'Least distance of a head.', unit='m')
    farthest: float = constant(7.0, 'Greatest distance: beyond, a head is four points of the grid.', unit='m')
    radius: float = constant(
        0.055, 'This far from its middle, in four directions, a head is of one depth; one of them may be hidden.',
        unit='m')
    flat: float = constant(
        0.02, 'Depths that differ by less, and by the next constant times the distance, are one: a floor rises faster.',
        unit='m')
    flat_share: float = constant(0.02, 'That grows by this share of the distance, as the noise of cameras does.')
    beside: float = constant(0.2, 'To the left, to the right and above, this far off, it has ended.', unit='m')
    gap: float = constant(0.3, 'What lies farther behind, or nearer, by this is no part of it.', unit='m')
    below: float = constant(0.3, 'This far below the middle there is a body, or what hides it.', unit='m')
    least_area: float = constant(0.3, 'Least area of its middle, as a share of the square of `radius`.')
    most: int = constant(2, 'Number of heads in an image that get a crop, those with the largest areas.')
    explained: float = constant(0.3, 'A head that is nearer to a joint of somebody than this is theirs.', unit='m')
    thickness: float = constant(0.45, 'That holds if the median depth of their joints is as near to its.', unit='m')
    on_head: float = constant(0.15, 'It is theirs also if a joint this near is seen at its depth.', unit='m')
    crop_side: float = constant(1.5, 'Side of the crop; the head is a sixth below its top.', unit='m')
    nearer: float = constant(0.35, 'What is nearer than the head by more is covered in the crop.', unit='m')
    head_score: float = constant(0.4, 'Mean score of the three surest joints of the head that is needed.')
    head_distance: float = constant(0.12, 'Greatest distance of the joints of the head from its middle.', unit='m')
    joint_score: float = constant(0.25, 'Joints with a lower score confirm nobody.')
    reach: float = constant(0.4, 'Joints on surfaces that are nearer to the depth of the head confirm it.', unit='m')
    confirmed: int = constant(4, 'Number of such joints that is needed.')
    refuted: float = constant(0.25, 'Of the joints, this share at most may lie before something farther.')


MISSED = MissedConstants()
_HEAD = ('nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear')


class Missed(NamedTuple):
    """Who was found at heads that nobody explained.

    Attributes:
        poses: the people; their scores are those of the joints that are seen.
        crops: number of crops that the network saw.
        seconds: that it took.
    """

    poses: Poses
    crops: int
    seconds: float


class Head(NamedTuple):
    """What looks like a head: its middle [px of the depth], and its depth [m]."""

    x: float
    y: float
    depth: float


def heads(view: DepthView) -> List[Head]:
    """Return what looks like a head, largest area first."""
    height, width = view.depth.shape
    scale = max(max(width, height) / MISSED.grid, 1.0)
    # a long thin image has one row or column at least: OpenCV ends the process where there is none
    rows, columns = (np.minimum((np.arange(max(int(size / scale), 1)) + 0.5) * scale, size - 1).astype(np.int64)
                     for size in (height, width))
    depth, focal = view.depth[rows[:, None], columns], view.focal / scale
    near = _head_like(depth, focal)
    count, labels, stats, middles = cv2.connectedComponentsWithStats(near.astype(np.uint8), connectivity=8)
    found: List[Tuple[float, Head]] = []
    for i in range(1, count):
        distance = float(np.median(depth[labels == i]))
        area = stats[i, cv2.CC_STAT_AREA] / (MISSED.radius * focal / distance) ** 2
        if area >= MISSED.least_area:
            x, y = (middles[i] + 0.5) * scale - 0.5
            found.append((area, Head(float(x), float(y), distance)))
    return [head for _, head in sorted(found, key=lambda item: -item[0])]


def _head_like(depth: np.ndarray, focal: float) -> np.ndarray:
    """Return which points, (h, w) [m], lie in the middle of what looks like a head, (h, w) bool."""
    border = int(np.ceil(MISSED.below * focal / MISSED.nearest)) + 1
    padded = np.pad(depth, border, constant_values=np.nan)
    width, flat = padded.shape[1], padded.ravel()
    with np.errstate(invalid='ignore'):
        index = np.flatnonzero((flat > MISSED.nearest) & (flat < MISSED.farthest))
        farther = np.zeros(len(index), np.int64)

        def at(x: float, y: float) -> np.ndarray:
            """Return how much farther a point is that is x to the right and y below [m], of each [m]."""
            pixels = focal / flat[index]
            there = index + np.rint(y * pixels).astype(np.int64) * width + np.rint(x * pixels).astype(np.int64)
            return flat[there] - flat[index]

        aside, slanted = MISSED.beside, MISSED.beside / np.sqrt(2)
        for x, y in ((-aside, 0), (aside, 0), (0, -aside), (-slanted, -slanted), (slanted, -slanted)):
            more = at(x, y)
            kept = ~(np.abs(more) <= MISSED.gap)
            farther = (farther + (more > MISSED.gap))[kept]
            index = index[kept]
        index = index[farther >= 2]
        covered = np.zeros(len(index), bool)
        for x, y in ((0, -1), (0, 1), (-1, 0), (1, 0)):
            more = at(x * MISSED.radius, y * MISSED.radius)
            one = np.abs(more) < MISSED.flat + MISSED.flat_share * flat[index]
            hidden = np.isnan(more) | (more < -MISSED.gap)
            kept = one | (hidden & ~covered)
            index, covered = index[kept], (covered | hidden)[kept]
        index = index[~(at(0, MISSED.below) > MISSED.gap)]
    like = np.zeros(padded.shape, bool)
    like.flat[index] = True
    return like[border:border + depth.shape[0], border:border + depth.shape[1]]


def find_missed(people: np.ndarray, bgr: np.ndarray, view: DepthView, recipe: Recipe, networks: Dict[str, Backend],
                direct: DirectDecodeParams) -> Missed:
    """Look at crops of heads that nobody explains.

    Args:
        people: (P, K, 3) float: x, y [px of the image], score; who was found.
        bgr: (H, W, 3) uint8 BGR, the image.
        networks: by the models' names.
        direct: thresholds of the decoder.
    """
    skeleton, one = recipe.skeleton, crop_of_one(recipe)
    free = [] if one is None else _unexplained(heads(view), people, bgr, view)[:MISSED.most]
    found: List[np.ndarray] = []
    seconds = 0.0
    if one is not None and free:
        crops = [_prepare(bgr, head, view, one, skeleton) for head in free]
        begin = time.perf_counter()
        computed = compute_views(crops, networks[one.model.name])
        seconds = time.perf_counter() - begin
        poses = [(head, pose) for head, crop in zip(free, computed)
                 for pose in decode_crop(crop, one.model, direct, skeleton).keypoints]
        confirmed = [_confirmed(pose, head, bgr, view, skeleton) for head, pose in poses]
        found = [person for person in confirmed if person is not None]
    keypoints = np.array(found, np.float32).reshape(-1, len(skeleton.joints), 3)
    return Missed(Poses(keypoints, np.array([_score(person) for person in found], np.float32)), len(free), seconds)


def crop_of_one(recipe: Recipe) -> Optional[CropRefinement]:
    """Return the refinement whose network shows one person; None: there is none."""
    return next((one for one in recipe.refinements if one.model.decoder == 'movenet_singlepose'), None)


def _in_depth(xy: np.ndarray, bgr: np.ndarray, view: DepthView) -> np.ndarray:
    """Turn (..., 2) pixels of the image into pixels of its depth."""
    return (xy + 0.5) * view.depth.shape[1] / bgr.shape[1] - 0.5


def _in_image(xy: np.ndarray, bgr: np.ndarray, view: DepthView) -> np.ndarray:
    """Turn (..., 2) pixels of the depth of an image into pixels of the image."""
    return (xy + 0.5) * bgr.shape[1] / view.depth.shape[1] - 0.5


def _depths(xy: np.ndarray, view: DepthView) -> np.ndarray:
    """Return the depth at (..., 2) pixels of it [m]; NaN where there is none."""
    height, width = view.depth.shape
    with np.errstate(invalid='ignore'):
        inside = ((xy > -0.5) & (xy < np.array([width, height]) - 0.5)).all(axis=-1)
    x, y = np.rint(np.where(inside[..., None], xy, 0)).astype(np.int64).T
    return np.where(inside, view.depth[y, x].T, np.nan)


def _unexplained(found: Sequence[Head], people: np.ndarray, bgr: np.ndarray, view: DepthView) -> List[Head]:
    """Return the heads that are nobody's of (P, K, 3) people: nobody at that distance has a joint near them."""
    joints = _in_depth(people[..., :2], bgr, view)
    depth = _depths(joints, view)
    distance = [float(np.median(of[np.isfinite(of)])) if np.isfinite(of).any() else np.nan for of in depth]

    def explained(head: Head) -> bool:
        with np.errstate(invalid='ignore'):
            off = np.hypot(joints[..., 0] - head.x, joints[..., 1] - head.y) * head.depth / view.focal
            there = (off < MISSED.on_head) & (np.abs(depth - head.depth) < MISSED.gap)
        near = (off < MISSED.explained).any(axis=1)
        return bool(there.any()) or any(of and not abs(far - head.depth) > MISSED.thickness
                                        for of, far in zip(near, distance))

    return [head for head in found if not explained(head)]


def _prepare(bgr: np.ndarray, head: Head, view: DepthView, one: CropRefinement, skeleton: SkeletonModel
             ) -> PreparedView:
    """Cut out a head and what is below it; all that is nearer gets the mean colour of the crop."""
    x, y = _in_image(np.array([head.x, head.y]), bgr, view)
    side = max(MISSED.crop_side * view.focal / head.depth * bgr.shape[1] / view.depth.shape[1], 2)
    left, top, side = int(np.floor(x - side / 2)), int(np.floor(y - side / 6)), int(np.ceil(side))
    recipe = one.model.input
    plan = fit_image((side, side), one.side, one.side, recipe.multiple_of, whole_box=True)
    size = (bgr.shape[1], bgr.shape[0])
    crop = View(plan, False, (left, top), size).prepare(bgr, recipe.padding)
    with np.errstate(invalid='ignore'):
        nearer = (view.depth < head.depth - MISSED.nearer).astype(np.uint8)
    pixels = cv2.dilate(nearer, np.ones((3, 3), np.uint8)) > 0
    nobody = np.zeros((0, 3))
    return cover_others(crop, nobody, [], skeleton, Foreground(np.zeros(0, bool), pixels, size))


def _confirmed(pose: np.ndarray, head: Head, bgr: np.ndarray, view: DepthView, skeleton: SkeletonModel
               ) -> Optional[np.ndarray]:
    """Return a person, (K, 3), without the joints that something hides; None unless the depth confirms it."""
    xy = _in_depth(pose[:, :2], bgr, view)
    parts = [skeleton.index[joint] for joint in _HEAD if joint in skeleton.index]
    there = [i for i in parts if pose[i, 2] > 0]
    if not there or np.sort(pose[parts, 2])[-3:].mean() < MISSED.head_score:
        return None
    off = np.hypot(*(xy[there].mean(axis=0) - (head.x, head.y)))
    if off > MISSED.head_distance * view.focal / head.depth:
        return None
    with np.errstate(invalid='ignore'):
        behind = _depths(xy, view) - head.depth
        sure = pose[:, 2] >= MISSED.joint_score
        seen, beyond = sure & (np.abs(behind) < MISSED.reach), sure & (behind >= MISSED.reach)
    if seen.sum() < MISSED.confirmed or beyond.sum() > MISSED.refuted * sure.sum():
        return None
    return np.where(beyond[:, None], (np.nan, np.nan, 0), pose).astype(np.float32)


def _score(person: np.ndarray) -> float:
    """Return the root mean square of the scores of the joints that are there."""
    return float(np.sqrt((person[person[:, 2] >= MISSED.joint_score, 2] ** 2).mean()))

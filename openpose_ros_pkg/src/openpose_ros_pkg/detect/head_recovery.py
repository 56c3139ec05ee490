"""Head recovery: heads in the depth that no detected person explains get a crop of their own.

Beside and above a head, all is farther away or nearer, and a body is below. In the crop, all that is nearer is covered.
The network has to find a head there, and joints on surfaces at that distance, so that furniture is no person.
"""
from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.detect.crops import compute_crops, decode_crop
from openpose_ros_pkg.detect.detection import DepthView, Head, ImageFrame
from openpose_ros_pkg.detect.occlusion_masks import COVER, HEAD, LAYERS, Foreground, cover_others
from openpose_ros_pkg.detect.recipes import CropRefinement
from openpose_ros_pkg.detect.views import PreparedView, Setup, View
from openpose_ros_pkg.networks.preprocess import ImageToNet
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import People2D, Poses


@dataclass(frozen=True)
class HeadConstants:
    """What looks like a head in the depth, and which poses there are people."""

    grid: int = constant(320, 'Greatest width and height of the grid on which heads are looked for.', unit='px')
    nearest: float = constant(0.8, 'Least distance of a head.', unit='m')
    farthest: float = constant(7.0, 'Greatest distance: beyond, a head is four points of the grid.', unit='m')
    radius: float = constant(
        0.055, 'This far from its middle, in four directions, a head is of one depth; one of them may be hidden.',
        unit='m')
    flat: float = constant(
        0.03, 'Depths that differ by less, as a share of the distance, are one: a floor rises faster, and the noise of '
              'cameras is less.')
    beside: float = constant(0.2, 'To the left, to the right and above, this far off, it has ended.', unit='m')
    gap: float = constant(
        0.3, 'What lies farther behind, or nearer, by this is no part of it; this far below there is a body, or what '
             'hides it, and a joint of a person who explains it is no farther away.', unit='m')
    least_area: float = constant(0.3, 'Least area of its middle, as a share of the square of `radius`.')
    most: int = constant(2, 'Number of heads in an image that get a crop, those with the largest areas.')
    on_head: float = constant(
        0.15, 'A joint this near, at the depth of the head, explains it too; the joints of the head of a recovered '
              'person are this near to its middle.', unit='m')
    crop_side: float = constant(1.5, 'Width of the crop; the head is a sixth below its top.', unit='m')
    head_score: float = constant(0.4, 'Mean score of the three surest joints of the head that is needed.')
    confirmed: int = constant(4, 'Number of sure joints at its depth that is needed.')
    refuted: float = constant(0.25, 'Of the joints, this share at most may lie before something farther.')


HEADS = HeadConstants()


class Recovered(NamedTuple):
    """People at heads that no skeleton explains."""

    poses: Poses  # the people; their scores are those of their visible joints
    crops: int  # number of crops that the network computed


def heads(view: DepthView, constants: HeadConstants = HEADS) -> List[Head]:
    """Return what looks like a head, largest area first."""
    height, width = view.depth.shape
    scale = max(max(width, height) / constants.grid, 1.0)
    # a long thin image has one row or column at least: OpenCV ends the process where there is none
    rows, columns = (np.minimum((np.arange(max(int(size / scale), 1)) + 0.5) * scale, size - 1).astype(np.int64)
                     for size in (height, width))
    depth, focal = view.depth[rows[:, None], columns], view.focal / scale
    near = _head_like(depth, focal, constants)
    count, labels, stats, middles = cv2.connectedComponentsWithStats(near.astype(np.uint8), connectivity=8)
    found: List[Tuple[float, Head]] = []
    for i in range(1, count):
        distance = float(np.median(depth[labels == i]))
        area = stats[i, cv2.CC_STAT_AREA] / (constants.radius * focal / distance) ** 2
        if area >= constants.least_area:
            x, y = (middles[i] + 0.5) * scale - 0.5
            found.append((area, Head(float(x), float(y), distance)))
    return [head for _, head in sorted(found, key=lambda item: -item[0])]


def _head_like(depth: np.ndarray, focal: float, constants: HeadConstants) -> np.ndarray:
    """Return which points, (h, w) [m], lie in the middle of what looks like a head, (h, w) bool."""
    border = int(np.ceil(constants.gap * focal / constants.nearest)) + 1
    padded = np.pad(depth, border, constant_values=np.nan)
    width, flat = padded.shape[1], padded.ravel()
    with np.errstate(invalid='ignore'):
        index = np.flatnonzero((flat > constants.nearest) & (flat < constants.farthest))
        farther = np.zeros(len(index), np.int64)

        def at(x: float, y: float) -> np.ndarray:
            """Return how much farther a point is that is x to the right and y below [m], of each [m]."""
            pixels = focal / flat[index]
            there = index + np.rint(y * pixels).astype(np.int64) * width + np.rint(x * pixels).astype(np.int64)
            return flat[there] - flat[index]

        aside, slanted = constants.beside, constants.beside / np.sqrt(2)
        for x, y in ((-aside, 0), (aside, 0), (0, -aside), (-slanted, -slanted), (slanted, -slanted)):
            more = at(x, y)
            kept = ~(np.abs(more) <= constants.gap)
            farther = (farther + (more > constants.gap))[kept]
            index = index[kept]
        index = index[farther >= 2]
        covered = np.zeros(len(index), bool)
        for x, y in ((0, -1), (0, 1), (-1, 0), (1, 0)):
            more = at(x * constants.radius, y * constants.radius)
            one = np.abs(more) < constants.flat * flat[index]
            hidden = np.isnan(more) | (more < -constants.gap)
            kept = one | (hidden & ~covered)
            index, covered = index[kept], (covered | hidden)[kept]
        index = index[~(at(0, constants.gap) > constants.gap)]
    like = np.zeros(padded.shape, bool)
    like.flat[index] = True
    return like[border:border + depth.shape[0], border:border + depth.shape[1]]


def recover(frame: ImageFrame, setup: Setup, people: People2D, constants: HeadConstants = HEADS) -> Recovered:
    """Find people at heads that no skeleton of the detected people explains, on crops; none without depth."""
    bgr, view = frame.bgr, frame.depth
    skeleton = setup.recipe.skeleton
    one = next((each for each in setup.recipe.refinements if each.one_person), None)  # whose network shows one person
    found: List[np.ndarray] = []
    free: List[Head] = []
    if one is not None and view is not None:
        free = _unexplained(heads(view, constants), people.keypoints, bgr, view, constants)[:constants.most]
    if one is not None and view is not None and free:
        crops = [_prepare(bgr, head, view, one, constants) for head in free]
        computed = compute_crops(crops, setup.networks[one.model.name])
        candidates = [(head, pose) for head, crop in zip(free, computed)
                 for pose in decode_crop(crop, one.model, setup).keypoints]
        heads_of = [skeleton.index[joint] for joint in HEAD if joint in skeleton.index]
        confirmed = [_confirmed(pose, heads_of, head, view, _in_depth(pose[:, :2], bgr, view), constants)
                     for head, pose in candidates]
        found = [person for person in confirmed if person is not None]
    keypoints = np.array(found, np.float32).reshape(-1, len(skeleton.joints), 3)
    scores = [np.sqrt((person[person[:, 2] >= COVER.sure_joint, 2] ** 2).mean()) for person in found]
    return Recovered(Poses(keypoints, np.array(scores, np.float32)), len(free))


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


def _unexplained(found: Sequence[Head], people: np.ndarray, bgr: np.ndarray, view: DepthView, constants: HeadConstants
                 ) -> List[Head]:
    """Return the heads that none of (P, K, 3) people explains: no person at that depth has a joint near them."""
    joints = _in_depth(people[..., :2], bgr, view)
    depth = _depths(joints, view)
    distance = [float(np.median(of[np.isfinite(of)])) if np.isfinite(of).any() else np.nan for of in depth]

    def explained(head: Head) -> bool:
        with np.errstate(invalid='ignore'):
            off = np.hypot(joints[..., 0] - head.x, joints[..., 1] - head.y) * head.depth / view.focal
            there = (off < constants.on_head) & (np.abs(depth - head.depth) < constants.gap)
        near = (off < constants.gap).any(axis=1)
        return bool(there.any()) or any(of and not abs(far - head.depth) > LAYERS.reach
                                        for of, far in zip(near, distance))

    return [head for head in found if not explained(head)]


def _prepare(bgr: np.ndarray, head: Head, view: DepthView, one: CropRefinement, constants: HeadConstants
             ) -> PreparedView:
    """Cut out a head and what is below it; all that is nearer gets the mean colour of the crop."""
    x, y = _in_image(np.array([head.x, head.y]), bgr, view)
    width = max(constants.crop_side * view.focal / head.depth * bgr.shape[1] / view.depth.shape[1], 2)
    height = width * one.size[1] / one.size[0]
    left, top = int(np.floor(x - width / 2)), int(np.floor(y - height / 6))
    size = (bgr.shape[1], bgr.shape[0])
    plan = ImageToNet((int(np.ceil(width)), int(np.ceil(height))), one.size, one.size)
    crop = View(plan, False, (left, top), size).prepare(bgr, one.model.input)
    with np.errstate(invalid='ignore'):
        nearer = (view.depth < head.depth - LAYERS.reach).astype(np.uint8)
    pixels = cv2.dilate(nearer, np.ones((3, 3), np.uint8)) > 0
    no_people = np.zeros((0, len(one.model.skeleton.joints), 3))
    return cover_others(crop, no_people, no_people, one.model.skeleton, Foreground(np.zeros(0, bool), pixels, size))


def _confirmed(pose: np.ndarray, parts: Sequence[int], head: Head, view: DepthView, xy: np.ndarray,
               constants: HeadConstants) -> Optional[np.ndarray]:
    """Return a person, (K, 3), without hidden joints; None unless the depth confirms it.

    Args:
        parts: joints of the head.
        xy: (K, 2) of the pose, in pixels of the depth.
    """
    there = [i for i in parts if pose[i, 2] > 0]
    if not there or np.sort(pose[parts, 2])[-3:].mean() < constants.head_score:
        return None
    off = np.hypot(*(xy[there].mean(axis=0) - (head.x, head.y)))
    if off > constants.on_head * view.focal / head.depth:
        return None
    with np.errstate(invalid='ignore'):
        behind = _depths(xy, view) - head.depth
        sure = pose[:, 2] >= COVER.sure_joint
        seen, beyond = sure & (np.abs(behind) < LAYERS.reach), sure & (behind >= LAYERS.reach)
    if seen.sum() < constants.confirmed or beyond.sum() > constants.refuted * sure.sum():
        return None
    return np.where(beyond[:, None], (np.nan, np.nan, 0), pose).astype(np.float32)

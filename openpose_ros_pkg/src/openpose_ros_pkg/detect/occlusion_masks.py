"""Occlusion masks: other people are covered in the crop of a person, for networks that show one person.

A body mask is limbs, trunk and head, with breadths in proportion to the size of the person. Pixels on the body of the
person itself stay. Where depth shows that another person is in front, all pixels of that one are covered.
"""
import functools
from dataclasses import dataclass, replace
from typing import List, NamedTuple, Optional, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.detect.detection import DepthView
from openpose_ros_pkg.detect.views import PreparedView, View
from openpose_ros_pkg.ensemble import area
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.skeletons import SkeletonModel

HEAD = ('nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear')
_OUTER = ('elbow', 'wrist', 'knee', 'ankle')
_FEET = ('toe', 'heel')
_TRUNK = ('right_shoulder', 'left_shoulder', 'left_hip', 'right_hip')


@dataclass(frozen=True)
class CoverConstants:
    """Which pixels of a crop belong to a person."""

    breadth: float = constant(
        0.15, 'Breadth of limbs, and of the border of the trunk, and radius of the head, as a share of the root of the '
              'area of the person.')
    sure_joint: float = constant(
        0.2, 'Joints with a lower score, often hidden ones, cover nothing, do not widen a crop and confirm no head; a '
             'person on a crop has a greater mean score.')


COVER = CoverConstants()


@dataclass(frozen=True)
class LayerConstants:
    """Order of people by depth, and their pixels."""

    breadth: float = constant(
        2.0, 'Factor on the breadths of `CoverConstants` for people in front, within which the depth shows the body.')
    reach: float = constant(
        0.4, 'Surfaces this near to the depth of a trunk or head are of its person: such joints agree with it, and do '
             'not count for the depth of a person behind.', unit='m')
    least_gap: float = constant(
        0.3, 'A person whose trunk is nearer by this is in front; of people who are less far apart, an arm of either '
             'may be in front.', unit='m')
    preference: float = constant(
        1.0, 'Depths are estimated from the nearest person to the farthest; a person counts as nearer by this times '
             'the share of the joints that agree.', unit='m')
    limb_weight: float = constant(
        0.4, 'Weight of elbows, knees, wrists, ankles and feet for the depth of a person; trunk and head have 1.')
    doubt: float = constant(
        0.3, 'Factor on the score of a joint that a full search places on the body of a nearer person, where a crop '
             'shows the person too.')
    one_place: float = constant(
        0.07, 'Left and right elbows, wrists, knees or ankles of a person behind others that are this near, as a share '
              'of the root of the area, are one joint: a network takes the visible limb for the hidden one too.')


LAYERS = LayerConstants()


class Foreground(NamedTuple):
    """The people in front of a person."""

    nearer: np.ndarray  # (P,) bool, which of the people
    pixels: np.ndarray  # (h, w) bool, their pixels, on the grid of the depth
    image_size: Tuple[int, int]  # width and height [px]

    def covers(self, xy: np.ndarray) -> np.ndarray:
        """Return which positions, (N, 2) [px of the image], are on a nearer person, (N,) bool."""
        return _at(self.pixels, xy, self.image_size) & np.isfinite(xy).all(axis=1)

    def in_crop(self, view: View) -> np.ndarray:
        """Return the pixels in the input of a network that sees a crop, (H, W) bool."""
        width, height = view.plan.net_size
        corner = np.stack([np.arange(max(width, height))] * 2, axis=1)
        x, y = (view.plan.to_image(corner).T + 0.5)
        if view.mirror:
            x = view.plan.image_size[0] - x
        x, y = x[:width] + view.origin[0] - 0.5, y[:height] + view.origin[1] - 0.5
        columns, rows = _cells(x, 0, self.pixels, self.image_size), _cells(y, 1, self.pixels, self.image_size)
        return self.pixels[rows][:, columns]


def foregrounds(people: np.ndarray, skeleton: SkeletonModel, depth: Optional[DepthView],
                image_size: Tuple[int, int], cover: CoverConstants = COVER, layers: LayerConstants = LAYERS
                ) -> List[Optional[Foreground]]:
    """Return what is in front of each of the people; None: no person, or unknown.

    Args:
        people: (P, K, 3) float: x, y [px of the image], score; NaN where missing.
        skeleton: their K joints.
        depth: of the image.
        image_size: width and height [px].
    """
    if depth is None or len(people) < 2:
        return [None] * len(people)
    # depth is missing mostly beside a nearer person
    surface = cv2.erode(np.where(np.isfinite(depth.depth), depth.depth, np.float32(np.inf)), np.ones((3, 3), np.uint8))
    masks = np.zeros((len(people), *surface.shape), np.uint8)
    poses = _scaled(_sure(people, cover.sure_joint), np.divide(surface.shape[::-1], image_size))
    for mask, body in zip(masks, _bodies(poses, cover, layers.breadth)):
        _draw(mask, body, skeleton)
    xy = people[..., :2].reshape(-1, 2)
    samples = median_depths(depth, xy, image_size).reshape(people.shape[:2])
    sure = np.isfinite(samples) & (people[..., 2] >= cover.sure_joint)
    shares = [layers.limb_weight if joint.split('_')[-1] in (*_OUTER, *_FEET) else 1.0 for joint in skeleton.joints]
    weights = (np.where(sure, people[..., 2], 0.0) * np.array(shares)).astype(people.dtype)
    on_bodies = _at(masks, xy, image_size).reshape(len(people), *samples.shape) > 0
    distances = _distances(samples, weights, on_bodies, layers)
    parts = [cv2.boundingRect(mask) for mask in masks]
    result: List[Optional[Foreground]] = []
    for distance in distances:
        with np.errstate(invalid='ignore'):
            nearer = distances < distance - layers.least_gap
        if not nearer.any():
            result.append(None)
            continue
        pixels = np.zeros(surface.shape, bool)
        for i in np.flatnonzero(nearer):
            x, y, width, height = parts[i]
            part = slice(y, y + height), slice(x, x + width)
            pixels[part] |= (masks[i][part] > 0) & (surface[part] < (distance + distances[i]) / 2)
        result.append(Foreground(nearer, pixels, image_size))
    return result


def _scaled(poses: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Return poses, (P, K, 3) [px], on a grid with (2,) cells per pixel."""
    return np.concatenate([(poses[..., :2] + 0.5) * scale - 0.5, poses[..., 2:]], axis=2).astype(poses.dtype)


def _distances(samples: np.ndarray, weights: np.ndarray, on_bodies: np.ndarray, layers: LayerConstants) -> np.ndarray:
    """Return the depth of each person's trunk, (P,) [m]; NaN where unknown.

    It is the median over the joints, from the nearest person to the farthest: joints on a nearer person do not count.

    Args:
        samples: (P, K) depths at the joints [m]; NaN where unknown.
        weights: (P, K) of the joints; 0 where there is no sample.
        on_bodies: (P, P, K) bool, for each body which joints are on it.
    """
    visible, distances, left = weights, np.full(len(weights), np.nan), weights.any(axis=1)
    order, total = np.argsort(samples, axis=1), np.maximum(weights.sum(axis=1), 1e-9)
    while left.any():
        counted = np.where(((visible > 0).sum(axis=1) > 1)[:, None], visible, weights)
        medians = _weighted_medians(samples, counted, order)
        agreeing = (counted * (np.abs(samples - medians[:, None]) < layers.reach)).sum(axis=1)
        merit = medians - layers.preference * agreeing / total
        nearest = int(np.where(left, merit, np.inf).argmin())
        distances[nearest], left[nearest] = medians[nearest], False
        foreign = on_bodies[nearest] & (np.abs(samples - medians[nearest]) < layers.reach)
        visible = np.where(foreign & left[:, None], 0.0, visible)
    return distances


def median_depths(depth: DepthView, xy: np.ndarray, image_size: Tuple[int, int]) -> np.ndarray:
    """Return the median depth of the 3 x 3 cells round positions, (N, 2) [px of the image], (N,) [m]; NaN: unknown."""
    x, y = (_cells(values, axis, depth.depth, image_size) for axis, values in enumerate(np.nan_to_num(xy).T))
    steps = np.array([-1, 0, 1])
    rows = np.clip(y[:, None] + np.repeat(steps, 3), 0, depth.depth.shape[0] - 1)
    columns = np.clip(x[:, None] + np.tile(steps, 3), 0, depth.depth.shape[1] - 1)
    windows = np.sort(depth.depth[rows, columns], axis=1)  # NaN come last
    count = np.isfinite(windows).sum(axis=1)
    median = windows[np.arange(len(windows)), np.maximum(count - 1, 0) // 2]
    return np.where(np.isfinite(xy).all(axis=1), median, np.nan)


def _weighted_medians(values: np.ndarray, weights: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Return the weighted median of each row of (P, K) values in their `order`; those with a weight of 0 may be NaN."""
    rows = np.arange(len(values))
    sums = weights[rows[:, None], order].cumsum(axis=1)
    return values[rows, order[rows, (sums < sums[:, -1:] / 2).sum(axis=1)]]


def _at(grids: np.ndarray, xy: np.ndarray, image_size: Tuple[int, int]) -> np.ndarray:
    """Return the values of grids, (..., h, w), at positions in the image, (N, 2) [px], or those nearest to it."""
    columns, rows = (_cells(values, axis, grids, image_size) for axis, values in enumerate(np.nan_to_num(xy).T))
    return grids[..., rows, columns]


def _cells(values: np.ndarray, axis: int, grid: np.ndarray, image_size: Tuple[int, int]) -> np.ndarray:
    """Return the columns (axis 0) or rows (1) of grids, (..., h, w), at x or y in the image [px], those within, int."""
    count = grid.shape[-1 - axis]
    return np.minimum(np.maximum((values + 0.5) * count / image_size[axis], 0), count - 1).astype(np.int64)


def doubted(poses: np.ndarray, foreground: Foreground, layers: LayerConstants = LAYERS) -> np.ndarray:
    """Return poses, (S, K, 3), with lower scores of the joints that lie on a nearer person."""
    poses = poses.copy()
    covered = foreground.covers(poses[..., :2].reshape(-1, 2)).reshape(poses.shape[:2])
    poses[..., 2] *= np.where(covered, layers.doubt, 1.0)
    return poses


def without_twins(keypoints: np.ndarray, skeleton: SkeletonModel, layers: LayerConstants = LAYERS) -> np.ndarray:
    """Return a person, (K, 3), with the surer of two joints of a pair that are in one place, for people behind others.
    """
    result, index = keypoints.copy(), skeleton.index
    nearest = layers.one_place * np.sqrt(area(keypoints))
    for part in _OUTER:
        if {f'left_{part}', f'right_{part}'} <= index.keys():
            pair = [index[f'left_{part}'], index[f'right_{part}']]
            if np.hypot(*(keypoints[pair[0], :2] - keypoints[pair[1], :2])) < nearest:
                result[min(pair, key=lambda joint: keypoints[joint, 2])] = np.nan, np.nan, 0
    return result


def cover_others(crop: PreparedView, person: np.ndarray, others: np.ndarray, skeleton: SkeletonModel,
                 foreground: Optional[Foreground] = None, cover: CoverConstants = COVER) -> PreparedView:
    """Return a crop of a person, (K, 3) float, with the other people, (P, K, 3), in the mean colour of the crop.

    Pixels of a foreground, in front of the person, are covered too; None: no person, or unknown.
    """
    covered = np.zeros(crop.input.shape[:2], np.uint8)
    if len(others):
        everybody = _in_input(np.concatenate([others, person[None]]), crop)
        covered = bodies_of_others(everybody[-1], everybody[:-1], skeleton, crop.input.shape[:2], cover)
    if foreground is not None:
        covered |= foreground.in_crop(crop.view)
    return replace(crop, input=in_mean_colour(crop.input, covered)) if covered.any() else crop


def bodies_of_others(person: np.ndarray, others: np.ndarray, skeleton: SkeletonModel, shape: Sequence[int],
                     cover: CoverConstants = COVER) -> np.ndarray:
    """Return which pixels are on other people, (P, K, 3) [px], and not on a person, (K, 3), (H, W) uint8 0 or 1."""
    covered = np.zeros(shape, np.uint8)
    *bodies, own = _bodies(_sure(np.concatenate([others, person[None]]), cover.sure_joint), cover)
    for body in bodies:
        _draw(covered, body, skeleton)
    _draw(covered, own, skeleton, 0)
    return covered


def in_mean_colour(image: np.ndarray, covered: np.ndarray) -> np.ndarray:
    """Return an image, (H, W, 3) uint8, with the covered pixels, (H, W) uint8, in its mean colour."""
    colour = cv2.rectangle(np.empty_like(image), (0, 0), image.shape[1::-1], np.round(cv2.mean(image)[:3]), cv2.FILLED)
    return cv2.copyTo(colour, covered, image.copy())


def _in_input(people: np.ndarray, crop: PreparedView) -> np.ndarray:
    """Return people, (P, K, 3), in pixels of the input of the network."""
    view = crop.view
    xy = people[..., :2] - view.origin
    if view.mirror:
        xy[..., 0] = view.plan.image_size[0] - 1 - xy[..., 0]
    return np.concatenate([view.plan.to_net(xy), people[..., 2:]], axis=2)


def _sure(people: np.ndarray, least: float) -> np.ndarray:
    """Return poses, (P, K, 3), without joints of a lower score."""
    return np.where((people[..., 2] >= least)[..., None], people, people.dtype.type(np.nan))


class _Body(NamedTuple):
    """A body to be drawn: places of its joints, (K, 2) int32 [px], which are there, (K,), and breadth of limbs [px]."""

    places: np.ndarray
    there: np.ndarray
    breadth: int


def _bodies(poses: np.ndarray, cover: CoverConstants, factor: float = 1.0) -> List[_Body]:
    """Return the bodies of poses, (P, K, 3) [px], with limbs broader by a factor."""
    # OpenCV draws with 16 bits, and breadths grow with the body: joints that are farther away are beyond the image
    with np.errstate(invalid='ignore'):
        there = np.abs(poses[..., :2]).max(axis=2) < np.iinfo(np.int16).max // 2
    places = np.round(np.where(there[..., None], poses[..., :2], 0.0)).astype(np.int32)
    sizes = np.sqrt(area(np.where(there[..., None], poses, np.nan)))
    breadths = [max(round(cover.breadth * factor * size), 1) for size in sizes.tolist()]
    return [_Body(*body) for body in zip(places, there, breadths)]


@functools.lru_cache(maxsize=16)
def _body_parts(skeleton: SkeletonModel) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the joints of limbs, (L, 2), of the trunk, in their order round it, and of the head."""
    index = skeleton.index
    limbs = np.array([(index[start], index[end]) for start, end in skeleton.drawn_limbs], np.int64).reshape(-1, 2)
    trunk, head = (np.array([index[joint] for joint in part if joint in index], np.int64) for part in (_TRUNK, HEAD))
    return limbs, trunk, head


def _draw(mask: np.ndarray, body: _Body, skeleton: SkeletonModel, value: int = 1) -> None:
    """Give the pixels of a body a value in a mask, (H, W) uint8."""
    (places, there, breadth), (limbs, trunk, head) = body, _body_parts(skeleton)
    cv2.polylines(mask, list(places[limbs[there[limbs].all(axis=1)]]), False, value, breadth)
    trunk, head = trunk[there[trunk]], head[there[head]]
    if len(trunk) > 1:
        cv2.fillConvexPoly(mask, cv2.convexHull(places[trunk]), value)
        cv2.polylines(mask, [places[trunk]], True, value, breadth)
    if len(head):
        middle = places[head].sum(axis=0) / len(head)
        cv2.circle(mask, (int(middle[0]), int(middle[1])), breadth, value, cv2.FILLED)

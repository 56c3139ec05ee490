"""Crops that show several people: the others are covered, so that a network for one person sees the right one.

A body in the image is its limbs, its trunk and its head, with breadths in proportion to its size. What lies on the body
of the person itself stays: whoever is in front, the network sees at most a piece of somebody else there. Where
depth tells that somebody else is in front, it also tells which pixels are covered: all of theirs.
"""
from dataclasses import dataclass, replace
from typing import List, NamedTuple, Optional, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.detect.detection import DepthView
from openpose_ros_pkg.detect.ensemble import Opinions, vote_with_crops
from openpose_ros_pkg.detect.recipes import Recipe
from openpose_ros_pkg.detect.views import PreparedView, View
from openpose_ros_pkg.oks import area
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.skeletons import SkeletonModel

_HEAD = ('nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear')
_OUTER = ('elbow', 'wrist', 'knee', 'ankle')
_TRUNK = ('right_shoulder', 'left_shoulder', 'left_hip', 'right_hip')


@dataclass(frozen=True)
class CoverConstants:
    """Which pixels of a crop belong to somebody."""

    limb: float = constant(
        0.14, 'Breadth of limbs, and of the border of the trunk, as a share of the root of the area of the person.')
    head: float = constant(0.16, 'Radius of the head, as a share of the same.')
    sure_joint: float = constant(0.15, 'Joints with a lower score cover nothing.')


COVER = CoverConstants()


@dataclass(frozen=True)
class LayerConstants:
    """Who is in front of whom, and which pixels are whose."""

    breadth: float = constant(
        2.0, 'Somebody in front is at most this many times as broad as `CoverConstants` have it: depth tells where the '
             'body ends.')
    least_gap: float = constant(
        0.3, 'Somebody whose trunk is nearer by this is in front; of people who are less far apart, an arm of either '
             'may be in front.', unit='m')
    reach: float = constant(
        0.45, 'A joint on the body of somebody nearer, and this near to the depth of that trunk, does not tell how far '
              'away a person is.', unit='m')
    agreement: float = constant(0.35, 'Joints this near to the depth of the person agree with it.', unit='m')
    preference: float = constant(
        1.0, 'People are told apart from the nearest to the farthest; one all of whose joints agree counts as nearer '
             'by this than one none of whose do.', unit='m')
    elbow_weight: float = constant(0.5, 'Weight of elbows and knees for the depth of a person; trunk and head have 1.')
    wrist_weight: float = constant(0.3, 'The same of wrists and ankles.')
    doubt: float = constant(
        0.3, 'Factor on the score of a joint that a network with all of the image sees on the body of somebody nearer, '
             'where a crop shows the person too.')
    one_place: float = constant(
        0.07, 'Left and right elbows, wrists, knees or ankles that are this near, as a share of the root of the area '
              'of somebody behind others, are one joint: a network takes the limb that it sees for the hidden one too.')


LAYERS = LayerConstants()


class Foreground(NamedTuple):
    """What of an image is in front of a person.

    Attributes:
        nearer: (P,) bool, who of the people.
        pixels: (h, w) bool, their pixels, on the grid of the depth.
        image_size: width and height [px].
    """

    nearer: np.ndarray
    pixels: np.ndarray
    image_size: Tuple[int, int]

    def holds(self, xy: np.ndarray) -> np.ndarray:
        """Return which positions, (N, 2) [px of the image], are on somebody nearer, (N,) bool."""
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
        return self.pixels[rows[:, None], columns]


def foregrounds(people: Sequence[np.ndarray], skeleton: SkeletonModel, depth: Optional[DepthView],
                image_size: Tuple[int, int]) -> List[Optional[Foreground]]:
    """Return what is in front of each of the people; None: nobody, or it is not known.

    Args:
        people: (K, 3) float each: x, y [px of the image], score; NaN where missing.
        skeleton: their K joints.
        depth: of the image.
        image_size: width and height [px].
    """
    if depth is None or len(people) < 2:
        return [None] * len(people)
    # missing depth is mostly that beside somebody nearer
    surface = cv2.erode(np.where(np.isfinite(depth.depth), depth.depth, np.float32(np.inf)), np.ones((3, 3), np.uint8))
    bodies = np.zeros((len(people), *surface.shape), np.uint8)
    scale = np.divide(surface.shape[::-1], image_size)
    for body, person in zip(bodies, people):
        pose = _sure(person)
        pose[:, :2] = (pose[:, :2] + 0.5) * scale - 0.5
        _paint(body, pose, skeleton, 1, LAYERS.breadth)
    distances = _distances(np.array(people), skeleton, depth, bodies, image_size)
    result: List[Optional[Foreground]] = []
    for distance in distances:
        with np.errstate(invalid='ignore'):
            nearer = distances < distance - LAYERS.least_gap
        if not nearer.any():
            result.append(None)
            continue
        pixels = np.zeros(surface.shape, bool)
        for body, other in zip(bodies[nearer], distances[nearer]):
            pixels |= (body > 0) & (surface < (distance + other) / 2)
        result.append(Foreground(nearer, pixels, image_size))
    return result


def _distances(people: np.ndarray, skeleton: SkeletonModel, depth: DepthView, bodies: np.ndarray,
               image_size: Tuple[int, int]) -> np.ndarray:
    """Return the depth of each person's trunk, (P,) [m]; NaN where unknown.

    It is the median over the joints, from the nearest person to the farthest: joints on somebody nearer do not count.

    Args:
        people: (P, K, 3) float.
        bodies: (P, h, w) uint8, of each on the grid of the depth.
    """
    xy = people[..., :2].reshape(-1, 2)
    samples = _median_depths(depth, xy, image_size).reshape(people.shape[:2])
    weights = np.where(np.isfinite(samples) & (people[..., 2] >= COVER.sure_joint), people[..., 2], 0.0)
    weights *= _joint_weights(skeleton)
    all_weights, distances, left = weights.copy(), np.full(len(people), np.nan), np.ones(len(people), bool)
    left &= all_weights.any(axis=1)
    while left.any():
        counted = np.where(((weights > 0).sum(axis=1) > 1)[:, None], weights, all_weights)
        medians = _weighted_medians(samples, counted)
        agreeing = (counted * (np.abs(samples - medians[:, None]) < LAYERS.agreement)).sum(axis=1)
        merit = medians - LAYERS.preference * agreeing / np.maximum(all_weights.sum(axis=1), 1e-9)
        nearest = int(np.where(left, merit, np.inf).argmin())
        distances[nearest], left[nearest] = medians[nearest], False
        on_body = _at(bodies[nearest], xy, image_size).reshape(samples.shape) > 0
        foreign = on_body & (np.abs(samples - medians[nearest]) < LAYERS.reach)
        weights[foreign & left[:, None]] = 0.0
    return distances


def _joint_weights(skeleton: SkeletonModel) -> np.ndarray:
    """Return how much joints tell of the depth of a trunk, (K,)."""
    def weight(joint: str) -> float:
        part = joint.split('_')[-1]
        return {'elbow': LAYERS.elbow_weight, 'knee': LAYERS.elbow_weight, 'wrist': LAYERS.wrist_weight,
                'ankle': LAYERS.wrist_weight}.get(part, 1.0)
    return np.array([weight(joint) for joint in skeleton.joints])


def _median_depths(depth: DepthView, xy: np.ndarray, image_size: Tuple[int, int]) -> np.ndarray:
    """Return the median depth of the 3 x 3 cells round positions, (N, 2) [px of the image], (N,) [m]; NaN: unknown."""
    x, y = (_cells(values, axis, depth.depth, image_size) for axis, values in enumerate(np.nan_to_num(xy).T))
    steps = np.array([-1, 0, 1])
    rows = np.clip(y[:, None] + np.repeat(steps, 3), 0, depth.depth.shape[0] - 1)
    columns = np.clip(x[:, None] + np.tile(steps, 3), 0, depth.depth.shape[1] - 1)
    windows = np.sort(depth.depth[rows, columns], axis=1)  # NaN come last
    count = np.isfinite(windows).sum(axis=1)
    median = windows[np.arange(len(windows)), np.maximum(count - 1, 0) // 2]
    return np.where(np.isfinite(xy).all(axis=1), median, np.nan)


def _weighted_medians(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the weighted median of each row of (P, K) values; those with a weight of 0 may be NaN."""
    values = np.where(weights > 0, values, np.inf)
    order = np.argsort(values, axis=1)
    sums = np.take_along_axis(weights, order, axis=1).cumsum(axis=1)
    middle = (sums < sums[:, -1:] / 2).sum(axis=1)
    return np.take_along_axis(values, order, axis=1)[np.arange(len(values)), middle]


def _at(grid: np.ndarray, xy: np.ndarray, image_size: Tuple[int, int]) -> np.ndarray:
    """Return the values of a grid, (h, w), at positions in the image, (N, 2) [px], or those nearest to it."""
    columns, rows = (_cells(values, axis, grid, image_size) for axis, values in enumerate(np.nan_to_num(xy).T))
    return grid[rows, columns]


def _cells(values: np.ndarray, axis: int, grid: np.ndarray, image_size: Tuple[int, int]) -> np.ndarray:
    """Return the columns (axis 0) or rows (1) of a grid, (h, w), at x or y in the image [px], those within it, int."""
    count = grid.shape[1 - axis]
    return np.clip((values + 0.5) * count / image_size[axis], 0, count - 1).astype(np.int64)


def vote_behind(opinions: Opinions, foreground: Optional[Foreground], recipe: Recipe, weights: Sequence[float],
                place_weights: Sequence[float]) -> np.ndarray:
    """Vote on a person who may be behind others; see `vote_with_crops`.

    Joints that a network with all of the image sees on somebody nearer are doubted, unless no crop shows the person:
    then nothing else tells where they are. Of two joints of a pair in one place the surer one stays.

    Args:
        foreground: what is in front of the person; None: nobody, or it is not known.
    """
    if foreground is None:
        return vote_with_crops(opinions, recipe, weights, place_weights)
    if max(opinions, default=0) >= recipe.pass_opinions:
        opinions = {number: pose if number >= recipe.pass_opinions else _doubted(pose, foreground)
                    for number, pose in opinions.items()}
    keypoints = vote_with_crops(opinions, recipe, weights, place_weights)
    nearest, index = LAYERS.one_place * np.sqrt(area(keypoints)), recipe.skeleton.index
    for part in _OUTER:
        if {f'left_{part}', f'right_{part}'} <= index.keys():
            pair = [index[f'left_{part}'], index[f'right_{part}']]
            if np.hypot(*(keypoints[pair[0], :2] - keypoints[pair[1], :2])) < nearest:
                keypoints[min(pair, key=lambda joint: keypoints[joint, 2])] = np.nan, np.nan, 0
    return keypoints


def _doubted(pose: np.ndarray, foreground: Foreground) -> np.ndarray:
    """Return a pose, (K, 3), with lower scores on somebody nearer."""
    pose = pose.copy()
    pose[foreground.holds(pose[:, :2]), 2] *= LAYERS.doubt
    return pose


def cover_others(crop: PreparedView, person: np.ndarray, others: Sequence[np.ndarray], skeleton: SkeletonModel,
                 foreground: Optional[Foreground] = None) -> PreparedView:
    """Return a crop of a person with the other people in the mean colour of the crop.

    Args:
        person: (K, 3) float: x, y [px of the image], score; NaN where missing.
        others: the same of each of the other people who are not in front.
        skeleton: their K joints.
        foreground: what is in front of the person; None: nobody, or it is not known.
    """
    height, width = crop.input.shape[:2]
    covered = np.zeros((height, width), np.uint8)
    for other in others:
        _paint(covered, _in_input(other, crop), skeleton, 1)
    if covered.any():
        _paint(covered, _in_input(person, crop), skeleton, 0)
    if foreground is not None:
        covered |= foreground.in_crop(crop.view)
    if not covered.any():
        return crop
    image = crop.input.copy()
    image[covered > 0] = np.round(cv2.mean(image)[:3])
    return replace(crop, input=image)


def _in_input(person: np.ndarray, crop: PreparedView) -> np.ndarray:
    """Return a person with the joints that are sure, in pixels of the input of the network."""
    view, pose = crop.view, _sure(person)
    xy = pose[:, :2] - view.origin
    if view.mirror:
        xy[:, 0] = view.plan.image_size[0] - 1 - xy[:, 0]
    return np.concatenate([view.plan.to_net(xy), pose[:, 2:]], axis=1)


def _sure(person: np.ndarray) -> np.ndarray:
    """Return a person, (K, 3), with the joints that are sure."""
    return np.where((person[:, 2] >= COVER.sure_joint)[:, None], person, np.nan)


def _paint(image: np.ndarray, pose: np.ndarray, skeleton: SkeletonModel, value: int, breadth_factor: float = 1.0
           ) -> None:
    """Paint a body, (K, 3) [px], into an image, (H, W) uint8."""
    # far beyond the image, where pixels are no numbers of 16 bits, lies nobody who is in it
    with np.errstate(invalid='ignore'):
        there = np.abs(pose[:, :2]).max(axis=1) < np.iinfo(np.int16).max
    size = breadth_factor * float(np.sqrt(area(pose)))  # round() of a NumPy number is no int with NumPy 1.17
    breadth = max(round(COVER.limb * size), 1)
    place = {joint: tuple(int(each) for each in np.round(pose[i, :2]))
             for joint, i in skeleton.index.items() if there[i]}
    for start, end in skeleton.drawn_limbs:
        if start in place and end in place:
            cv2.line(image, place[start], place[end], value, breadth)
    trunk = np.array([place[joint] for joint in _TRUNK if joint in place], np.int32)
    if len(trunk) > 1:
        cv2.fillConvexPoly(image, cv2.convexHull(trunk), value)
        cv2.polylines(image, [trunk], True, value, breadth)
    head = [place[joint] for joint in _HEAD if joint in place]
    if head:
        middle = tuple(int(each) for each in np.mean(head, axis=0))
        cv2.circle(image, middle, max(round(COVER.head * size), 1), value, cv2.FILLED)

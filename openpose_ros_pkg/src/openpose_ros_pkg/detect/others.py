"""Crops that show several people: the others are covered, so that a network for one person sees the right one.

A body in the image is its limbs, its trunk and its head, with breadths in proportion to its size. What lies on the body
of the person itself stays: whoever is in front, the network sees at most a piece of somebody else there.
"""
from dataclasses import dataclass, replace
from typing import Sequence

import cv2
import numpy as np

from openpose_ros_pkg.detect.views import PreparedView
from openpose_ros_pkg.oks import area
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.skeletons import SkeletonModel

_HEAD = ('nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear')
_TRUNK = ('right_shoulder', 'left_shoulder', 'left_hip', 'right_hip')


@dataclass(frozen=True)
class CoverConstants:
    """Which pixels of a crop belong to somebody."""

    limb: float = constant(
        0.14, 'Breadth of limbs, and of the border of the trunk, as a share of the root of the area of the person.')
    head: float = constant(0.16, 'Radius of the head, as a share of the same.')
    sure_joint: float = constant(0.15, 'Joints with a lower score cover nothing.')


COVER = CoverConstants()


def cover_others(crop: PreparedView, person: np.ndarray, others: Sequence[np.ndarray], skeleton: SkeletonModel
                 ) -> PreparedView:
    """Return a crop of a person with the other people in the mean colour of the crop.

    Args:
        person: (K, 3) float: x, y [px of the image], score; NaN where missing.
        others: the same of each of the other people.
        skeleton: their K joints.
    """
    height, width = crop.input.shape[:2]
    covered = np.zeros((height, width), np.uint8)
    for other in others:
        _paint(covered, _in_input(other, crop), skeleton, 1)
    if not covered.any():
        return crop
    _paint(covered, _in_input(person, crop), skeleton, 0)
    image = crop.input.copy()
    image[covered > 0] = np.round(cv2.mean(image)[:3])
    return replace(crop, input=image)


def _in_input(person: np.ndarray, crop: PreparedView) -> np.ndarray:
    """Return a person with the joints that are sure, in pixels of the input of the network."""
    view, pose = crop.view, np.where((person[:, 2] >= COVER.sure_joint)[:, None], person, np.nan)
    xy = pose[:, :2] - view.origin
    if view.mirror:
        xy[:, 0] = view.plan.image_size[0] - 1 - xy[:, 0]
    return np.concatenate([view.plan.to_net(xy), pose[:, 2:]], axis=1)


def _paint(image: np.ndarray, pose: np.ndarray, skeleton: SkeletonModel, value: int) -> None:
    """Paint a body, (K, 3) [px], into an image, (H, W) uint8."""
    # far beyond the image, where pixels are no numbers of 16 bits, lies nobody who is in it
    with np.errstate(invalid='ignore'):
        there = np.abs(pose[:, :2]).max(axis=1) < np.iinfo(np.int16).max
    size = np.sqrt(area(pose))
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

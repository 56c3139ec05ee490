"""Regions of interest: the rotated squares of an image in which networks look for the points of a hand or a face."""
from dataclasses import dataclass
from typing import Dict, Optional, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.params.constants import constant

_MEDIAPIPE = 'mediapipe/modules/{hand,face}_landmark/*_to_roi.pbtxt'
# Points of the hand that its region is made of: fingertips are left out, so that it stays where fingers bend.
_PALM = (0, 1, 2, 3, 5, 6, 9, 10, 13, 14, 17, 18)
# Corners of the eyes in the face mesh, the person's right one first.
_EYE_CORNERS = (33, 263)


@dataclass(frozen=True)
class HandRegionConstants:
    """Search region of a hand, measured in the length of a forearm that points along the image plane."""

    shoulders: float = constant(0.75, 'Forearm per distance of the shoulders; the longest of three estimates counts, '
                                      'as all become shorter with the direction of view.')
    trunk: float = constant(0.5, 'Forearm per distance from the neck to the middle of the hips.')
    reach: float = constant(0.3, 'From the wrist to the centre of the region, along the forearm.', unit='forearms')
    side: float = constant(1.2, 'Side of the region.', unit='forearms')
    hand: float = constant(0.7, 'Length of a hand.', unit='forearms')
    box_scale: float = constant(2.0, "Side of the next region per longer side of the box round the hand's points "
                                     'without fingertips.', source=_MEDIAPIPE)
    box_shift: float = constant(0.1, 'Shift of the next region towards the fingers, per side of that box.',
                                source=_MEDIAPIPE)


@dataclass(frozen=True)
class FaceRegionConstants:
    """Search region of a face, measured in its width."""

    eyes: float = constant(2.2, 'Width per distance of the eyes; the widest of three estimates counts.')
    eye_ear: float = constant(1.5, 'Width per distance from an eye to the ear beside it.')
    side: float = constant(1.6, 'Side of the region, whose centre is the nose.', unit='widths')
    box_scale: float = constant(1.5, "Side of the next region per longer side of the box round the face's points.",
                                source=_MEDIAPIPE)


HAND_REGION = HandRegionConstants()
FACE_REGION = FaceRegionConstants()


@dataclass(frozen=True)
class Region:
    """A rotated square."""

    x: float  # centre [px of the image, an integer is a pixel's centre]
    y: float
    side: float  # [px]
    angle: float = 0.0  # by which what points up in the region is turned clockwise in the image [rad]

    @property
    def axes(self) -> np.ndarray:
        """(2, 2) float64: right and down of the region as unit vectors of the image."""
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        return np.array([[cosine, sine], [-sine, cosine]])

    def to_image(self, xy: np.ndarray, pixels: int) -> np.ndarray:
        """Turn (..., 2) pixels of a crop of the region with a number of pixels on a side into those of the image."""
        return ((xy + 0.5) / pixels - 0.5) * self.side @ self.axes + (self.x, self.y)

    def to_crop(self, xy: np.ndarray, pixels: int) -> np.ndarray:
        """Do the opposite of `to_image`."""
        return ((xy - (self.x, self.y)) @ self.axes.T / self.side + 0.5) * pixels - 0.5

    def crop(self, bgr: np.ndarray, pixels: int) -> np.ndarray:
        """Return what an image, (H, W, 3) uint8, shows in the region, (pixels, pixels, 3); black beyond the image."""
        corners = np.array([(0, 0), (pixels, 0), (0, pixels)], np.float64)
        forward = cv2.getAffineTransform(corners.astype(np.float32), self.to_image(corners, pixels).astype(np.float32))
        return cv2.warpAffine(bgr, forward, (pixels, pixels), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)

    def moved(self, shift: np.ndarray) -> 'Region':
        """Return the region at another place, (2,) [px] away."""
        return Region(self.x + float(shift[0]), self.y + float(shift[1]), self.side, self.angle)


def forearm_length(joints: Dict[str, np.ndarray], side: str, constants: HandRegionConstants = HAND_REGION) -> float:
    """Return the length that a person's forearm would have along the image plane [px]; NaN: unknown.

    Args:
        joints: (2,) [px] of each joint that was found, by its name.
        side: 'left' or 'right'.
    """
    hips = [joints[name] for name in ('left_hip', 'right_hip') if name in joints]
    trunk = {'neck': joints['neck'], 'hips': np.mean(hips, axis=0)} if hips and 'neck' in joints else {}
    return _longest([
        _distance(joints, f'{side}_wrist', f'{side}_elbow'),
        constants.shoulders * _distance(joints, 'left_shoulder', 'right_shoulder'),
        constants.trunk * _distance(trunk, 'neck', 'hips')])


def hand_regions(wrist: np.ndarray, elbow: Optional[np.ndarray], length: float,
                 constants: HandRegionConstants = HAND_REGION) -> Tuple[Region, ...]:
    """Return the search regions of a hand: beyond the wrist, then above it.

    Args:
        wrist, elbow: (2,) [px]; elbow None: only above the wrist.
        length: of the forearm along the image plane [px].
    """
    directions = [np.array((0.0, -1.0))]
    if elbow is not None and (wrist != elbow).any():
        directions.insert(0, (wrist - elbow) / np.linalg.norm(wrist - elbow))
    centres = [wrist + constants.reach * length * direction for direction in directions]
    return tuple(Region(float(x), float(y), constants.side * length, upward_angle(direction))
                 for (x, y), direction in zip(centres, directions))


def region_of_hand(points: np.ndarray, constants: HandRegionConstants = HAND_REGION) -> Region:
    """Return the next search region of a hand with these points, (21, 2) [px]."""
    knuckles = (0.5 * (points[5] + points[13]) + points[9]) / 2
    region = _box(points[list(_PALM)], upward_angle(knuckles - points[0]))
    shifted = region.moved(-constants.box_shift * region.side * region.axes[1])
    return Region(shifted.x, shifted.y, constants.box_scale * shifted.side, shifted.angle)


def face_width(joints: Dict[str, np.ndarray], constants: FaceRegionConstants = FACE_REGION) -> float:
    """Return the width of a person's face [px]; NaN: unknown; see `forearm_length`."""
    sides = ('left', 'right')
    return _longest([
        _distance(joints, 'left_ear', 'right_ear'), constants.eyes * _distance(joints, 'left_eye', 'right_eye'),
        *(constants.eye_ear * _distance(joints, f'{side}_eye', f'{side}_ear') for side in sides)])


def face_regions(joints: Dict[str, np.ndarray], width: float, constants: FaceRegionConstants = FACE_REGION
                 ) -> Tuple[Region, ...]:
    """Return the search regions of the face of a body with a nose: along the line of the eyes, then upright."""
    angles = [0.0]
    if 'left_eye' in joints and 'right_eye' in joints:
        x, y = joints['left_eye'] - joints['right_eye']
        angles.insert(0, float(np.arctan2(y, x)))
    nose_x, nose_y = map(float, joints['nose'])
    return tuple(Region(nose_x, nose_y, constants.side * width, angle) for angle in angles)


def region_of_face(points: np.ndarray, constants: FaceRegionConstants = FACE_REGION) -> Region:
    """Return the next search region of a face with this mesh, (468, 2) [px]."""
    x, y = points[_EYE_CORNERS[1]] - points[_EYE_CORNERS[0]]
    region = _box(points, float(np.arctan2(y, x)))
    return Region(region.x, region.y, constants.box_scale * region.side, region.angle)


def _box(points: np.ndarray, angle: float) -> Region:
    """Return the rotated square of the longer side of the rotated box round (N, 2) points."""
    axes = Region(0.0, 0.0, 1.0, angle).axes
    along = points @ axes.T
    low, high = along.min(axis=0), along.max(axis=0)
    centre = (low + high) / 2 @ axes
    return Region(float(centre[0]), float(centre[1]), max(float((high - low).max()), 1.0), angle)


def upward_angle(up: np.ndarray) -> float:
    """Return by which angle a direction, (2,), is turned clockwise from up in the image [rad]."""
    return float(np.arctan2(up[0], -up[1]))


def _distance(joints: Dict[str, np.ndarray], first: str, second: str) -> float:
    """Return the distance of two joints; NaN where one is missing."""
    if first not in joints or second not in joints:
        return float('nan')
    return float(np.linalg.norm(joints[first] - joints[second]))


def _longest(lengths: Sequence[float]) -> float:
    return max((length for length in lengths if np.isfinite(length)), default=float('nan'))

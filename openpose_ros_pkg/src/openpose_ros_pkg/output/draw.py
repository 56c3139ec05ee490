"""Draw people into images as OpenPose does."""
import colorsys
import math
from dataclasses import dataclass
from typing import Optional, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.landmarks.records import Landmarks2D
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import FACE_70, HAND_21, SkeletonModel

# Fractional bits of the coordinates that OpenCV's drawing functions take.
_SHIFT = 3
# OpenPose, src/openpose/pose/renderPose.cpp and utilities/keypoint.cpp: radius [share of the image's size], line width
# [diameters]; both shrink with the share of the image that the person fills.
_CIRCLE_RATIO = 1 / 75
_LINE_RATIO = 0.75
# Size of hands and faces in radii of their joints, which are as wide as their lines.
_RADII_OF_HAND = 30
# Limbs with a hidden end: width as a share of other limbs', length of dashes and gaps in widths of other limbs.
_HIDDEN_WIDTH = 0.4
_DASH = 1.2


@dataclass(frozen=True)
class DrawParams(Parameters):
    """How people are drawn."""

    alpha_pose: float = parameter(
        0.6, 'Opacity of the skeletons on the image: 0 invisible, 1 opaque.', minimum=0.0, maximum=1.0)
    disable_blending: bool = parameter(
        False, 'Draw the skeletons on a black background instead of the image.')
    render_threshold: float = parameter(
        0.05, 'Joints with less confidence are not drawn.', minimum=0.0, maximum=1.0)


def draw_people(bgr: np.ndarray, people: People2D, params: DrawParams, hidden: Optional[np.ndarray] = None,
                landmarks: Optional[Landmarks2D] = None) -> np.ndarray:
    """Return a copy of the image with people drawn into it.

    Limbs and joints have OpenPose's colours; each person has a box, and a label with the id if any, in its own colour.

    Args:
        bgr: (H, W, 3) uint8 BGR; not modified.
        hidden: (P, K) bool: occluded joints, drawn as hollow circles; limbs that end there are thin and dashed. None:
            none is.
        landmarks: hands and faces; None: none.

    Returns:
        (H, W, 3) uint8 BGR.
    """
    # A black background is not blended.
    image = np.zeros(bgr.shape, np.uint8) if params.disable_blending else np.array(bgr, np.uint8, order='C')
    if len(people) == 0:
        return image
    canvas = image.copy()
    least = max(params.render_threshold, float(np.finfo(np.float32).tiny))
    visible = people.confidence >= least
    shown = np.flatnonzero(visible.any(axis=1)).tolist()
    _draw_skeletons(canvas, people.skeleton, people.keypoints, hidden, least)
    if landmarks is not None:
        hands, faces = landmarks.hands, landmarks.faces
        _draw_skeletons(canvas, HAND_21, hands.keypoints, hands.hidden, least)
        _draw_skeletons(canvas, FACE_70, faces.keypoints, faces.hidden, least)
    if not params.disable_blending:
        canvas = cv2.addWeighted(canvas, params.alpha_pose, image, 1 - params.alpha_pose, 0)
    if params.disable_blending or params.alpha_pose > 0:
        for i in shown:
            _draw_box(canvas, people.xy[i][visible[i]], i, int(people.ids[i]))
    return canvas


def person_colour(number: int) -> Tuple[int, int, int]:
    """Return a BGR colour for a person; consecutive numbers differ clearly (golden section of the hue circle)."""
    red, green, blue = colorsys.hsv_to_rgb((number * 0.618034) % 1, 0.75, 1)
    return round(255 * blue), round(255 * green), round(255 * red)


def _draw_skeletons(canvas: np.ndarray, skeleton: SkeletonModel, keypoints: np.ndarray, hidden: Optional[np.ndarray],
                    least: float) -> None:
    """Draw people, hands or faces, (N, K, 3): limbs in the colour of their second joint, then joints."""
    hidden = np.zeros(keypoints.shape[:2], bool) if hidden is None else hidden
    limbs = [(skeleton.index[start], skeleton.index[end]) for start, end in skeleton.drawn_limbs]
    for points, behind in zip(keypoints, hidden):
        shown, xy = points[:, 2] >= least, points[:, :2]
        if not shown.any():
            continue
        if skeleton in (HAND_21, FACE_70):
            size = float((xy[shown].max(axis=0) - xy[shown].min(axis=0)).max())
            radius = width = max(1, round(size / _RADII_OF_HAND))
        else:
            radius = _joint_radius(canvas.shape, xy[shown])
            width = max(1, round(2 * radius * _LINE_RATIO))
        for start, end in limbs:
            if shown[start] and shown[end]:
                draw = _draw_dashed if behind[start] or behind[end] else _draw_line
                draw(canvas, xy[start], xy[end], skeleton.colours[end][::-1], width)
        for joint in np.flatnonzero(shown):
            # larger where it is hollow: the smallest circle has a hole, too
            size, line = (radius + 2, max(1, radius // 3)) if behind[joint] else (radius, -1)
            cv2.circle(canvas, _fixed_point(xy[joint]), size << _SHIFT, skeleton.colours[joint][::-1], line,
                       cv2.LINE_AA, _SHIFT)


def _draw_line(canvas: np.ndarray, start: np.ndarray, end: np.ndarray, colour: Tuple[int, ...], width: int) -> None:
    cv2.line(canvas, _fixed_point(start), _fixed_point(end), colour, width, cv2.LINE_AA, _SHIFT)


def _draw_dashed(canvas: np.ndarray, start: np.ndarray, end: np.ndarray, colour: Tuple[int, ...], width: int) -> None:
    """Draw a thin line of equal dashes and gaps that begins and ends with a dash."""
    gaps = int(float(np.linalg.norm(end - start)) / (2 * _DASH * width))
    ends = start + np.linspace(0, 1, 2 * gaps + 2)[:, None] * (end - start)
    for begin, finish in zip(ends[::2], ends[1::2]):
        _draw_line(canvas, begin, finish, colour, max(1, round(_HIDDEN_WIDTH * width)))


def _fixed_point(xy: np.ndarray) -> Tuple[int, int]:
    """Return a position [px] as OpenCV's drawing functions take it."""
    x, y = np.rint(xy * (1 << _SHIFT))
    return int(x), int(y)


def _joint_radius(shape: Tuple[int, ...], xy: np.ndarray) -> int:
    """Return the radius of a person's joints [px]."""
    height, width = shape[:2]
    share = ((xy.max(axis=0) - xy.min(axis=0)) / (width, height)).max()
    return max(2, round(math.sqrt(height * width) * _CIRCLE_RATIO * min(1.0, float(share)) / 2))


def _draw_box(canvas: np.ndarray, xy: np.ndarray, row: int, person_id: int) -> None:
    """Draw the box of a person in its own colour, with its id, if any, at the top."""
    height, width = canvas.shape[:2]
    colour = person_colour(person_id if person_id >= 0 else row)
    margin = max(4, round(0.012 * math.sqrt(height * width)))
    left, top = np.maximum(np.floor(xy.min(axis=0)).astype(int) - margin, 0).tolist()
    right, bottom = np.minimum(np.ceil(xy.max(axis=0)).astype(int) + margin, (width - 1, height - 1)).tolist()
    cv2.rectangle(canvas, (left, top), (right, bottom), colour, 1)
    if person_id < 0:
        return
    text, font = str(person_id), cv2.FONT_HERSHEY_SIMPLEX
    scale = max(0.4, math.sqrt(height * width) / 1200)
    (text_width, text_height), baseline = cv2.getTextSize(text, font, scale, 1)
    # Above the box, or inside it at the image's border.
    bottom = top if top >= text_height + baseline else min(top + text_height + baseline, height - 1)
    left = min(left, max(0, width - 1 - text_width - 4))
    cv2.rectangle(canvas, (left, bottom - text_height - baseline), (left + text_width + 4, bottom), colour, -1)
    cv2.putText(canvas, text, (left + 2, bottom - baseline // 2 - 1), font, scale, (0, 0, 0), 1, cv2.LINE_AA)

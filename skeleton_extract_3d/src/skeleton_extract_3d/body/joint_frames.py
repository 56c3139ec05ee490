"""The frame of each joint, right-handed: along a limb, or that of trunk or head; the convention is in docs/ros_api.md.

A straight limb does not show its bending axis: y is then as if the limb had been turned on the shortest way from the
reference pose, arms stretched out to the sides and legs straight down. In between y turns from one to the other.
"""
from typing import Dict, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.people import People3D

# Left arm, right arm, left leg, right leg.
_LIMBS = tuple(tuple(f'{side}_{joint}' for joint in joints) for joints in (
    ('shoulder', 'elbow', 'wrist'), ('hip', 'knee', 'ankle')) for side in ('left', 'right'))
# Axes x, y, z (columns) of straight limbs in the reference pose, in those of the trunk.
_STRETCHED = np.array([[[0, 0, 1], [1, 0, 0], [0, 1, 0]], [[0, 0, 1], [-1, 0, 0], [0, -1, 0]],
                       [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]])[:, None]
# Elbows and knees bend in opposite senses: y is lower times upper part of arms, upper times lower part of legs.
_SENSES = np.array([1, 1, -1, -1])[:, None, None]
# Sine of the bend of elbow or knee from which on the bending axis turns the limb (12 degrees: the error of two
# directions with 3 cm at the end of a bone of 25 cm), and from which on it alone is the second axis (30 degrees).
_LEAST_BEND, _CLEAR_BEND = 0.2, 0.5
_HEAD = ('nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear', 'head_top')


@np.errstate(invalid='ignore', divide='ignore')
def joint_frames(people: People3D, method: MethodConstants = METHOD) -> np.ndarray:
    """Return the axes of the frames of all joints, (P, K, 3, 3) float64: columns x, y, z in the frame of the people."""
    at = _positions(people)
    thorax, pelvis = _trunk(at)
    head = _frame_or(_head(at, method), thorax)
    frames = {'neck': thorax, 'chest': thorax, 'mid_hip': pelvis, **dict.fromkeys(_HEAD, head)}
    limbs = np.array([[at[joint] for joint in joints] for joints in _LIMBS])
    for joints, upper, lower in zip(_LIMBS, *_limbs(np.array([thorax, thorax, pelvis, pelvis]), limbs)):
        frames.update(zip(joints, (upper, lower, lower)))
    for side in ('left', 'right'):
        ankle, toe = f'{side}_ankle', f'{side}_big_toe'
        foot = _frame_or(_swung(frames[ankle], _unit(at[toe] - at[ankle])), frames[ankle])
        frames.update(dict.fromkeys((ankle, toe, f'{side}_small_toe', f'{side}_heel'), foot))
    return np.stack([frames[joint] for joint in people.skeleton.joints], axis=1)


@np.errstate(invalid='ignore', divide='ignore')
def pelvis_frames(people: People3D) -> np.ndarray:
    """Return the axes of the frame of mid_hip, also of joint sets without it; see `joint_frames`, (P, 3, 3) float64."""
    return _trunk(_positions(people))[1]


def _positions(people: People3D) -> Dict[str, np.ndarray]:
    """Return the positions of all joints of messages, (P, 3) each [m]; NaN where missing."""
    index, missing = people.skeleton.index, np.full((len(people), 3), np.nan)
    return {joint: people.xyz[:, index[joint]].astype(np.float64) if joint in index else missing
            for joint in MESSAGE_JOINTS}


def _trunk(at: Dict[str, np.ndarray]) -> Tuple[np.ndarray, np.ndarray]:
    """Return the frames of the upper trunk and of the pelvis, (P, 3, 3)."""
    left, right, left_hip, right_hip = (at[joint] for joint in (
        'left_shoulder', 'right_shoulder', 'left_hip', 'right_hip'))
    up = _unit(_known(at['neck'], (left + right) / 2) - _known(at['mid_hip'], (left_hip + right_hip) / 2))
    thorax, pelvis = _upright(up, left - right), _upright(up, left_hip - right_hip)
    return _frame_or(_frame_or(thorax, pelvis), np.eye(3)), _frame_or(_frame_or(pelvis, thorax), np.eye(3))


def _head(at: Dict[str, np.ndarray], method: MethodConstants) -> np.ndarray:
    """Return the frame of the head, (P, 3, 3); NaN where nose, an ear, or both of ears and eyes are missing."""
    left, right = at['left_ear'], at['right_ear']
    y = _unit(_known(left - right, at['left_eye'] - at['right_eye']))
    to_nose = at['nose'] - _known((left + right) / 2, _known(left, right))
    ahead = _unit(to_nose - _dot(to_nose, y) * y)
    above = np.cross(ahead, y)
    # angle by which the line from the middle of the ears to the nose points down when the head looks straight ahead
    nose_down = np.arctan2(*method.body.head_points[0, 1:])
    cos, sin = np.cos(nose_down), np.sin(nose_down)
    return np.stack([cos * ahead + sin * above, y, cos * above - sin * ahead], axis=-1)


def _limbs(trunks: np.ndarray, joints: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the frames of the upper and the lower parts of limbs, (4, P, 3, 3) each, by those that they hang on and
    joints (4, 3, P, 3) [m]: root, middle and end of each limb.
    """
    along, further = np.moveaxis(_unit(np.diff(joints, axis=1)), 1, 0)
    stretched = trunks @ _STRETCHED
    _, y, z = np.moveaxis(_swung(stretched, along), -1, 0)
    bending = _SENSES * np.cross(further, along)  # as long as the sine of the bend
    share = np.clip((np.linalg.norm(bending, axis=-1, keepdims=True) - _LEAST_BEND)
                    / (_CLEAR_BEND - _LEAST_BEND), 0, 1)
    turn = np.nan_to_num(share * share * (3 - 2 * share) * np.arctan2(_dot(bending, z), _dot(bending, y)))
    cos, sin = np.cos(turn), np.sin(turn)
    upper = np.stack([along, cos * y + sin * z, cos * z - sin * y], axis=-1)
    lower = _frame_or(_swung(_frame_or(upper, stretched), further), upper)
    return _frame_or(upper, trunks), _frame_or(lower, trunks)


def _upright(up: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Return the frames with z along unit vectors `up` and y as far to the left as that allows; NaN if not known."""
    y = _unit(left - _dot(left, up) * up)
    return np.stack([np.cross(y, up), y, up], axis=-1)


def _swung(frames: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return frames (..., 3, 3) turned on the shortest way so that x points along unit vectors; NaN if opposite."""
    axes = np.swapaxes(frames, -1, -2)
    around = np.cross(axes[..., 0, :], directions)[..., None, :]
    cosine = _dot(axes[..., :1, :], directions[..., None, :])
    # Rodrigues' formula, for each of the three axes
    turned = axes * cosine + np.cross(around, axes) + around * _dot(around, axes) / (1 + cosine)
    return np.asarray(np.swapaxes(turned, -1, -2))


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray((a * b).sum(axis=-1, keepdims=True))


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors with length 1; NaN for those without a length."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 0, vectors / length, np.nan)


def _known(vectors: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    """Return vectors, others in place of those that are not finite."""
    return np.where(np.isfinite(vectors).all(axis=-1, keepdims=True), vectors, otherwise)


def _frame_or(frames: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    """Return frames, others in place of those that are not finite."""
    return np.where(np.isfinite(frames).all(axis=(-2, -1), keepdims=True), frames, otherwise)

"""Rotations and directions.

World: x right, y away from the camera, z up [m], floor at z = 0. A person with yaw 0 faces -y; positive yaw turns
towards +x. Person frame: (outward or left, forward, up).
"""
from typing import Sequence, Tuple

import numpy as np
from scipy.spatial.transform import Rotation


def unit(vector: Sequence[float]) -> np.ndarray:
    vector = np.asarray(vector, float)
    return vector / np.linalg.norm(vector)


def rotation(axis: str, degrees: float) -> np.ndarray:
    """Return the (3, 3) rotation about x, y or z."""
    angle = np.deg2rad(degrees)
    cosine, sine = np.cos(angle), np.sin(angle)
    if axis == 'x':
        return np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
    if axis == 'y':
        return np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    return np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1.0]])


def rotation_about(axis: Sequence[float], degrees: float) -> np.ndarray:
    """Return the (3, 3) rotation about any axis."""
    return Rotation.from_rotvec(np.deg2rad(degrees) * unit(axis)).as_matrix()


def align(start: Sequence[float], end: Sequence[float]) -> np.ndarray:
    """Return the smallest (3, 3) rotation that takes a direction to another; half a turn for opposite ones."""
    start, end = unit(start), unit(end)
    axis, cosine = np.cross(start, end), float(start @ end)
    if cosine < -0.9999:
        across = unit(np.cross(start, (1.0, 0.1, 0.0)))
        return 2 * np.outer(across, across) - np.eye(3)
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + skew + skew @ skew / (1 + cosine)


def frame_of(direction: Sequence[float], normal: Sequence[float]) -> np.ndarray:
    """Return the (3, 3) matrix whose columns are the direction, the part of the normal across it, and their product."""
    direction = unit(direction)
    normal = unit(normal - direction * (np.asarray(normal, float) @ direction))
    return np.stack([direction, normal, np.cross(direction, normal)], 1)


def two_bones(start: np.ndarray, end: np.ndarray, lengths: Tuple[float, float], pole: np.ndarray
              ) -> Tuple[np.ndarray, np.ndarray]:
    """Return the directions of two bones from start that end at `end`, or as near as they reach, bent towards pole."""
    first, second = lengths
    towards = end - start
    distance = np.linalg.norm(towards)
    reach = float(np.clip(distance, abs(first - second) + 0.02, (first + second) * 0.998))
    towards = towards / distance
    across = pole - towards * (pole @ towards)
    across = across / (np.linalg.norm(across) + 1e-9)
    cosine = np.clip((first ** 2 + reach ** 2 - second ** 2) / (2 * first * reach), -1, 1)
    bone = first * (cosine * towards + np.sqrt(1 - cosine ** 2) * across)
    return unit(bone), unit(towards * reach - bone)


def heading(right: float, away: float) -> float:
    """Return the yaw [deg] of a person who walks along (right, away)."""
    return float(np.rad2deg(np.arctan2(right, -away)))

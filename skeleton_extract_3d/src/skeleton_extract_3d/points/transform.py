"""Express people, their hands and faces in another frame of reference."""
import dataclasses
from typing import Tuple

import numpy as np
from scipy.spatial.transform import Rotation

from skeleton_extract_3d.landmarks import Landmarks3D, Points3D
from skeleton_extract_3d.people import People3D

Transform = Tuple[np.ndarray, np.ndarray]
"""Rotation (3, 3) and translation (3,) [m] of x' = R x + t."""
IDENTITY: Transform = np.eye(3), np.zeros(3)
UPRIGHT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""Axes x forward, y left, z up (REP 103) of a level camera, as columns in its optical frame."""
TURNED = '_upright'
"""End of the name of a frame with these axes."""
LEVEL: Transform = UPRIGHT.T, np.zeros(3)
"""From the optical frame of a level camera to these axes."""


# Largest rotation (as a sine) and translation [m] between frames that count as one.
_SAME_PLACE = 2e-3


def is_same_place(rotation: np.ndarray, translation: np.ndarray) -> bool:
    """Return whether a transform connects two names of one frame."""
    return bool(max(np.abs(rotation - np.eye(3)).max(), np.abs(translation).max()) < _SAME_PLACE)


def transform_people(people: People3D, rotation: np.ndarray, translation: np.ndarray) -> People3D:
    """Return the people with x' = R x + t and v' = R v; sigma, being isotropic, stays."""
    turn = np.asarray(rotation).T
    return dataclasses.replace(people, xyz=people.xyz.astype(np.float64) @ turn + np.asarray(translation),
                               velocity=people.velocity.astype(np.float64) @ turn)


def transform_landmarks(landmarks: Landmarks3D, rotation: np.ndarray, translation: np.ndarray) -> Landmarks3D:
    """Return hands and faces with x' = R x + t, and heads that are turned with them; sigma, being isotropic, stays."""
    def moved(points: Points3D) -> Points3D:
        return dataclasses.replace(points, xyz=points.xyz.astype(np.float64) @ np.asarray(rotation).T
                                   + np.asarray(translation))

    hands, faces = landmarks.hands, landmarks.faces
    turns = faces.orientations.copy()
    known = np.isfinite(turns).all(axis=1)
    if known.any():
        turns[known] = (rotation_of(rotation) * Rotation.from_quat(turns[known])).as_quat()
    return Landmarks3D(dataclasses.replace(hands, points=moved(hands.points)),
                       dataclasses.replace(faces, points=moved(faces.points), orientations=turns))


def quarter_turns(degrees: int) -> np.ndarray:
    """Return R (3, 3) of x' = R x, from the frame of a camera to that of one whose images are turned clockwise."""
    return np.linalg.matrix_power(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), degrees // 90)


def rotation_of(matrices: np.ndarray) -> Rotation:
    """Return rotation matrices (3, 3) or (N, 3, 3) as SciPy's rotation."""
    from_matrix = getattr(Rotation, 'from_matrix', None) or Rotation.from_dcm  # its name before SciPy 1.4
    return from_matrix(matrices)


def quaternions(rotations: np.ndarray) -> np.ndarray:
    """Return the unit quaternions x, y, z, w of rotation matrices, (N, 3, 3) -> (N, 4) float64."""
    if len(rotations) == 0:
        return np.zeros((0, 4))
    return np.asarray(rotation_of(rotations).as_quat())

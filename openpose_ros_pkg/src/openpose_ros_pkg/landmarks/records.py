"""Hands and faces in an image: which are wanted, and the types between networks, painter, lifting and converters."""
from dataclasses import dataclass
from typing import Any, Optional, Tuple

import numpy as np

from openpose_ros_pkg.params.parameters import Parameters, parameter

# Points of a hand in the order of OpenPose: wrist, then thumb, index, middle, ring and little finger from base to tip.
HAND_POINTS = 21
HAND_POINT_NAMES = ('wrist', *(f'{finger}_{number}' for finger in ('thumb', 'index', 'middle', 'ring', 'little')
                               for number in range(1, 5)))
# Points of a face in the order of OpenPose: the 68 of iBUG, then the right and the left pupil.
FACE_POINTS = 70
# Points of the mesh of MediaPipe's face network.
MESH_POINTS = 468


@dataclass(frozen=True)
class LandmarkParams(Parameters):
    """Hands and faces of the people."""

    retired = ('least_hand_size', 'least_face_size', 'hand_threshold', 'face_threshold')

    hands: bool = parameter(False, 'Find 21 points of each hand.')
    face: bool = parameter(False, 'Find 70 points of each face.')


def _check(record: Any, points: int, **more: Tuple[type, Tuple[int, ...]]) -> None:
    """Convert the arrays of hands or faces, and of `more` fields (type, shape of one); ValueError: a wrong shape."""
    for name, (dtype, shape) in {'keypoints': (np.float32, (points, 3)), 'scores': (np.float32, ()),
                                 'people': (np.int64, ()), 'hidden': (np.bool_, (points,)), **more}.items():
        if getattr(record, name) is not None:
            value: np.ndarray = np.asarray(getattr(record, name), dtype)
            if value.shape != (len(record.keypoints), *shape):
                raise ValueError(f'{name}: expected {(len(record.keypoints), *shape)}, got {value.shape}')
            object.__setattr__(record, name, value)


@dataclass(frozen=True)
class Hands2D:
    """H hands in an image; ValueError: an array has the wrong shape."""

    keypoints: np.ndarray  # (H, 21, 3) float32: x, y [px of the image], score [0..1]; NaN, NaN, 0 where missing
    scores: np.ndarray  # (H,) float32 [0..1], how sure the network is that it sees a hand
    people: np.ndarray  # (H,) int64 ids of the people whose hands they are
    left: np.ndarray  # (H,) bool: left hands, the person's own
    hidden: Optional[np.ndarray] = None  # (H, 21) bool: points that something hides; None: that is not known

    def __post_init__(self) -> None:
        _check(self, HAND_POINTS, left=(np.bool_, ()))

    @classmethod
    def empty(cls) -> 'Hands2D':
        """Return no hand."""
        return cls(np.zeros((0, HAND_POINTS, 3)), np.zeros(0), np.zeros(0), np.zeros(0))

    def __len__(self) -> int:
        return len(self.keypoints)


@dataclass(frozen=True)
class Faces2D:
    """F faces in an image; ValueError: an array has the wrong shape."""

    keypoints: np.ndarray  # (F, 70, 3) float32, as those of hands
    # (F, M, 3) float32 [px of the image]: x, y, depth relative to the middle of the head, of the 468 points of
    # MediaPipe's mesh as its network gives them, or of the keypoints by the shape of an average face
    mesh: np.ndarray
    scores: np.ndarray  # (F,) float32 [0..1], how sure the network is that it sees a face
    people: np.ndarray  # (F,) int64 ids of the people whose faces they are
    hidden: Optional[np.ndarray] = None  # (F, 70) bool: points that something hides; None: that is not known

    def __post_init__(self) -> None:
        points = FACE_POINTS if np.shape(self.mesh)[1:2] == (FACE_POINTS,) else MESH_POINTS
        _check(self, FACE_POINTS, mesh=(np.float32, (points, 3)))

    @classmethod
    def empty(cls) -> 'Faces2D':
        """Return no face."""
        return cls(np.zeros((0, FACE_POINTS, 3)), np.zeros((0, MESH_POINTS, 3)), np.zeros(0), np.zeros(0))

    def __len__(self) -> int:
        return len(self.keypoints)


@dataclass(frozen=True)
class Landmarks2D:
    """Hands and faces of the people in an image."""

    hands: Hands2D
    faces: Faces2D

    @classmethod
    def empty(cls) -> 'Landmarks2D':
        """Return neither hands nor faces."""
        return cls(Hands2D.empty(), Faces2D.empty())

"""Hands and faces in an image: the types that pass between networks, painter, lifting and converters."""
from dataclasses import dataclass
from typing import Optional

import numpy as np

# Points of a hand in the order of OpenPose: wrist, then thumb, index, middle, ring and little finger from base to tip.
HAND_POINTS = 21
HAND_POINT_NAMES = ('wrist', *(f'{finger}_{number}' for finger in ('thumb', 'index', 'middle', 'ring', 'little')
                               for number in range(1, 5)))
# Points of a face in the order of OpenPose: the 68 of iBUG, then the right and the left pupil.
FACE_POINTS = 70
# Points of the mesh of MediaPipe's face network.
MESH_POINTS = 468


def _take(record: object, name: str, dtype: type, *shape: int) -> None:
    """Convert a field of a frozen record to an array, and raise ValueError where its shape is wrong."""
    value: np.ndarray = np.asarray(getattr(record, name), dtype)
    if value.shape != shape:
        raise ValueError(f'{name}: expected {shape}, got {value.shape}')
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
        number = len(self.keypoints)
        if self.hidden is not None:
            _take(self, 'hidden', np.bool_, number, HAND_POINTS)
        _take(self, 'keypoints', np.float32, number, HAND_POINTS, 3)
        _take(self, 'scores', np.float32, number)
        _take(self, 'people', np.int64, number)
        _take(self, 'left', np.bool_, number)

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
        number = len(self.keypoints)
        if self.hidden is not None:
            _take(self, 'hidden', np.bool_, number, FACE_POINTS)
        _take(self, 'keypoints', np.float32, number, FACE_POINTS, 3)
        mesh = np.shape(self.mesh)
        _take(self, 'mesh', np.float32, number, FACE_POINTS if mesh == (number, FACE_POINTS, 3) else MESH_POINTS, 3)
        _take(self, 'scores', np.float32, number)
        _take(self, 'people', np.int64, number)

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

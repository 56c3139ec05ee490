"""Hands and faces in space: the types that pass between lifting, markers and converters."""
from dataclasses import dataclass, field, replace
from typing import NamedTuple, final

import numpy as np

from openpose_ros_pkg.landmarks.records import FACE_POINTS, HAND_POINTS, Landmarks2D
from skeleton_extract_3d.people import INFERRED, check_points_of


@dataclass(frozen=True)
class Points3D:
    """The K points of each of N hands or faces, in one frame of reference.

    Attributes:
        xyz: (N, K, 3) float32 [m]; NaN where MISSING.
        confidence: (N, K) float32 [0..1] of the points in the image.
        status: (N, K) uint8: MISSING, MEASURED or INFERRED, see `people`.
        sigma: (N, K) float32 [m], root mean square distance of the true position from xyz; NaN where MISSING.

    Raises:
        ValueError: see `check_points_of`.
    """

    xyz: np.ndarray
    confidence: np.ndarray
    status: np.ndarray
    sigma: np.ndarray

    def __post_init__(self) -> None:
        check_points_of(self, self.xyz.shape[:2])

    @classmethod
    def empty(cls, points: int) -> 'Points3D':
        """Return no point."""
        none = np.zeros((0, points))
        return cls(np.zeros((0, points, 3)), none, none, none)

    def __len__(self) -> int:
        return len(self.xyz)


@dataclass(frozen=True)
class Hands3D:
    """H hands in space.

    Attributes:
        points: (H, 21) in the order of OpenPose.
        scores: (H,) float32 [0..1], how sure the network is that it sees a hand.
        people: (H,) int64 ids of their people.
        left: (H,) bool: left hands, the person's own.
    """

    points: Points3D
    scores: np.ndarray
    people: np.ndarray
    left: np.ndarray

    @classmethod
    def empty(cls) -> 'Hands3D':
        """Return no hand."""
        return cls(Points3D.empty(HAND_POINTS), np.zeros(0, np.float32), np.zeros(0, np.int64), np.zeros(0, bool))

    def __len__(self) -> int:
        return len(self.points)


@dataclass(frozen=True)
class Faces3D:
    """F faces in space.

    Attributes:
        points: (F, 70) in the order of OpenPose.
        scores: (F,) float32 [0..1], how sure the network is that it sees a face.
        people: (F,) int64 ids of their people.
        orientations: (F, 4) float32 quaternions x, y, z, w of the heads in the frame of the points: x forward, out of
            the face, y to the person's left, z up; NaN where it is not known.
        orientation_sigma: (F,) float32 [rad], root mean square angle between the head's x and the true one.
    """

    points: Points3D
    scores: np.ndarray
    people: np.ndarray
    orientations: np.ndarray
    orientation_sigma: np.ndarray

    @classmethod
    def empty(cls) -> 'Faces3D':
        """Return no face."""
        return cls(Points3D.empty(FACE_POINTS), np.zeros(0, np.float32), np.zeros(0, np.int64),
                   np.zeros((0, 4), np.float32), np.zeros(0, np.float32))

    def __len__(self) -> int:
        return len(self.points)


@final  # so that mypy tells it from people
@dataclass(frozen=True)
class Landmarks3D:
    """Hands and faces of the people before a camera."""

    hands: Hands3D = field(default_factory=Hands3D.empty)
    faces: Faces3D = field(default_factory=Faces3D.empty)


class Landmarks(NamedTuple):
    """Hands and faces of a frame: as they were found in the image, and in space."""

    in_image: Landmarks2D = Landmarks2D.empty()
    in_space: Landmarks3D = Landmarks3D()


def with_hidden(found: Landmarks2D, lifted: Landmarks3D) -> Landmarks2D:
    """Return hands and faces of an image with the points that are INFERRED in space as hidden."""
    hands = {(person, left): points == INFERRED for person, left, points in
             zip(lifted.hands.people.tolist(), lifted.hands.left.tolist(), lifted.hands.points.status)}
    faces = {person: points == INFERRED
             for person, points in zip(lifted.faces.people.tolist(), lifted.faces.points.status)}
    of_hands = [hands.get(hand, np.zeros(HAND_POINTS, bool))
                for hand in zip(found.hands.people.tolist(), found.hands.left.tolist())]
    of_faces = [faces.get(person, np.zeros(FACE_POINTS, bool)) for person in found.faces.people.tolist()]
    return Landmarks2D(replace(found.hands, hidden=np.reshape(of_hands, (-1, HAND_POINTS))),
                       replace(found.faces, hidden=np.reshape(of_faces, (-1, FACE_POINTS))))

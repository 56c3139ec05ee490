"""Hands and faces by the points that a network for whole bodies found with the body."""
from typing import Dict, List, Optional, Sequence

import numpy as np

from openpose_ros_pkg.landmarks.face_points import PUPILS, with_depth
from openpose_ros_pkg.landmarks.landmark_network import (
    HAND,
    LANDMARKS,
    Kind,
    LandmarkConstants,
    LandmarkObservation,
    Target,
)

# Of the 70 points of a face, the tip of the nose.
_NOSE_TIP = 30
# First points of the face, the left and the right hand; see `skeletons.WHOLE_BODY_133`.
_FACE, _LEFT_HAND, _RIGHT_HAND = 23, 91, 112


def _face_of(points: np.ndarray) -> np.ndarray:
    """Return the face, (70, 3), of COCO-WholeBody's points, (133, 3); the pupils are the middles of the eyes."""
    face = points[_FACE:_LEFT_HAND]
    pupils = [np.append(face[eye, :2].mean(axis=0), face[eye, 2].min()) for eye in PUPILS]
    pupils = [pupil if pupil[2] > 0 else np.array([np.nan, np.nan, 0]) for pupil in pupils]
    return np.concatenate([face, pupils]).astype(points.dtype)


class WholeBodyLandmarks:
    """What `LandmarkNetwork` does, without a network: the points are there, left and right as the network has them.

    The score of a hand or a face grows with the mean of those of its points, missing ones being 0, and is 0.5 at
    `LandmarkConstants.half_presence`. It does not count where its wrist or nose is far from that of the body, which
    other networks see as well.

    Args:
        points: (P, 133, 3) of the people of an image, see `People2D.points`.
    """

    def __init__(self, kind: Kind, points: np.ndarray, constants: LandmarkConstants = LANDMARKS) -> None:
        self.kind, self._points, self._constants = kind, points, constants

    def observe(self, bgr: np.ndarray, targets: Sequence[Target], known: Dict[int, LandmarkObservation], stamp: float
                ) -> List[Optional[LandmarkObservation]]:
        """Return the observations of targets; None: not found. Image and earlier ones are not needed."""
        return [self._observed(target, stamp) for target in targets]

    def _observed(self, target: Target, stamp: float) -> Optional[LandmarkObservation]:
        of_person = self._points[target.person]
        hand = of_person[_LEFT_HAND:_RIGHT_HAND] if target.left else of_person[_RIGHT_HAND:]
        keypoints = hand if self.kind is HAND else _face_of(of_person)
        anchor = keypoints[0 if self.kind is HAND else _NOSE_TIP]
        if not np.linalg.norm(anchor[:2] - target.anchor) <= self._constants.off * target.size:
            return None
        points = np.insert(keypoints[:, :2].astype(np.float64), 2, 0, axis=1) if self.kind is HAND else with_depth(
            keypoints)
        scores = np.minimum(keypoints[:, 2], 1)
        score = float(np.interp(scores.mean(), [0, self._constants.half_presence, 1], [0, 0.5, 1]))
        return LandmarkObservation(points, score, 0.5, target.anchor, stamp, scores)

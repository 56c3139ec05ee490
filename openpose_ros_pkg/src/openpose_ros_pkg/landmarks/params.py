"""Parameters of hands and faces."""
from dataclasses import dataclass

from openpose_ros_pkg.params.parameters import Parameters, parameter


@dataclass(frozen=True)
class LandmarkParams(Parameters):
    """Hands and faces of the people."""

    retired = ('least_hand_size', 'least_face_size', 'hand_threshold', 'face_threshold')

    hands: bool = parameter(False, 'Find 21 points of each hand.')
    face: bool = parameter(False, 'Find 70 points of each face.')

"""Parameters of hands and faces."""
from dataclasses import dataclass

from openpose_ros_pkg.params.parameters import Parameters, parameter


@dataclass(frozen=True)
class LandmarkParams(Parameters):
    """Hands and faces of the people."""

    hands: bool = parameter(False, 'Find 21 points of each hand.')
    face: bool = parameter(False, 'Find 70 points of each face.')
    least_hand_size: float = parameter(
        20.0, 'Hands that are smaller, by the size of the body, are not looked at: of 10 to 14 px, 8 of 10 were not '
              'found.', unit='px', minimum=1.0, maximum=1000.0)
    least_face_size: float = parameter(
        24.0, 'Faces that are narrower, by the places of eyes, ears and nose, are not looked at.',
        unit='px', minimum=1.0, maximum=1000.0)
    hand_threshold: float = parameter(
        0.5, 'Hands of which the network is less sure are left out.', minimum=0.0, maximum=1.0)
    face_threshold: float = parameter(
        0.5, 'Faces of which the network is less sure are left out.', minimum=0.0, maximum=1.0)

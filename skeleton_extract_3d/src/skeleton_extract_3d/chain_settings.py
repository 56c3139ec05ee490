"""The chain by its parameters: one call for scripts and benchmarks."""
from dataclasses import dataclass
from typing import Any, Mapping

from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.following import FollowingParams
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.detect.tracking import TrackingParams
from openpose_ros_pkg.landmarks.body_landmarks import create_body_landmarks
from openpose_ros_pkg.landmarks.detector import create_landmark_detector
from openpose_ros_pkg.landmarks.records import LandmarkParams
from openpose_ros_pkg.params.parameters import build
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.settings import EstimatorSettings


@dataclass(frozen=True)
class ChainSettings:
    """The parameters of the chain; those that several of its parts have are one here."""

    detector: DetectorSettings
    tracking: TrackingParams
    following: FollowingParams
    landmarks: LandmarkParams
    estimator: EstimatorSettings


def create_chain(params: Mapping[str, Any], monocular: bool = False) -> PeopleChain:
    """Return a chain with networks of this process.

    Args:
        params: by their names in config/*.yaml, such as {'mode': 'fast', 'hands': True}; others keep their defaults.
        monocular: for images without depth, see `NoDepth`.

    Raises:
        ParameterError: an unknown name or a wrong value.
        ModelError: the weights of a network are missing.
    """
    settings = build(ChainSettings, params)
    networks, wanted = settings.detector, settings.landmarks
    detector = create_detector(networks, settings.following)
    detection = NetworkDetection(detector, settings.following)
    landmarks = None
    if wanted.hands or wanted.face:
        landmarks = create_landmark_detector(wanted, networks.backend, networks.detector.model_folder,
                                             detector.recipe.whole_body)
    bodies = create_body_landmarks(networks.backend, networks.detector.model_folder) if monocular else None
    return PeopleChain(detection, settings.estimator, landmarks, settings.tracking, bodies)

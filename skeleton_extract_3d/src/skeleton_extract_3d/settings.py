"""Parameters of the estimator."""
from dataclasses import dataclass

from openpose_ros_pkg.params.parameters import Parameters, parameter
from skeleton_extract_3d.lift.lifting import LiftingParams


@dataclass(frozen=True)
class OcclusionParams(Parameters):
    """Hidden joints."""

    retired = ('measured_min_score', 'hidden_min_score')

    occlusion: bool = parameter(
        True, 'Tell hidden joints from visible ones, and estimate them (status INFERRED). false: each joint is put on '
              'the nearest surface around its pixel and reported as MEASURED; joints without a keypoint are MISSING.')
    inference_timeout: float = parameter(
        5.0, 'A joint that had no keypoint for this long is MISSING.', unit='s', minimum=0.0, maximum=600.0)


@dataclass(frozen=True)
class IdentityParams(Parameters):
    """Identity: which person_ID a person has."""

    retired = ('track_gate', 'walking_speed', 'birth_joints')

    tracking: bool = parameter(
        True, 'Follow people from frame to frame in space. false: person_ID is that of the detection service, '
              'each frame is processed alone, without smoothing.')
    track_timeout: float = parameter(
        2.0, 'A track without a detection for this long ends. Longer bridges longer occlusions.', unit='s',
        minimum=0.0, maximum=60.0)
    return_timeout: float = parameter(
        10.0, 'A person who comes back within this time of the last detection gets the old person_ID if clothes, size '
              'and place agree, else a new one. 0: a track that ended never gets its id back.', unit='s',
        minimum=0.0, maximum=60.0)
    use_clothes: bool = parameter(True, 'Tell people apart by the colours of their clothes as well.')


@dataclass(frozen=True)
class SmoothingParams(Parameters):
    """Smoothing of joints over time."""

    retired = ('walking_acceleration',)

    smoothing: bool = parameter(
        True, 'Filter each joint (Kalman filter with constant velocity). false: positions are those of the single '
              'frames; velocities are estimated all the same.')
    acceleration: float = parameter(
        4.0, "How quickly the trunk's joints change their velocity (standard deviation per axis); elbows and knees do "
             'by 1.5, ankles by 2 and wrists by 2.5 times as much. More follows quick motions more closely and smooths '
             'less.', unit='m/s^2', minimum=0.1, maximum=100.0)


@dataclass(frozen=True)
class EstimatorSettings:
    """All parameters of the estimator."""

    lifting: LiftingParams
    occlusion: OcclusionParams
    identity: IdentityParams
    smoothing: SmoothingParams

    @property
    def needs_camera(self) -> bool:
        """Whether the points have to be those of a camera in its optical frame."""
        return self.lifting.lifting != 'mean3x3' or self.identity.tracking

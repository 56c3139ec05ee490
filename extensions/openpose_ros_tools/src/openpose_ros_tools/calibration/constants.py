"""Constants of the calibration, by step."""
from dataclasses import dataclass

from openpose_ros_pkg.params.constants import constant

_SIMULATED = 'chosen on simulated rigs'


@dataclass(frozen=True)
class EdgeConstants:
    """What two cameras tell of each other."""

    clock_search: float = constant(2.0, 'Greatest clock offset where the stamps of two recordings overlap by half or '
                                        'more; else any is searched.', unit='s', source=_SIMULATED)
    image_search: float = constant(0.5, 'The same where one camera has no depth, as each offset costs a resection.',
                                   unit='s', source=_SIMULATED)
    image_step: float = constant(0.05, 'Step of that search.', unit='s', source=_SIMULATED)
    image_times: int = constant(60, 'Times at which people are compared in it.', source=_SIMULATED)
    most_pairs: int = constant(12, 'Pairs of people that are tried for each offset.', source=_SIMULATED)
    gate: float = constant(0.02, 'A joint meets a ray at this distance, as a share of the distance from the camera.',
                           source=_SIMULATED)
    least_joints: int = constant(40, 'Joints that must meet, or two cameras have nothing in common.',
                                 source=_SIMULATED)
    least_share: float = constant(0.4, 'Share of the joints of people visible to both that must meet.',
                                  source=_SIMULATED)
    least_spread: float = constant(0.05, 'Least extent of the joints along the axis in which they spread least '
                                         '(standard deviation): a plane tells no pose.', unit='m', source=_SIMULATED)
    least_walk: float = constant(0.25, 'Least extent of the paths of people: in one place, they tell no pose.',
                                 unit='m', source=_SIMULATED)


@dataclass(frozen=True)
class GatherConstants:
    """Which joints of all cameras are adjusted together; how near people are that are one, the fusion says."""

    points: int = constant(5000, 'Joints at single times, at most.', source=_SIMULATED)
    ray_gate: float = constant(0.06, 'People of two cameras are one if their rays are nearer (median), as a share of '
                                     'the distance.', source=_SIMULATED)
    wide: float = constant(4.0, 'Factor of the gates in the first round; it halves in each further one: edges err.',
                           source=_SIMULATED)
    renewed: float = constant(0.5, 'Distance that a person has to move before a camera sees another side, so that '
                                   'keypoints err differently.', unit='m', source=_SIMULATED)


@dataclass(frozen=True)
class BundleConstants:
    """The adjustment of cameras, joints, clocks and depths."""

    position_sigma: float = constant(0.035, 'Error of a joint in space, where a recording does not tell it.', unit='m')
    depth_bias: float = constant(0.02, 'Standard deviation of the constant error of the depth of a joint, alike in all '
                                       'cameras: skin and clothes are thicker or thinner than assumed.', unit='m')
    dependent: float = constant(10.0, 'This many measurements count as one beside such prior knowledge: keypoints of a '
                                      'person err alike from frame to frame.')
    outlier: float = constant(2.0, 'Residual from which a measurement loses its weight (Cauchy).',
                              unit='standard deviations')
    clock_prior: float = constant(0.5, 'Standard deviation of a clock offset beside the one that was found first.',
                                  unit='s', source=_SIMULATED)
    rounds: int = constant(6, 'Adjustments, each with people gathered anew, at most.', source=_SIMULATED)
    settled: float = constant(0.0005, 'Adjustments end where no camera and no clock changes by more.', unit='m, s',
                              source=_SIMULATED)
    stature_error: float = constant(0.06, 'Standard deviation of the stature of an adult, as a share.',
                                    source='McDowell et al., Anthropometric reference data, 2008: 0.07 m among women '
                                           'and among men, 0.14 m between them')
    least_known: float = constant(3.0, 'Cameras whose angle is less certain are refused (standard deviation): at 3 m '
                                       'people would be 0.16 m apart, more than fusion joins.', unit='degrees')
    groups: int = constant(30, 'Groups of measurements that are left out in turn, at most, to tell how uncertain the '
                               'cameras are.', source=_SIMULATED)
    steps: int = constant(30, 'Steps of each adjustment, at most.', source=_SIMULATED)


@dataclass(frozen=True)
class FloorConstants:
    """The floor, from ankles."""

    ankle_height: float = constant(0.09, 'Height of the ankle of a foot that stands.', unit='m',
                                   source='Winter, Biomechanics and Motor Control of Human Movement, 2009, fig. 4.1, '
                                          'with the sole of a shoe')
    lift: float = constant(0.04, 'Ankles this far above the floor are of feet that do not stand.', unit='m')
    upright: float = constant(0.05, 'Standard deviation of the floor to the mean of the bodies that stand on it.',
                              unit='rad', source='chosen')
    noise: float = constant(0.03, 'Error of an ankle, which people share.', unit='m')


@dataclass(frozen=True)
class CalibrationConstants:
    """All constants of the calibration."""

    edges: EdgeConstants = EdgeConstants()
    gather: GatherConstants = GatherConstants()
    bundle: BundleConstants = BundleConstants()
    floor: FloorConstants = FloorConstants()


CALIBRATION = CalibrationConstants()

"""Numbers of the fusion, by step."""
from dataclasses import dataclass
from typing import Tuple

from openpose_ros_pkg.params.constants import constant

# A joint without its side, and four lengths [m].
KeypointOffsets = Tuple[Tuple[str, float, float, float, float], ...]


@dataclass(frozen=True)
class AssociationConstants:
    """Which person of a camera is which fused person."""

    gate: float = constant(0.35, 'Greatest median distance of the joints, or of their rays.', unit='m')
    ray_gate: float = constant(0.07, 'Greatest distance between the rays of two cameras to three of four joints of '
                                     'somebody.', unit='m')
    gate_growth: float = constant(1.0, 'It grows by this with the time between what is known of somebody and a '
                                       'sighting.', unit='m/s')
    most_gate: float = constant(0.8, 'It grows up to this.', unit='m')
    known_share: float = constant(0.7, 'The distance to the person who had this id of the camera before counts this '
                                       'much: ids of a camera are mostly right.')
    least_joints: int = constant(4, 'Joints that have to be common to compare two people.')
    most_late: float = constant(0.3, 'Sightings that are older, beside the newest one, begin nobody: where people were '
                                     'is not known well enough to tell who is new.', unit='s')
    same_place: float = constant(0.15, 'Two fused people nearer than this (median of the joints) are one.', unit='m')


@dataclass(frozen=True)
class EstimateConstants:
    """One position of a joint out of several cameras."""

    along: float = constant(1.0, 'Error along the line of sight, as a share of the sigma of the joint per axis.')
    across: float = constant(1.0, 'Error across it, in the same unit.')
    outlier: float = constant(1.0, 'Distance from the estimate at which a measurement has half of its weight (Cauchy).',
                              unit='standard deviations')
    usual: float = constant(
        1.5, 'Measurements nearer to the estimate count in full in sigma: cameras that agree as well as they say make '
             'nothing less certain.', unit='standard deviations',
        source='simulated errors of 20 and 60 mm, 5 to 60 Hz')
    rounds: int = constant(5, 'Rounds of reweighting.')
    inferred: float = constant(2.0, 'Factor of the sigma of INFERRED joints beside measured ones: what a camera infers '
                                    'comes from the joints that others see too.')
    least_sigma: float = constant(0.003, 'No camera measures a joint better, per axis.', unit='m')
    unknown_sigma: float = constant(0.05, 'Sigma per axis of a joint whose message tells none: 0, negative or NaN.',
                                    unit='m')
    pixel_sigma: float = constant(4.0, 'Error of a keypoint in the image per axis, for rays.', unit='px')
    size_error: float = constant(0.05, 'Error of the distance of somebody whom one camera sees, and without depth, by '
                                       'the size in the image, as a share of it.')
    common_sigma: float = constant(
        0.012, 'Error that all cameras have in common, per axis: keypoints lie beside the joints alike in all views.',
        unit='m')


@dataclass(frozen=True)
class ShapeConstants:
    """What is known of bodies beside what cameras measure."""

    keypoints: KeypointOffsets = constant(
        (('nose', 0.000, 0.005, 0.002, -0.003), ('eye', -0.001, 0.002, 0.002, 0.002),
         ('ear', -0.003, 0.000, -0.001, 0.003), ('neck', 0.000, 0.007, -0.006, 0.008),
         ('shoulder', 0.000, 0.007, -0.002, 0.011), ('elbow', 0.001, 0.002, -0.001, 0.007),
         ('wrist', 0.001, 0.002, 0.001, 0.004), ('hip', 0.002, 0.013, -0.001, 0.013),
         ('knee', -0.003, -0.004, 0.003, 0.016), ('ankle', 0.002, -0.007, -0.001, 0.007)),
        'Where a camera measures a joint, from its centre: outwards, up and forwards of the body, and further along '
        'the line of sight.', unit='m',
        source='robust least squares over ten rendered sequences of single cameras, 26 people; ridge chosen by leaving '
               'out one sequence after the other')
    least_width: float = constant(0.05, 'Shoulders that are closer together, across the trunk, tell no direction.',
                                  unit='m', source='chosen')
    size_gain: float = constant(0.2, 'Share by which the size of somebody whom one camera alone sees, without depth, '
                                     'is corrected at each update.', source='chosen: 0 drifts, 1 is noisy')


@dataclass(frozen=True)
class MotionConstants:
    """How people move between the frames."""

    acceleration: float = constant(25.0, 'Standard deviation of the acceleration of a joint per axis.', unit='m/s^2')
    first_speed: float = constant(1.0, 'Standard deviation of the speed of a new joint per axis.', unit='m/s')
    swing: float = constant(0.3, 'Time in which the motion of a joint beside that of its body fades (1 / e).', unit='s')
    most_gap: float = constant(1.0, 'Somebody who is not seen by any camera for longer is forgotten.', unit='s')
    reported_gap: float = constant(0.2, 'Somebody is reported where expected, while not seen for less.', unit='s')
    confirmed: float = constant(0.15, 'Somebody whom one camera alone sees is reported once seen for this time.',
                                unit='s')


@dataclass(frozen=True)
class CollectorConstants:
    """Which messages of the cameras make one update."""

    near: float = constant(0.5, 'Messages whose stamps are this share of the shortest period apart belong together.')
    most_near: float = constant(0.04, 'The same in seconds, at most: people move in between.', unit='s')
    least_wait: float = constant(0.05, 'A camera that is never later than the others is waited for by this.', unit='s')
    delay_factor: float = constant(1.5, 'A camera is waited for by its usual delay and longer by this factor.')
    fading: float = constant(0.95, 'From message to message, what is remembered of the greatest delay of a camera.')
    silent: float = constant(1.0, 'Nothing is expected of a camera that sent nothing for longer, or for longer than it '
                                  'usually pauses.', unit='s')
    reset: float = constant(1.0, 'Stamps that are further from those of the others are out of time; when no others '
                                 'came for as long, all begins anew.', unit='s')
    growth: float = constant(1.1, 'From step to step, the period of a camera grows by this factor at most: lost '
                                  'messages lengthen a step.')


@dataclass(frozen=True)
class CameraConstants:
    """What a camera is like, beside the others."""

    memory: float = constant(3.0, 'Time over which its error and its clock are judged.', unit='s')
    wrong: float = constant(0.06, 'Cameras whose people are further apart (mean over the joints) disagree.', unit='m')
    least_joints: int = constant(100, 'Joints that two cameras must have measured in that time to be compared.')
    outlier: float = constant(0.3, 'Joints that are further apart are not compared: one of them is somewhere else.',
                              unit='m')
    clock_error: float = constant(0.015, 'A clock offset is reported once its standard deviation is below.', unit='s')
    silent: float = constant(1.0, 'A camera that sent nothing for longer is reported.', unit='s')


@dataclass(frozen=True)
class WayConstants:
    """Who is one person at two places, by how they move: cameras that have nobody in common."""

    memory: float = constant(3.0, 'Time over which ways are compared.', unit='s')
    period: float = constant(0.2, 'Between the times at which they are.', unit='s')
    least_time: float = constant(2.0, 'Two people are compared who were both seen for this long.', unit='s')
    least_joints: int = constant(100, 'Joints that both cameras must have measured in that time.')
    least_walk: float = constant(0.25, 'Least extent of the way of a body (standard deviation): those who stand all '
                                       'look alike.', unit='m')
    gate: float = constant(0.07, 'Distance of the joints after the rigid motion (median): limbs of different people '
                                 'swing at different times.', unit='m')
    most_apart: float = constant(1.5, 'Joints further apart (median) are of different people.', unit='m')
    most_turned: float = constant(0.5, 'Cameras that would have to be turned by more see different people.', unit='rad')


@dataclass(frozen=True)
class FusionConstants:
    """All numbers of the fusion."""

    association: AssociationConstants = AssociationConstants()
    estimate: EstimateConstants = EstimateConstants()
    shape: ShapeConstants = ShapeConstants()
    motion: MotionConstants = MotionConstants()
    collector: CollectorConstants = CollectorConstants()
    cameras: CameraConstants = CameraConstants()
    ways: WayConstants = WayConstants()


FUSION = FusionConstants()

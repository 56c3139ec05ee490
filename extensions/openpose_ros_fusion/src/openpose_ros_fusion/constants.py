"""Numbers of the fusion, by step."""
from dataclasses import dataclass
from typing import Tuple

from openpose_ros_pkg.params.constants import constant

# A joint without its side, and four lengths [m].
KeypointOffsetRows = Tuple[Tuple[str, float, float, float, float], ...]


@dataclass(frozen=True)
class AssociationConstants:
    """Which person of a camera is which track."""

    gate: float = constant(0.35, 'Greatest median distance of the joints, or of their rays, from where a track is '
                                 'expected.', unit='m')
    same_place: float = constant(
        0.12, 'People are one whose rays, to `ray_share` of the joints, pass by each other nearer than this in the '
              'mean over the cameras; tracks are one whose joints are nearer than this (median).', unit='m',
        source='MVOR, real people 2.6 m away, found by OpenPose: of the detections of one person in two cameras, and '
               'of different people, 77 % and 2 % are nearer than 0.10 m, 90 % and 7 % nearer than 0.15 m')
    least_joints: int = constant(4, 'Joints that have to be common to compare two people, or to place one.')
    ray_share: float = constant(0.75, 'Share of the joints whose rays have to meet.')


@dataclass(frozen=True)
class EstimateConstants:
    """One position of a joint out of several cameras."""

    outlier: float = constant(
        1.5, 'Distance from the estimate at which a measurement has half of its weight (Cauchy). Nearer ones count in '
             'full in sigma: cameras that agree as well as they say make nothing less certain.',
        unit='standard deviations')
    rounds: int = constant(5, 'Rounds of reweighting.')
    least_information: float = constant(1.0, 'Mean information over the axes without which a joint has no position.',
                                        unit='1/m^2')
    unknown_sigma: float = constant(0.05, 'Sigma per axis of a joint whose message tells none: 0, negative or NaN.',
                                    unit='m')
    pixel_sigma: float = constant(4.0, 'Error of a keypoint in the image per axis, for rays.', unit='px')
    common_sigma: float = constant(
        0.012, 'Error that all cameras have in common, per axis: keypoints lie beside the joints alike in all views. '
               'No camera measures a joint better.', unit='m')


@dataclass(frozen=True)
class ShapeConstants:
    """How keypoints lie beside joints."""

    keypoints: KeypointOffsetRows = constant(
        (('nose', 0.000, 0.005, 0.002, -0.003), ('eye', -0.001, 0.002, 0.002, 0.002),
         ('ear', -0.003, 0.000, -0.001, 0.003), ('neck', 0.000, 0.007, -0.006, 0.008),
         ('shoulder', 0.000, 0.007, -0.002, 0.011), ('elbow', 0.001, 0.002, -0.001, 0.007),
         ('wrist', 0.001, 0.002, 0.001, 0.004), ('hip', 0.002, 0.013, -0.001, 0.013),
         ('knee', -0.003, -0.004, 0.003, 0.016), ('ankle', 0.002, -0.007, -0.001, 0.007)),
        'Where a camera measures a joint, from its centre: outwards, up and forwards of the body, and further along '
        'the line of sight.', unit='m',
        source='robust least squares over ten rendered sequences of single cameras, 26 people; ridge chosen by leaving '
               'out one sequence after the other')


@dataclass(frozen=True)
class SingleViewConstants:
    """People that one camera alone sees, and without depth."""

    size_gain: float = constant(0.2, 'Share by which the size of the person is corrected at each update.',
                                source='chosen: 0 drifts, 1 is noisy')
    least_joints: int = constant(6, 'Joints by which the size in the image places a person: the five of a face are too '
                                    'near to each other.', source='simulated: with five the distance errs by a third')
    size_error: float = constant(0.05, 'Error of the distance by the size in the image, as a share of it.')


@dataclass(frozen=True)
class MotionConstants:
    """How people move between the frames."""

    acceleration: float = constant(25.0, 'Standard deviation of the acceleration of a joint per axis.', unit='m/s^2')
    swing: float = constant(0.3, 'Time in which the motion of a joint beside that of its body fades (1 / e).', unit='s')
    most_gap: float = constant(1.0, 'A track that no camera sees for longer ends.', unit='s')
    reported_gap: float = constant(
        0.2, 'A track is reported where predicted, while not seen for less. A person that one camera alone sees is '
             'reported once seen for this time, and people of messages that are older begin no track.', unit='s')


@dataclass(frozen=True)
class CollectorConstants:
    """Which messages of the cameras make one update."""

    patience: float = constant(
        0.5, 'People of one camera wait for those of the others that belong to the same time as long as these usually '
             'take, and at most for this long.', unit='s')
    near: float = constant(0.5, 'Messages whose stamps are this share of the shortest period apart make one update.')
    most_near: float = constant(0.04, 'The same in seconds, at most: people move in between.', unit='s')
    least_wait: float = constant(0.05, 'Wait for a camera beyond its usual delay.', unit='s')
    fading: float = constant(0.95, 'Factor by which the remembered greatest delay of a camera fades with each message.')
    silent: float = constant(
        1.0, 'No message is expected of a camera that sent none for longer, or for longer than it usually pauses. '
             'Stamps that are further from those of the others are out of time; when no others came for as long, the '
             'collector starts anew.', unit='s')
    growth: float = constant(1.1, 'The period of a camera grows by this factor per message at most: lost messages '
                                  'lengthen a step.')


@dataclass(frozen=True)
class CameraConstants:
    """How a camera agrees with the others."""

    memory: float = constant(3.0, 'Time over which the error and the clock of a camera are judged.', unit='s')
    wrong: float = constant(0.06, 'Cameras whose people are further apart (mean over the joints) disagree.', unit='m')
    least_joints: int = constant(100, 'Joints that two cameras must have measured in that time to be compared.')
    outlier: float = constant(0.3, 'Joints that are further apart are not compared: one of them is elsewhere.',
                              unit='m')
    clock_error: float = constant(0.015, 'A clock offset is reported once its standard deviation is below.', unit='s')


@dataclass(frozen=True)
class FusionConstants:
    """All numbers of the fusion."""

    association: AssociationConstants = AssociationConstants()
    estimate: EstimateConstants = EstimateConstants()
    shape: ShapeConstants = ShapeConstants()
    single_view: SingleViewConstants = SingleViewConstants()
    motion: MotionConstants = MotionConstants()
    collector: CollectorConstants = CollectorConstants()
    cameras: CameraConstants = CameraConstants()


FUSION = FusionConstants()

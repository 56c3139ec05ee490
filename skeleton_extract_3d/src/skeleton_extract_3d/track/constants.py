"""Constants of tracking, step by step."""
from dataclasses import dataclass
from typing import Tuple

import numpy as np

from openpose_ros_pkg.params.constants import constant
from skeleton_extract_3d.body.body import ENDS, HEAD, HIPS, JOINTS, MIDDLES, NECK, SHOULDERS

# Errors of joints at rest of which nothing is known but the parent, (18,) [m].
_REST_SIGMAS = np.zeros(len(JOINTS))
_REST_SIGMAS[NECK] = _REST_SIGMAS[SHOULDERS] = _REST_SIGMAS[HEAD] = 0.10
_REST_SIGMAS[HIPS], _REST_SIGMAS[MIDDLES], _REST_SIGMAS[ENDS] = (
    0.14, (0.15, 0.15, 0.16, 0.16), (0.26, 0.26, 0.24, 0.24))

_TUNE = '46 rendered scenes, modes fast and balanced, in full and followed; trials.md'


@dataclass(frozen=True)
class IdentityConstants:
    """Gates and costs of data association."""

    gate: float = constant(
        0.5, 'Greatest median distance, across the view, of the joints of a person from where they are expected.',
        unit='m')
    walking_speed: float = constant(
        1.2, 'The gate grows by this for each second without a detection ...', unit='m/s')
    other_clothes: float = constant(
        -10.0, '... unless the log likelihood ratio of the same clothes is lower: others mostly have -20 to -50, those '
               'of a person who is partly hidden or cut off at the border of the image -5 and more.',
        source='the demo in virtual time; trials.md')
    birth_joints: int = constant(
        3, 'Joints that have to be measured before a person gets a person_ID; fewer if no more can be measured.')
    evidence_cost: float = constant(
        0.2, 'Distance across the view that costs as much as a log likelihood ratio of another depth of 1.', unit='m')
    colour_cost: float = constant(
        0.003, 'The same for a difference of the clothes of 1: other colours may be of what covers the person.',
        unit='m per Delta E (CIE 1976)')
    gap: float = constant(
        0.2, 'After a longer time without a detection joints without a keypoint move with the others, '
             'and a new person may be the track; one whose clothes are hidden waits for an id for so long.', unit='s')
    plain: int = constant(9, 'A new person with as many measured joints gets an id at once.', unit='joints')
    most_evidence: float = constant(20.0, 'Greatest log likelihood of another depth of the same person.')
    own_crop: float = constant(0.05, 'A person costs this less for the track on whose crop it was seen.', unit='m')
    same_place: float = constant(
        0.25, 'Keypoints nearer to where they are expected are not refused for their depth: most surfaces of '
              'a person who is almost hidden are those of another one. New people nearer to a track, and parts of '
              'people nearer to each other, are the same person (median of joints).', unit='m')


@dataclass(frozen=True)
class AppearanceConstants:
    """How the colours of clothes are measured and compared."""

    same_colour: np.ndarray = constant(
        np.array([8.0, 4.0, 5.0]), 'Standard deviation of the colour of the same clothes in another light and pose: '
                                   'mostly of lightness.', unit='CIELAB', source='12 rendered people, over 0.7 s')
    mean_colour: np.ndarray = constant(
        np.array([[35.0, 4.0, 0.0], [24.0, 2.0, -2.0]]), "Mean colour of people's clothes, upper and lower part.",
        unit='CIELAB', source='35 people of COCO pictures, rounded')
    strange_colour: np.ndarray = constant(
        np.array([[22.0, 9.0, 13.0], [18.0, 5.0, 8.0]]), 'Standard deviation of these.', unit='CIELAB',
        source='the same')
    most_evidence: float = constant(
        4.0, 'Greatest log likelihood of the same person by one part: one person in 50 wears the same.',
        source='chosen')


@dataclass(frozen=True)
class ExpectationConstants:
    """Errors of predicted tracks."""

    depth_sigma: float = constant(0.06, 'Error of an expected depth beyond that of the filter.', unit='m')
    depth_factor: float = constant(1.5, 'Factor of the error of an expected depth.')
    turning_frames: float = constant(2.0, 'Weight of the direction that people faced before.', unit='frames')


@dataclass(frozen=True)
class CorrectionConstants:
    """Errors of the joints of a frame, and of estimates by their innovations."""

    measured_score: float = constant(
        0.2, 'A keypoint with a lower score is not used, even where the surface fits it.')
    hidden_score: float = constant(
        0.4, 'The keypoint of a hidden joint is used if its score is at least this; joints with lower ones are '
             'estimated by the body model and the motion.')
    across: float = constant(0.013, 'Error of a keypoint across the view, at full score.', unit='m')
    across_by_score: float = constant(0.11, 'Growth of this error, times (1 - score) squared.', unit='m')
    along: float = constant(
        0.024, 'Error along the ray of a measured surface and its offset, least one of an inferred depth.', unit='m')
    root_measured: float = constant(0.03, 'Error per axis of the middle of a trunk of which most corners are measured.',
                                    unit='m')
    measured_reach: float = constant(
        0.12, 'A smoothed joint further from where the frame has it counts as inferred.', unit='m')
    down_share: float = constant(0.2, "Weight of a frame in the trunk's direction downwards.", unit='share')
    trusted_deviations: float = constant(
        4.0, 'A measurement further off gets a covariance that puts it there: jumps are followed within frames, but '
             'one wild measurement does not throw the joint.', unit='standard deviations')
    memory: float = constant(0.5, 'Time over which the innovations of a person are averaged.', unit='s',
                             source='simulated errors of 20 and 60 mm, 5 to 60 Hz: with 1 s slower to know, no better')
    repeated: float = constant(
        0.25, 'Errors repeat in full where the mean square of innovations is this share, or less, of what independent '
              'errors make.', source='as `memory`')


@dataclass(frozen=True)
class CompletionConstants:
    """Joints without a keypoint, and their errors."""

    sigma_at_once: float = constant(
        0.04, "Error of a joint that loses its keypoint, beyond its parent's, and of those of hidden people.", unit='m')
    sigma_growth: float = constant(0.35, 'Growth of this error, and of that of hidden people.', unit='m/s')
    rest_sigmas: np.ndarray = constant(
        _REST_SIGMAS, 'Greatest error, that of a joint which was never seen, in the order of COCO_18.', unit='m')
    rest_time: float = constant(
        0.7, 'Limbs without a keypoint hang straight down within about this time.', unit='s')
    speed: float = constant(0.5, 'Standard deviation per axis of the velocity of what is not seen.', unit='m/s')


@dataclass(frozen=True)
class OutOfSightConstants:
    """Motion of tracks without a detection."""

    greatest_speed: float = constant(2.0, 'They walk at most this fast, also while absent.', unit='m/s')
    stopping_time: float = constant(1.0, 'Hidden people stop within about this time.', unit='s')
    speed_error: float = constant(0.5, 'Error of their speed: they may stop, or turn round, at once.', unit='share')


@dataclass(frozen=True)
class ExistenceIn3DConstants:
    """What the points tell of the existence of people."""

    lasting: float = constant(
        4.0, 'Time in which the probability of a person who is not looked at falls to 1/e, as a multiple of '
             '`track_timeout`.')
    reach: float = constant(0.5, 'A look at a person shows this far to both sides of where it is expected.', unit='m')
    flat: float = constant(0.03, 'People who stand out by less from a plane around them are pictures.', unit='m')
    flat_body: float = constant(
        0.004, 'So are people whose joints lie in one plane, by their median distance from it: 1 % of the frames of '
               'real people, 85 % of those of pictures (time of flight, 4 m).', unit='m')
    flat_joints: int = constant(6, 'Joints that are needed to tell.')
    body_joints: int = constant(5, 'A body has so many measured joints, unless fewer have a surface.')
    against_few: float = constant(
        -2.0, 'Log likelihood ratio of a detection with fewer, beside its score: 2 % of those of people, 11 of 13 of '
              'those in furniture.')
    against_flat: float = constant(-3.0, 'Log likelihood ratio of a detection that is one, or that is too small.')
    around: float = constant(0.3, 'Distance from the joints at which the surroundings are looked at, and 1.5 times as '
                                  'far.', unit='m')
    plane_spread: float = constant(0.02, 'Median distance from their plane up to which surroundings are a plane.',
                                   unit='m')
    noise: float = constant(0.004, 'Noise of depths, times the depth squared.', unit='m per m^2')
    least_points: int = constant(6, 'Points of the person, and of the surroundings, that are needed.')


@dataclass(frozen=True)
class OneBodyConstants:
    """People who fill the same space, and the time that they may."""

    thickness: float = constant(
        0.16, 'People whose joints are nearer (median) are in one place: less than the thickness of a trunk, which '
              'the joints of two people are apart where they touch.', unit='m')
    least_joints: int = constant(3, 'Joints that both must have for that.', unit='joints')
    sure: float = constant(
        0.9, 'People who exist with a lower probability are the same person up to `IdentityConstants.same_place`.')


@dataclass(frozen=True)
class ReturningConstants:
    """Reidentification of people who had a track a short time ago."""

    strange_size: float = constant(
        0.2, 'Standard deviation of the sizes of people, children included.', unit='share', source='chosen')
    spread: float = constant(
        1.5, 'Error per axis of the predicted place of a track that was lost: people come back by where they left.',
        unit='m')
    most_gone: int = constant(32, 'Ended tracks that may be reidentified, the newest ones.')
    least_evidence: float = constant(2.3, 'Least log likelihood ratio of a track to a person without one, and to every '
                                          'other absent track and new person (10:1).')


@dataclass(frozen=True)
class StandingConstants:
    """Contact of feet with the floor, where it is known."""

    ankle_height: float = constant(
        0.11, 'Height of the ankles of a standing adult, in shoes, above the floor.', unit='m',
        source='rendered, dressed bodies with known joints, rounded')
    straight: float = constant(
        0.95, 'A person stands if the hip is higher above the ankles than this.', unit='share of the length of the leg')
    reach: float = constant(0.25, 'Ankles are moved by at most this in height.', unit='m')
    least_fall: float = constant(0.3, 'Rays fall by at least this to where a height tells a depth.', unit='m')


@dataclass(frozen=True)
class SidesConstants:
    """Left and right of people, see `track.sides`."""

    ahead: Tuple[float, float] = constant(
        (0.25, 0.75), 'People whose hands are both nearer to the camera than the trunk by this face it: arms reach '
                      '0.2 m backwards, and no further than this.', unit='m')
    back: float = constant(0.7, 'A back that is seen has this share of its breadth and length in the image.',
                           unit='share')
    apart: float = constant(0.1, 'Left and right are exchanged if joints are further from where they are expected '
                                 '(mean) ...', unit='m')
    nearer: float = constant(0.5, '... and nearer, by this factor, to where those of the other side are.', unit='share')
    gap: float = constant(0.25, 'People turn round within a longer time without a detection.', unit='s')
    hold: float = constant(0.5, 'Most trust in the sides of a track: opposite ones for longer are believed.', unit='s')
    face: float = constant(0.7, 'So are they at once with a nose of a higher score.')
    fading: float = constant(0.1, 'Time in which trust falls to 1/e while neither sides are clear.', unit='s')


# Kinds of joints whose errors are alike.
SIGMA_JOINTS = ('head', 'neck', 'shoulder', 'hip', 'elbow', 'knee', 'wrist', 'ankle', 'toe', 'heel')


@dataclass(frozen=True, eq=False)
class SigmaConstants:
    """Calibration of sigma, see `track.calibration`: fitted by `./run bench calibration`."""

    knots: np.ndarray = constant(
        np.array([[0.03, 0.045, 0.07, 0.12, 0.25], [0.0, 0.25, 0.5, 0.75, 1.0], [2.0, 3.0, 4.0, 5.0, 6.5]]),
        "Values of the evidence: stated sigma [m], share of the person's joints that are MEASURED, distance [m].",
        source='chosen')
    joints: np.ndarray = constant(
        np.array([[0.01, 0.08, 0.14, 0.17, -0.04, -0.03, 0.08, -0.07, 0.25, 0.28],
                  [-0.18, -0.32, -0.09, -0.17, 0.15, 0.11, 0.32, 0.16, 0.17, 0.14]]),
        'Logarithm of the change of MEASURED and of INFERRED joints, in the order of `SIGMA_JOINTS`.', source=_TUNE)
    evidence: np.ndarray = constant(
        np.array([[[0.0, 0.22, 0.77, 0.81, 0.81], [0.0, 0.29, 0.67, 0.69, 0.22]],
                  [[0.0, 0.0, 0.0, -0.26, -0.54], [0.0, -0.1, -0.35, -0.62, -1.11]],
                  [[0.0, 0.12, 0.33, 0.33, 0.51], [0.0, 0.28, 0.28, 0.29, 0.39]]]),
        'The same by each evidence, at its knots.', source=_TUNE)


@dataclass(frozen=True)
class TrackConstants:
    """All of them."""

    birth_sigma: float = constant(
        0.15, "Standard deviation per axis of the joints and of the trunk's middle of a new track; later on of the "
              'middle of a trunk of which few corners are measured.', unit='m')
    birth_speed: float = constant(1.0, 'The same of both velocities, and of a joint that is seen for the first time.',
                                  unit='m/s')
    identity: IdentityConstants = IdentityConstants()
    appearance: AppearanceConstants = AppearanceConstants()
    expectation: ExpectationConstants = ExpectationConstants()
    correction: CorrectionConstants = CorrectionConstants()
    completion: CompletionConstants = CompletionConstants()
    out_of_sight: OutOfSightConstants = OutOfSightConstants()
    existence: ExistenceIn3DConstants = ExistenceIn3DConstants()
    one_body: OneBodyConstants = OneBodyConstants()
    returning: ReturningConstants = ReturningConstants()
    standing: StandingConstants = StandingConstants()
    sides: SidesConstants = SidesConstants()
    sigma: SigmaConstants = SigmaConstants()

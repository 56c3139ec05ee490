"""Thresholds of the definitions. Lengths are shares of the stature, so that they hold for children too.

A condition holds by a degree, which a `Ramp` tells: 0 at its first value, 1 at its second, linear between. A definition
holds as far as the least of its conditions.
"""
from dataclasses import dataclass
from typing import Tuple

from openpose_ros_pkg.params.constants import constant
from skeleton_extract_3d.body.body import BODY, BodyConstants

Ramp = Tuple[float, float]


@dataclass(frozen=True)
class HoldConstants:
    """When something is reported, by how far and how long its definition holds."""

    sure: float = constant(0.6, 'It begins with this degree.')
    unsure: float = constant(0.4, 'It ends below this degree.')
    time: float = constant(0.1, 'It begins when it has held for this long, and ends when it has not as long.', unit='s')
    hidden: float = constant(0.4, 'What holds goes on for this long while its joints are hidden.', unit='s')


@dataclass(frozen=True)
class PersonConstants:
    """Which joints count as known, and for how long what a person did counts."""

    most_sigma: float = constant(0.09, 'Joints with a greater sigma count as hidden.', unit='statures')
    sure_sigma: float = constant(0.05, 'Motions to and fro, and knees on the floor, are told by joints with a lesser '
                                        'sigma: those that are guessed swing, and bend.', unit='statures')
    inferred_share: float = constant(
        0.4, 'Errors of joints of a person without a measured one are mostly along the view, where few signals are '
             'told: they count by this share.', source='rendered scenes with labels, by one camera without depth')
    statures: int = constant(100, 'The stature is the median of this many newest frames.', unit='frames')
    least_stature: float = constant(0.4, 'Stature estimates below this are ignored.', unit='m')
    gap: float = constant(1.0, 'A person that was not seen for longer begins anew.', unit='s')


@dataclass(frozen=True)
class PostureConstants:
    """Postures, by the inclinations of trunk, thighs and shins."""

    upright: Ramp = constant((68.0, 55.0), 'Angle of the trunk to straight up; a person that is not upright may lie.',
                             unit='deg')
    level_thigh: Ramp = constant((40.0, 60.0), 'Angle of a thigh to straight down, sitting or lying; else the person '
                                               'stands, or kneels.', unit='deg')
    bent_knee: Ramp = constant((130.0, 110.0), 'Angle of the knee, kneeling or crouching; straighter, standing.',
                               unit='deg')
    level_shin: Ramp = constant((50.0, 70.0), 'Angle of the shin to straight down, of a knee on the floor.', unit='deg')
    low_hips: Ramp = constant((0.25, 0.20), 'Height of the hips over the lower foot, crouching.', unit='statures')
    balance: Ramp = constant((0.2, 0.14), 'Level distance of the trunk from the feet, crouching.', unit='statures')


@dataclass(frozen=True)
class GestureConstants:
    """Gestures of an arm that is held, and of both."""

    held_time: float = constant(0.1, 'An arm is held if its wrist moved little for this long.', unit='s')
    held: Ramp = constant((0.045, 0.03), 'Way of the wrist, beside the shoulder, in this time.', unit='statures')
    over_eyes: Ramp = constant((0.01, 0.04), 'Height of the wrist over the eyes, of a raised hand.', unit='statures')
    steep_arm: Ramp = constant((138.0, 146.0), 'Angle of the line from shoulder to wrist to straight down, of a '
                                               'raised hand; less steep, it points.', unit='deg')
    open_elbow: Ramp = constant((70.0, 90.0), 'Angle of the elbow, hand raised; less: hand on the head.', unit='deg')
    straight_arm: Ramp = constant((125.0, 145.0), 'Angle of the elbow, pointing.', unit='deg')
    arm_away: Ramp = constant((34.0, 46.0), 'Angle of shoulder to wrist to straight down, pointing.', unit='deg')
    over_hips: Ramp = constant((-0.06, 0.0), 'Height of the wrist over the hips, pointing; lower, the person '
                                             'reaches down.', unit='statures')
    off_face: Ramp = constant((0.12, 0.16), 'Distance of the wrist from the nose; nearer, the hand is at the head.',
                              unit='statures')
    hand_up: Ramp = constant((-0.04, 0.01), 'Height of the wrist over the shoulder, stop or wave.', unit='statures')
    forearm_up: Ramp = constant((70.0, 57.0), 'Angle of the forearm to straight up, stop or wave.', unit='deg')
    stop_time: float = constant(0.3, 'A hand says stop if it is held for this long.', unit='s')
    stop_ahead: Ramp = constant((0.15, 0.19), 'How far the wrist is before the shoulder, stop.', unit='statures')
    palm: Ramp = constant((50.0, 38.0), 'Angle of the palm to the line from shoulder to hand, and of the fingers to '
                                        'straight up, where hands are seen.', unit='deg')
    cross_time: float = constant(0.3, 'Crossed arms begin after this time, sooner the more they are if both are sure.',
                                 unit='s')
    crossed: Ramp = constant((0.09, 0.06), 'How far the left wrist is left of the right one; negative when crossed.',
                             unit='statures')
    inward: Ramp = constant((0.58, 0.70), 'Share of each forearm that points to the other side.')
    chest_height: Ramp = constant((0.24, 0.20), 'Height of the shoulders over each wrist.', unit='statures')


@dataclass(frozen=True)
class SwingConstants:
    """Waving."""

    pause: float = constant(0.6, 'Longest time from turn to turn; twice as long joints are remembered.', unit='s')
    smooth: float = constant(0.05, 'A position is the mean of those at most this much earlier or later.', unit='s')
    wave: Ramp = constant((0.04, 0.06), 'Way of the wrist to the side between two turns, waving: the longer of the '
                                        'last two; the shorter may be half, as it is under way.', unit='statures')
    wave_level: float = constant(1.5, 'They are this many times the way up or forwards.')


@dataclass(frozen=True)
class PointingConstants:
    """The ray of a pointing arm."""

    aim: float = constant(4.0, 'Root mean square angle by which people miss along their own line.', unit='deg',
                          source='Bangerter and Oppenheimer 2006: about 3 deg level and 3 deg upright')
    cone: float = constant(2.0, 'Known targets within this many sigma of the ray are pointed at.', unit='sigma')


@dataclass(frozen=True)
class MotionConstants:
    """Walking and falling."""

    time: float = constant(0.4, 'A speed is that over this time.', unit='s')
    least_time: float = constant(0.2, 'Or over at least this time, for a person that has just come.', unit='s')
    moving: Ramp = constant((0.10, 0.22), 'Speed over the floor, walking.', unit='statures/s')
    fall_time: float = constant(2.5, 'A fall takes at most this long; slower, the person lay down.', unit='s')
    fall_height: float = constant(0.33, 'The shoulders come down by this in a fall. Lying back from sitting on the '
                                        'floor is less.', unit='statures')
    fall_begin: float = constant(0.15, 'A fall has begun when this share of the way is done.')
    fall_speed: float = constant(0.75, 'Least greatest speed of the shoulders in a fall: 1.3 m/s of an adult.',
                                 unit='statures/s')


@dataclass(frozen=True)
class FloorConstants:
    """Where on the floor a person is."""

    lying: float = constant(0.07, 'Height of the middle of the trunk over the floor, lying.', unit='statures')
    most_rise: float = constant(60.0, 'A body that faces more steeply up or down than this has no direction on the '
                                      'floor.', unit='deg')


@dataclass(frozen=True)
class SignalConstants:
    """All constants of the signals."""

    hold: HoldConstants = HoldConstants()
    person: PersonConstants = PersonConstants()
    posture: PostureConstants = PostureConstants()
    gesture: GestureConstants = GestureConstants()
    swing: SwingConstants = SwingConstants()
    pointing: PointingConstants = PointingConstants()
    motion: MotionConstants = MotionConstants()
    floor: FloorConstants = FloorConstants()
    body: BodyConstants = BODY


SIGNALS = SignalConstants()

"""Thresholds of the definitions. Lengths are shares of the stature, so that they hold for children too."""
from dataclasses import dataclass
from typing import Tuple

from openpose_ros_pkg.params.constants import constant

# (0 at the first value, 1 at the second): how far a condition holds between two values.
Ramp = Tuple[float, float]


@dataclass(frozen=True)
class TimeConstants:
    """How long something has to hold."""

    begin: float = constant(0.15, 'A gesture is reported when it has held for this long.', unit='s')
    end: float = constant(0.25, 'It ends when it has not held for this long.', unit='s')
    posture: float = constant(0.25, 'A posture is reported when it has held for this long.', unit='s')
    sure: float = constant(0.6, 'Degree to which the conditions of a definition have to hold to begin.')
    unsure: float = constant(0.4, 'Below, it ends.')
    memory: float = constant(1.2, 'Motions are looked for in the joints of this time.', unit='s')
    gap: float = constant(0.5, 'After a gap of more between two frames a person begins anew.', unit='s')


@dataclass(frozen=True)
class PostureConstants:
    """Postures, by the inclinations of trunk, thighs and shins."""

    lying: Ramp = constant((50.0, 65.0), 'Inclination of the trunk.', unit='deg')
    upright: Ramp = constant((65.0, 50.0), 'Inclination of the trunk of who sits, stands, kneels or crouches.',
                             unit='deg')
    thigh_down: Ramp = constant((60.0, 40.0), 'Angle of a thigh to straight down, of who stands.', unit='deg')
    straight_knee: Ramp = constant((110.0, 135.0), 'Angle of the knee of who stands.', unit='deg')
    thigh_level: Ramp = constant((40.0, 60.0), 'Angle of a thigh to straight down, of who sits.', unit='deg')
    shin_level: Ramp = constant((50.0, 70.0), 'Angle of a shin to straight down, of who kneels.', unit='deg')
    bent_knee: Ramp = constant((125.0, 110.0), 'Angle of the knee of who kneels or crouches.', unit='deg')
    hip_to_ankle: Ramp = constant((0.34, 0.28), 'Distance of hip and ankle of who crouches.', unit='statures')


@dataclass(frozen=True)
class GestureConstants:
    """Gestures, by where wrists and elbows are and how they move."""

    hand_up: Ramp = constant((-0.05, 0.02), 'Height of the wrist over the shoulder, of who waves.', unit='statures')
    forearm_up: Ramp = constant((75.0, 55.0), 'Angle of the forearm to straight up, of who waves.', unit='deg')
    over_head: Ramp = constant((0.02, 0.06), 'Height of the wrist over the eyes, of a raised hand.', unit='statures')
    swing: Ramp = constant((0.035, 0.055), 'Way of the wrist to and fro, of who waves or beckons.', unit='statures')
    still: Ramp = constant((0.35, 0.22), 'Speed of the wrist of an arm that is held.', unit='statures/s')
    straight_arm: Ramp = constant((120.0, 138.0), 'Angle of the elbow of who points.', unit='deg')
    arm_away: Ramp = constant((35.0, 48.0), 'Angle of the arm to straight down, of who points.', unit='deg')
    arm_not_up: Ramp = constant((155.0, 140.0), 'The same: higher is a raised hand.', unit='deg')
    crossed: Ramp = constant((0.0, 0.04), 'By how much each wrist is beyond the middle of the trunk.', unit='statures')
    before_chest: Ramp = constant((0.0, 0.05), 'By how much the wrists are before the trunk.', unit='statures')
    wrist_height: Ramp = constant((0.26, 0.20), 'Height of the shoulders over the wrists of crossed arms.',
                                  unit='statures')
    bent_elbow: Ramp = constant((125.0, 105.0), 'Angle of the elbows of crossed arms.', unit='deg')

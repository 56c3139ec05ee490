"""What people do: the types that pass between the core, markers and converters.

All positions and directions are in the frame of the people.
"""
from dataclasses import dataclass
from typing import NamedTuple, Optional, Tuple

import numpy as np

UNKNOWN = 'unknown'
POSTURES = ('standing', 'sitting', 'crouching', 'kneeling', 'lying')
ARM_GESTURES = ('wave', 'raise_hand', 'beckon', 'stop', 'point')
GESTURES = (*ARM_GESTURES, 'arms_crossed')
LEFT, RIGHT, BOTH = 'left', 'right', 'both'


@dataclass(frozen=True)
class Posture:
    """The posture of a body.

    Attributes:
        name: one of `POSTURES`, or `UNKNOWN`: joints are hidden, or one posture passes into another.
        since: when its conditions began to hold [s]; NaN if unknown.
        confidence: how far its conditions hold, 0 to 1; 0 if unknown.
    """

    name: str = UNKNOWN
    since: float = np.nan
    confidence: float = 0.0


class Target(NamedTuple):
    """An object to point at, by its unique name; `position` (3,) [m]."""

    name: str
    position: np.ndarray


@dataclass(frozen=True)
class Hit:
    """What a pointing ray meets.

    Attributes:
        position: (3,) [m].
        name: of a known target; '': a point of the cloud.
        off: angle between it and the ray, at the ray's origin [rad].
    """

    position: np.ndarray
    name: str = ''
    off: float = 0.0


@dataclass(frozen=True)
class Ray:
    """A line along which a person may point.

    Attributes:
        origin: (3,) [m].
        direction: (3,) unit vector, from there through the wrist.
        sigma: [rad], root mean square angle between direction and target; the cone of half angle 2 sigma holds most
            targets.
        hit: what the ray meets; None: nothing known.
    """

    origin: np.ndarray
    direction: np.ndarray
    sigma: float
    hit: Optional[Hit]


class PointedTarget(NamedTuple):
    """A known target in the cone of a pointing arm.

    Attributes:
        name: of the target.
        position: (3,) [m].
        sigmas: angle between it and the ray in sigma of the ray.
        probability: that it is the one that is meant, if one of those in the cone is.
    """

    name: str
    position: np.ndarray
    sigmas: float
    probability: float


@dataclass(frozen=True)
class Pointing(Ray):
    """The ray of a pointing arm, in the middle between the two along which people point.

    Attributes:
        eye_ray: of people who aim, from the eyes; what it meets is a point of the cloud.
        arm_ray: of people who do not, from the shoulder, likewise.
        targets: known targets in the cone of 2 sigma, the most probable first.
    """

    eye_ray: Ray
    arm_ray: Ray
    targets: Tuple[PointedTarget, ...] = ()


@dataclass(frozen=True)
class Gesture:
    """A gesture of an arm or of both.

    Attributes:
        name: one of `GESTURES`.
        arm: `LEFT`, `RIGHT` or `BOTH`, the person's own.
        since: when its conditions began to hold [s]; it is reported shortly after.
        confidence: how far its conditions hold, 0 to 1.
        pointing: where to, of `point`.
    """

    name: str
    arm: str
    since: float
    confidence: float
    pointing: Optional[Pointing] = None


@dataclass(frozen=True)
class Facing:
    """Which way a body or a head faces.

    Attributes:
        direction: (3,) unit vector.
        sigma: [rad], by the errors of the joints.
        begin: (3,) [m], the face; None of bodies, which face out of the middle of the trunk, and of messages.
    """

    direction: np.ndarray
    sigma: float
    begin: Optional[np.ndarray] = None


@dataclass(frozen=True)
class Walk:
    """How a person moves over the floor.

    Attributes:
        moving: or standing still.
        speed: [m/s].
        direction: (3,) level unit vector; zeros while standing still.
    """

    moving: bool
    speed: float
    direction: np.ndarray


@dataclass(frozen=True)
class Fall:
    """A person lies that was upright shortly before.

    Attributes:
        stamp: since when the person lies [s]. It names the fall: there is one per person and stamp.
        duration: time from upright to lying [s].
        speed: greatest speed downwards of the shoulders on the way [m/s].
    """

    stamp: float
    duration: float
    speed: float


@dataclass(frozen=True)
class FloorPose:
    """Where on the floor a person is, and how turned.

    Attributes:
        position: (3,) [m], below the trunk.
        orientation: (4,) unit quaternion x, y, z, w: x level to where the body faces, z upwards.
    """

    position: np.ndarray
    orientation: np.ndarray


@dataclass(frozen=True)
class PersonSignals:
    """What one person does at one time.

    Attributes:
        id: of the person.
        place: (3,) [m], the middle of the trunk; NaN if hidden.
        posture: one of `POSTURES` or unknown.
        gestures: of all that hold.
        body, head: which way they face; None if hidden.
        walk: None: the person was not seen for long enough.
        fall: of a person that lies after a fall, until it is up again; None: no fall.
        floor: where on the floor; None: no joint is known.
        hidden_arms: arms whose gestures are not known, `LEFT` and `RIGHT`.
    """

    id: int
    place: np.ndarray
    posture: Posture = Posture()
    gestures: Tuple[Gesture, ...] = ()
    body: Optional[Facing] = None
    head: Optional[Facing] = None
    walk: Optional[Walk] = None
    fall: Optional[Fall] = None
    hidden_arms: Tuple[str, ...] = ()
    floor: Optional[FloorPose] = None

    def gesture(self, name: str) -> Optional[Gesture]:
        """Return the gesture of this name, None if it does not hold."""
        return next((one for one in self.gestures if one.name == name), None)

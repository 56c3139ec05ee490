"""What people do: the types that pass between the core, markers and converters; all in the frame of the people."""
from dataclasses import dataclass
from typing import NamedTuple, Optional, Tuple

import numpy as np

UNKNOWN = 'unknown'
POSTURES = ('standing', 'sitting', 'crouching', 'kneeling', 'lying')
LEFT, RIGHT, BOTH = 'left', 'right', 'both'


@dataclass(frozen=True)
class Posture:
    """The posture of a body."""

    name: str = UNKNOWN  # one of `POSTURES`, or `UNKNOWN`: joints are hidden, or one posture passes into another
    since: float = np.nan  # when its conditions began to hold [s]; NaN if unknown
    confidence: float = 0.0  # how far its conditions hold, 0 to 1; 0 if unknown


class Target(NamedTuple):
    """An object to point at."""

    name: str  # unique
    position: np.ndarray  # (3,) [m]


@dataclass(frozen=True)
class Hit:
    """A known target that a pointing ray meets."""

    position: np.ndarray  # (3,) [m]
    name: str
    off: float  # angle between it and the ray, at the ray's origin [rad]


@dataclass(frozen=True)
class Ray:
    """A line along which a person may point."""

    origin: np.ndarray  # (3,) [m]
    direction: np.ndarray  # (3,) unit vector, from there through the wrist
    sigma: float  # [rad], root mean square angle to the target; the cone of half angle 2 sigma holds most targets


class PointedTarget(NamedTuple):
    """A known target in the cone of a pointing arm."""

    name: str
    position: np.ndarray  # (3,) [m]
    sigmas: float  # angle between it and the ray in sigma of the ray
    probability: float  # that it is the one that is meant, if one of those in the cone is


@dataclass(frozen=True)
class Pointing(Ray):
    """The ray of a pointing arm, in the middle between the two along which people point."""

    eye_ray: Ray  # of people who aim, from the eyes
    arm_ray: Ray  # of people who do not, from the shoulder
    hit: Optional[Hit] = None
    targets: Tuple[PointedTarget, ...] = ()  # known ones in the cone of 2 sigma, the most probable first


@dataclass(frozen=True)
class Gesture:
    """A gesture of an arm or of both."""

    name: str  # one of `ARM_GESTURES`, or arms_crossed
    arm: str  # `LEFT`, `RIGHT` or `BOTH`, the person's own
    since: float  # when its conditions began to hold [s]; it is reported shortly after
    confidence: float  # how far its conditions hold, 0 to 1
    pointing: Optional[Pointing] = None  # of `point`


@dataclass(frozen=True)
class Facing:
    """Which way a body or a head faces."""

    direction: np.ndarray  # (3,) unit vector
    sigma: float  # [rad], by the errors of the joints
    begin: Optional[np.ndarray] = None  # (3,) [m], the face; None: of a body, or of a message


@dataclass(frozen=True)
class Walk:
    """How a person moves over the floor."""

    moving: bool  # or standing still
    speed: float  # [m/s]
    direction: np.ndarray  # (3,) level unit vector; zeros while standing still


@dataclass(frozen=True)
class Fall:
    """A person lies that was upright shortly before."""

    stamp: float  # since when the person lies [s]; it names the fall: there is one per person and stamp
    duration: float  # time from upright to lying [s]
    speed: float  # greatest speed downwards of the shoulders on the way [m/s]


@dataclass(frozen=True)
class FloorPose:
    """Where on the floor a person is, and how turned."""

    position: np.ndarray  # (3,) [m], below the trunk
    orientation: np.ndarray  # (4,) unit quaternion x, y, z, w: x level to where the body faces, z upwards


@dataclass(frozen=True)
class PersonSignals:
    """What one person does at one time."""

    id: int
    place: np.ndarray  # (3,) [m], the middle of the trunk, estimated where it is hidden; NaN: no joint is known
    posture: Posture = Posture()
    gestures: Tuple[Gesture, ...] = ()  # all that hold
    body: Optional[Facing] = None  # None: hidden
    head: Optional[Facing] = None  # None: hidden
    walk: Optional[Walk] = None  # None: the person was not seen for long enough
    fall: Optional[Fall] = None  # of a person that lies after a fall, until it is up again
    hidden_arms: Tuple[str, ...] = ()  # arms whose gestures are not known, `LEFT` and `RIGHT`
    floor: Optional[FloorPose] = None  # None: no joint is known

    def gesture(self, name: str) -> Optional[Gesture]:
        """Return the gesture of this name, None if it does not hold."""
        return next((one for one in self.gestures if one.name == name), None)

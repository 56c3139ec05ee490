"""How honest sigma is: people who stand or walk, seen by cameras whose errors are as they state, at any rate."""
from dataclasses import dataclass, field
from typing import NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_fusion.constants import FUSION
from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_fusion.observations import KeypointOffsets, Sighting, from_space
from openpose_ros_pkg.skeletons import COCO_18
from simulated_mocap import STANDING
from simulated_rig import Room, looking_at_the_middle, without_depth
from skeleton_extract_3d.people import MEASURED, People3D

# Time that nothing is compared in, as filters settle [s].
SETTLED = 1.0
_OFFSETS = KeypointOffsets()
# Distance of the people from the middle of the room [m].
_RADIUS = 1.5


class Shares(NamedTuple):
    """Shares of the joints whose error is within 1 and 2 sigma, and the root mean square error [m]."""

    within_1: float
    within_2: float
    error: float


def standing(seconds: float, people: int) -> Room:
    """Return people who stand still around the middle of the room."""
    return _room(seconds, people, 0.0)


def striding(seconds: float, people: int) -> Room:
    """Return people who walk in a circle at 1.2 m/s and swing arms and legs; bones keep their lengths."""
    return _room(seconds, people, 1.2)


def _room(seconds: float, people: int, speed: float) -> Room:
    times = np.arange(0, seconds + 0.1, 1 / 240)
    return Room(times, np.array([_person(times, 2 * np.pi * number / people, speed) for number in range(people)]))


def _person(times: np.ndarray, place: float, speed: float) -> np.ndarray:
    """Return the joints of a person (T, 18, 3) [m] who begins at an angle [rad] on the circle."""
    body = {name: np.tile(np.array(point, float), (len(times), 1)) for name, point in STANDING.items()}
    swing = (speed > 0) * np.sin(2 * np.pi * 0.9 * times + 3 * place)
    for side, sign in (('left', 1), ('right', -1)):
        for chain, angles in ((('shoulder', 'elbow', 'wrist'), (0.4 * sign * swing, 0.6 * sign * swing + 0.2)),
                              (('hip', 'knee', 'ankle'), (-0.4 * sign * swing, -0.3 * sign * swing - 0.2))):
            for start, end, angle in zip(chain, chain[1:], angles):
                length = np.linalg.norm(np.subtract(STANDING[f'{side}_{end}'], STANDING[f'{side}_{start}']))
                body[f'{side}_{end}'] = body[f'{side}_{start}'] + length * np.stack(
                    [np.sin(angle), 0 * angle, -np.cos(angle)], axis=1)
    joints = np.stack([body[joint] for joint in COCO_18.joints], axis=1)
    joints[..., 2] += 0.02 * (swing ** 2)[:, np.newaxis]
    angle = place + speed / _RADIUS * times
    cosine, sine = np.cos(angle)[:, np.newaxis], np.sin(angle)[:, np.newaxis]
    # they look along the circle
    x, y = -sine * joints[..., 0] - cosine * joints[..., 1], cosine * joints[..., 0] - sine * joints[..., 1]
    return np.stack([x + _RADIUS * cosine, y + _RADIUS * sine, joints[..., 2]], axis=2)


@dataclass
class ErringCamera:
    """A camera whose keypoints lie beside the joints as the fusion expects, and err beside that as it says."""

    name: str
    pose: Tuple[np.ndarray, np.ndarray]
    noise: float  # of its joints, standard deviation per axis [m]
    correlation: float = 0.0  # time in which an error fades (1 / e) [s]; 0: errors of frames are independent
    angle: Optional[float] = None  # error of its rays per axis [rad], for a camera without depth
    random: np.random.RandomState = field(default_factory=lambda: np.random.RandomState(0))
    _errors: Tuple[float, np.ndarray] = (-np.inf, np.zeros(()))

    def errors(self, stamp: float, people: int) -> np.ndarray:
        """Return the errors (P, 18, 3), of standard deviation 1, at a stamp [s] after those before."""
        last, before = self._errors
        kept = np.exp((last - stamp) / self.correlation) if self.correlation else 0.0
        fresh = self.random.normal(size=(people, len(COCO_18.joints), 3))
        self._errors = stamp, kept * before + np.sqrt(1 - kept ** 2) * fresh
        return self._errors[1]

    def see(self, joints: np.ndarray, stamp: float) -> Sighting:
        """Return what the camera sees of people whose true joints are (P, 18, 3) [m]."""
        rotation, origin = self.pose
        seen = joints + _OFFSETS.of_bodies(joints)
        rays = seen - origin
        distance = np.linalg.norm(rays, axis=2, keepdims=True)
        errors = self.errors(stamp, len(joints))
        if self.angle is None:
            seen = seen + _OFFSETS.of_depth(rays / distance) + self.noise * errors
        else:
            seen = seen + self.angle * distance * errors
        shape = seen.shape[:2]
        people = People3D(COCO_18, (seen - origin) @ rotation, np.ones(shape), np.full(shape, MEASURED, np.uint8),
                          np.full(shape, self.noise * np.sqrt(3)), np.arange(len(joints)) + 1)
        sighting = from_space(self.name, stamp, people, self.pose)
        return sighting if self.angle is None else without_depth(sighting, self.angle)


def cameras(count: int, noise: float, correlation: float, angle: Optional[float] = None) -> Tuple[ErringCamera, ...]:
    """Return cameras evenly around the room, at a third of a turn where they are two."""
    step = 2 * np.pi / max(count, 3)
    return tuple(ErringCamera(f'camera{number}', looking_at_the_middle(step * number), noise, correlation, angle,
                              np.random.RandomState(number)) for number in range(count))


def fusion_shares(room: Room, rig: Sequence[ErringCamera], rate: float, seconds: float) -> Shares:
    """Return how far fused joints are from the true ones, in sigma.

    All cameras see people at the same times, at a rate [Hz]; the first `SETTLED` of the seconds do not count.
    What keypoints of all cameras have in common (`EstimateConstants.common_sigma`) differs between joints, and stays.
    """
    fusion, ratios, squares = PeopleFusion(), [], []
    common = np.random.RandomState(99).normal(0, FUSION.estimate.common_sigma, room.at(0.0).shape)
    for stamp in 0.1 + np.arange(int(seconds * rate)) / rate:
        truth = room.at(stamp)
        people = fusion.update([camera.see(truth + common, stamp) for camera in rig], stamp)
        if stamp < SETTLED or not len(people):
            continue
        apart = np.linalg.norm(people.xyz[:, np.newaxis] - truth, axis=3)
        nearest = apart.mean(axis=2).argmin(axis=1)
        error = apart[np.arange(len(people)), nearest]
        ratios.append(error / people.sigma)
        squares.append(error ** 2)
    ratio = np.concatenate(ratios)
    return Shares(float((ratio <= 1).mean()), float((ratio <= 2).mean()),
                  float(np.sqrt(np.concatenate(squares).mean())))

"""Cameras around walking people: what each of them sees, with known noise, clocks and mistakes of calibration."""
from dataclasses import dataclass, field
from typing import Optional, Sequence, Tuple

import numpy as np

from openpose_ros_fusion.observations import Sighting, from_space
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18, MESSAGE_JOINTS
from simulated_mocap import walkers
from skeleton_extract_3d.people import MEASURED, MISSING, People3D
from skeleton_extract_3d.points.camera import CameraModel

# Of all cameras: 640 x 480, 65 degrees wide.
CAMERA = CameraModel(640, 480, np.array([[500.0, 0, 319.5], [0, 500.0, 239.5], [0, 0, 1]]))
COLUMNS = [MESSAGE_JOINTS.index(joint) for joint in COCO_18.joints]


@dataclass(frozen=True)
class Room:
    """S people that walk about around the origin, z up."""

    times: np.ndarray  # (T,) [s]
    joints: np.ndarray  # (S, T, 18, 3) [m]

    def at(self, time: float) -> np.ndarray:
        """Return the true joints at a time, (S, 18, 3) [m]."""
        row = int(np.clip(np.searchsorted(self.times, time) - 1, 0, len(self.times) - 2))
        share = (time - self.times[row]) / (self.times[row + 1] - self.times[row])
        return (1 - share) * self.joints[:, row] + share * self.joints[:, row + 1]


def walking(seconds: float, people: int, seed: int = 0) -> Room:
    """Return people who walk about and swing their arms."""
    truth = walkers(seconds, people, seed, rate=60.0).joints
    return Room(truth.times - truth.times[0], truth.positions[:, :, COLUMNS])


def looking_at(origin: Sequence[float], target: Sequence[float] = (0.0, 0.0, 1.0)) -> Tuple[np.ndarray, np.ndarray]:
    """Return rotation and translation to the room of a camera that stands at a place, level, and looks at another."""
    forward = np.subtract(target, origin)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward], axis=1), np.array(origin, float)


def looking_at_the_middle(angle: float) -> Tuple[np.ndarray, np.ndarray]:
    """Return the pose of a camera at an angle [rad] around the middle of the room."""
    return looking_at((5.0 * np.cos(angle), 5.0 * np.sin(angle), 1.5))


@dataclass
class SimulatedCamera:
    """A camera of the room."""

    name: str
    pose: Tuple[np.ndarray, np.ndarray]  # true rotation (3, 3) and translation (3,) [m] to the frame of the room
    late: float = 0.0  # by which its stamps are too great [s]
    moved: Tuple[float, float, float] = (0.0, 0.0, 0.0)  # by which it is believed to stand elsewhere [m]
    noise: float = 0.02  # of its joints, standard deviation per axis [m]
    angle: Optional[float] = None  # of its rays per axis [rad], for a camera without depth
    swapped: bool = False  # ids of the first two people are exchanged
    random: np.random.RandomState = field(default_factory=lambda: np.random.RandomState(0))

    def people(self, room: Room, time: float, chosen: Optional[Tuple[int, ...]] = None) -> People3D:
        """Return the people in the camera's view at a true time, by number or all, in its optical frame."""
        joints = room.at(time)
        numbers = list(range(len(joints)) if chosen is None else chosen)
        rotation, origin = self.pose
        seen = joints[numbers] + self.random.normal(0, self.noise, (len(numbers), *joints.shape[1:]))
        ids = np.array(numbers, np.int64) + 1
        if self.swapped and len(ids) > 1:
            ids[:2] = ids[1::-1]
        shape = seen.shape[:2]
        return People3D(COCO_18, (seen - origin) @ rotation, np.ones(shape), np.full(shape, MEASURED, np.uint8),
                        np.full(shape, max(self.noise, 0.001) * np.sqrt(3)), ids)

    @property
    def believed_pose(self) -> Tuple[np.ndarray, np.ndarray]:
        """Where the camera is believed to stand."""
        return self.pose[0], self.pose[1] + np.array(self.moved)

    def see(self, room: Room, time: float, chosen: Optional[Tuple[int, ...]] = None) -> Sighting:
        """Return what the camera sees at a true time, as it is believed to stand and by its own clock."""
        sighting = from_space(self.name, time + self.late, self.people(room, time, chosen), self.believed_pose)
        return sighting if self.angle is None else without_depth(sighting, self.angle)

    def keypoints(self, room: Room, time: float) -> People2D:
        """Return the people in the image of the camera (`CAMERA`)."""
        people = self.people(room, time)
        pixels = people.xyz.astype(np.float64) @ CAMERA.matrix.T
        values = np.concatenate([pixels[..., :2] / pixels[..., 2:], np.full((*pixels.shape[:2], 1), 0.9)], axis=2)
        return People2D(COCO_18, values, np.full(len(people), 0.9), people.ids)


def without_depth(sighting: Sighting, angle: float) -> Sighting:
    """Return what the same camera would see without depth: rays to measured joints, with an error per axis [rad]."""
    measured = sighting.status == MEASURED
    return Sighting(sighting.camera, sighting.stamp, sighting.origin, sighting.ids,
                    np.full(sighting.positions.shape, np.nan),
                    np.where(measured[..., np.newaxis], sighting.directions, np.nan),
                    np.where(measured, angle, np.nan), np.where(measured, MEASURED, MISSING).astype(np.uint8),
                    sighting.confidence)


def around(count: int, **differences: object) -> Tuple[SimulatedCamera, ...]:
    """Return cameras evenly around the room: camera0, camera1, ..."""
    return tuple(SimulatedCamera(f'camera{number}', looking_at_the_middle(2 * np.pi * number / count),
                                 random=np.random.RandomState(number), **differences) for number in range(count))

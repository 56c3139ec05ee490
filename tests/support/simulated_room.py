"""People who walk in a room, as cameras with known poses and clocks see them."""
from dataclasses import dataclass, field
from typing import Callable, Tuple

import numpy as np

from openpose_ros_tools.calibration.recording import CameraRecording
from simulated_mocap import Truth, walkers
from simulated_rig import COLUMNS, looking_at

_START = 1_600_000_000.0
FOCAL = 540.0


@dataclass
class Camera:
    """A camera at `centre` [m] that looks at `target`, both in the room (z up)."""

    name: str
    centre: Tuple[float, float, float]
    target: Tuple[float, float, float] = (0.0, 0.0, 1.0)
    clock: float = 0.0  # by which its stamps are late [s]
    rate: float = 15.0  # [Hz]
    depth: bool = True  # whether it measures positions
    sees: Callable[[np.ndarray], np.ndarray] = lambda places: np.ones(places.shape[:-1], bool)  # of (..., 3) [m]
    bias: np.ndarray = field(default_factory=lambda: np.zeros(18))  # how much deeper joints lie than it says [m]

    @property
    def pose(self) -> Tuple[np.ndarray, np.ndarray]:
        """Rotation and translation from the optical frame to the room."""
        return looking_at(self.centre, self.target)


def around(number: int, **values) -> list:
    """Return cameras around the room, 4 m from its middle, at different heights."""
    angles = 2 * np.pi * np.arange(number) / number
    return [Camera(f'camera_{place}', (4 * np.cos(angle), 4 * np.sin(angle), 1.5 + 0.3 * place), **values)
            for place, angle in enumerate(angles)]


def errors_of(random: np.random.RandomState, shape: Tuple[int, ...], step: float, lasting: float) -> np.ndarray:
    """Return errors (T, 18, axes) with standard deviation 1: independent, or fading within `lasting` [s] (1 / e).

    Half of the variance of lasting errors is that of the whole person.
    """
    if not lasting:
        return random.normal(size=shape)
    new = np.sqrt(0.5) * (random.normal(size=shape) + random.normal(size=(shape[0], 1, shape[2])))
    kept, result = np.exp(-step / lasting), np.zeros(shape)
    for frame in range(shape[0]):
        result[frame] = kept * result[frame - 1] + np.sqrt(1 - kept ** 2) * new[frame] if frame else new[frame]
    return result


def record(camera: Camera, truth: Truth, seed: int, noise: float = 0.015, dropped: float = 0.05, lasting: float = 0.0
           ) -> CameraRecording:
    """Return what a camera sees, without a share of frames and of joints; ids are those of the truth.

    The noise is that per axis [m], of images the same at 4 m; see `errors_of`.
    """
    random = np.random.RandomState(seed)
    times = truth.joints.times
    at = np.arange(times[0] + random.uniform(0, 1 / camera.rate), times[-1], 1 / camera.rate)
    at = at[random.uniform(size=len(at)) >= dropped]
    right = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
    part = ((at - times[right - 1]) / (times[right] - times[right - 1]))[:, None, None]
    stamps, ids, points = [], [], []
    rotation, centre = camera.pose
    for person, whole in enumerate(truth.joints.positions[:, :, COLUMNS]):
        joints = whole[right - 1] + part * (whole[right] - whole[right - 1])
        local = (joints - centre) @ rotation
        rays = local / np.linalg.norm(local, axis=2, keepdims=True)
        local = local - camera.bias[:, None] * rays
        if camera.depth:
            local = local + noise * errors_of(random, local.shape, 1 / camera.rate, lasting)
        else:
            local = local / local[..., 2:]
            local[..., :2] += noise / 4 * errors_of(random, local[..., :2].shape, 1 / camera.rate, lasting)
        local[random.uniform(size=local.shape[:2]) < dropped] = np.nan
        seen = camera.sees(np.nanmean(joints, axis=1))
        stamps.append(at[seen])
        ids.append(np.full(int(seen.sum()), person))
        points.append(local[seen])
    stamp = np.round((np.concatenate(stamps) + camera.clock) * 1e9).astype(np.int64) + np.int64(_START) * 10 ** 9
    sigma = np.full((len(stamp), 18), noise * np.sqrt(3) if camera.depth else np.nan)
    return CameraRecording(camera.name, f'{camera.name}_optical', stamp, np.concatenate(ids), np.concatenate(points),
                           sigma, camera.depth, FOCAL)


def record_all(cameras, truth=None, seconds: float = 10.0, people: int = 2, seed: int = 0, **values):
    """Return the recordings of cameras, of `walkers` where no truth is given."""
    truth = truth or walkers(seconds, people, seed + 100)
    return [record(camera, truth, 10 * seed + number, **values) for number, camera in enumerate(cameras)]


def rig_errors(rig, cameras) -> np.ndarray:
    """Return angle [degrees], position [m] and clock [s] errors of all cameras to the first one, (C - 1, 3)."""
    def relative(pose, root):
        return root[0].T @ pose[0], root[0].T @ (pose[1] - root[1])

    found = []
    for placed, camera in zip(rig.cameras[1:], cameras[1:]):
        rotation, centre = relative(placed.pose, rig.cameras[0].pose)
        true_rotation, true_centre = relative(camera.pose, cameras[0].pose)
        cosine = (np.trace(true_rotation.T @ rotation) - 1) / 2
        found.append((np.degrees(np.arccos(np.clip(cosine, -1, 1))), np.linalg.norm(centre - true_centre),
                      abs(placed.clock_offset - (cameras[0].clock - camera.clock))))
    return np.array(found)


def up_error(rig, cameras) -> float:
    """Return the angle between the found and the true vertical [degrees]."""
    up = rig.cameras[0].pose[0].T[:, 2]
    return float(np.degrees(np.arccos(np.clip(up @ cameras[0].pose[0].T[:, 2], -1, 1))))

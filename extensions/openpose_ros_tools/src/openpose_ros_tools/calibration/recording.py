"""What one camera saw over time: people in space, or rays through their keypoints."""
from dataclasses import dataclass, replace
from typing import Dict, List

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.alignment.clock import MAX_GAP, JointPaths

# Tracks that follow each other in one slot are this far apart [s], so that nothing is interpolated between them.
_APART = 1.0
# Fewer frames with a person are no recording.
_LEAST_FRAMES = 10
# Error of a joint in space, where a recording does not tell it [m].
_POSITION_SIGMA = 0.035
# Error of a keypoint across its ray with a score of 1 [m], and the power of the score by which it grows: the networks
# err by a share of the person, and near and distant people alike (trials.md).
_KEYPOINT_SIGMA, _SCORE_POWER = 0.006, 1.5
# Lower scores count as this one; that of keypoints of which a recording has none.
_LEAST_SCORE, _UNKNOWN_SCORE = 0.05, 0.7


@dataclass(frozen=True, eq=False)
class CameraRecording:
    """The people of one camera, one row per person and frame.

    Attributes:
        name: of the camera.
        frame_id: its optical frame.
        stamps: (R,) int64 [ns].
        ids: (R,) int64, of tracks.
        positions: (R, K, 3) float64 in the optical frame: [m] of a camera with depth, where a joint was measured; else
            x, y, 1 on its ray. NaN where missing.
        sigma: (R, K) [m] standard deviation in space, without depth that per axis across the ray, as of
            `keypoint_sigma`; NaN where not known.
        has_depth: whether positions are points, no rays.
        focal: focal length [px]; NaN where not known.
    """

    name: str
    frame_id: str
    stamps: np.ndarray
    ids: np.ndarray
    positions: np.ndarray
    sigma: np.ndarray
    has_depth: bool
    focal: float = float('nan')


def keypoint_sigma(scores: np.ndarray) -> np.ndarray:
    """Return the error of keypoints per axis across their rays [m] by their scores; NaN without one."""
    with np.errstate(invalid='ignore'):
        return np.where(scores > 0, _KEYPOINT_SIGMA * np.clip(scores, _LEAST_SCORE, 1.0) ** -_SCORE_POWER, np.nan)


class CameraPaths(JointPaths):
    """A recording as paths of its joints over time; people who follow each other share a slot.

    Attributes:
        recording: its rows in the order of time, with stamps from 0 on.
        name, has_depth: of the recording.
        times: (T,) float64 [s] of the frames with people.
        positions: (S, T, K, 3) points of S slots; NaN where missing.
    """

    def __init__(self, recording: CameraRecording, begin: int) -> None:
        order = np.argsort(recording.stamps, kind='stable')
        order = order[np.isfinite(recording.positions[order]).all(axis=2).any(axis=1)]
        stamps = recording.stamps[order]
        frames = np.unique(stamps)
        if len(frames) < _LEAST_FRAMES:
            raise BadInputError(f'camera {recording.name} saw people in {len(frames)} frames, expected '
                                f'{_LEAST_FRAMES} or more')
        self.recording = replace(recording, stamps=stamps - begin, ids=recording.ids[order],
                                 positions=recording.positions[order], sigma=recording.sigma[order])
        self.name, self.has_depth = recording.name, recording.has_depth
        times, rows = (frames - begin) * 1e-9, np.searchsorted(frames, stamps)
        points = self.recording.positions
        slots = _slots(times[rows], self.recording.ids)
        shape = (slots.max() + 1, len(frames), points.shape[1])
        self.positions, self._sigma = np.full((*shape, 3), np.nan), np.full(shape, np.nan)
        self.positions[slots, rows] = points
        sigma = self.recording.sigma
        if self.has_depth:
            sigma = np.where(np.isfinite(sigma), sigma, _POSITION_SIGMA) / np.sqrt(3.0)
        else:
            sigma = np.where(np.isfinite(sigma), sigma, keypoint_sigma(np.array(_UNKNOWN_SCORE)))
        self._sigma[slots, rows] = sigma
        super().__init__(times, self.positions, MAX_GAP)
        self._half = max(float(np.median(np.diff(times))) / 2, 0.02)

    def motion(self, times: np.ndarray) -> np.ndarray:
        """Return how fast the points move, (S, N, K, 3) [1/s]; 0 where that is not known."""
        return np.nan_to_num(self.velocity(times, self._half))

    def sigma(self, times: np.ndarray) -> np.ndarray:
        """Return the error per axis of the points of the nearest frames, (S, N, K) [m], of rays that across them."""
        after = np.clip(np.searchsorted(self.times, times), 1, len(self.times) - 1)
        nearest = after - (times - self.times[after - 1] < self.times[after] - times)
        sigma = self._sigma[:, nearest]
        usual = np.nanmedian(self._sigma)
        return np.where(np.isfinite(sigma), np.maximum(sigma, 0.3 * usual), usual)


def paths_of(recordings: List[CameraRecording]) -> List[CameraPaths]:
    """Return the paths of all cameras, by one clock as far as their stamps are.

    Raises:
        BadInputError: a camera saw hardly any people, two have one name, or there are fewer than two.
    """
    names = [recording.name for recording in recordings]
    if len(names) < 2:
        raise BadInputError(f'there are people of {len(names)} cameras ({", ".join(names) or "none"}), expected of 2 '
                            'or more')
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BadInputError(f"two cameras have the name '{twice[0]}'")
    begin = min(int(recording.stamps.min()) for recording in recordings if len(recording.stamps))
    return [CameraPaths(recording, begin) for recording in recordings]


def overlap(first: CameraPaths, second: CameraPaths) -> float:
    """Return the time that two recordings have in common by their stamps, as a share of the shorter one."""
    spans = [(paths.times[0], paths.times[-1]) for paths in (first, second)]
    common = min(end for _, end in spans) - max(start for start, _ in spans)
    return float(max(common, 0.0) / max(min(end - start for start, end in spans), 1e-9))


def _slots(times: np.ndarray, ids: np.ndarray) -> np.ndarray:
    """Return the slot of each row (R,), by ascending times [s]: tracks that are well apart share one."""
    slots: Dict[int, int] = {}
    ends: List[float] = []
    for track in dict.fromkeys(ids.tolist()):
        rows = np.flatnonzero(ids == track)
        slots[track] = next((slot for slot, end in enumerate(ends) if times[rows[0]] - end > _APART), len(ends))
        ends[slots[track]:slots[track] + 1] = [float(times[rows[-1]])]
    return np.array([slots[track] for track in ids.tolist()], int)

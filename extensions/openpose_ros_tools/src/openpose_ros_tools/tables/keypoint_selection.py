"""The part of a recording that is plotted: people and joints; and which way is up."""
from dataclasses import dataclass
from datetime import datetime, timezone
from typing import Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.tables.keypoint_table import KeypointTable
from skeleton_extract_3d.people import MISSING

# Number of people that are shown by default: those with most rows.
MOST_PERSONS = 8
# Frames have a gap between them if they are further apart than this number of periods: two lost frames are no gap.
_GAP_PERIODS = 3.5
# A stamp before this time [s] (1980) is simulated time, or time since some start.
_FIRST_DATE = 315532800
_HIPS, _NECK, _NOSE, _ANKLES = ('right_hip', 'left_hip'), 'neck', 'nose', ('right_ankle', 'left_ankle')
# An axis of coordinates is vertical if its share of the trunk's unit vector is at least this.
_UPRIGHT = 0.6


@dataclass(frozen=True)
class Selection:
    """The part of a recording that is plotted. Times are [s] since its first frame."""

    table: KeypointTable  # rows of the chosen people
    all_people: KeypointTable
    frames: np.ndarray  # (N,) int64 [ns] stamps of the frames, ascending
    joints: Tuple[str, ...]  # the chosen ones that anything is known of, in the order of the table
    persons: Tuple[int, ...]  # ids of the chosen people, ascending
    left_out: int  # people that were not chosen as there are too many

    @property
    def begin(self) -> int:
        """Stamp of the first frame [ns]."""
        return int(self.frames[0])

    def seconds(self, stamps: np.ndarray) -> np.ndarray:
        """Return stamps [ns] as float64 [s] since the first frame."""
        return (stamps - self.begin) * 1e-9

    @property
    def period(self) -> float:
        """Median time between frames [s]; 1 of less than two frames."""
        return float(np.median(np.diff(self.frames))) * 1e-9 if len(self.frames) > 1 else 1.0

    @property
    def gap(self) -> float:
        """Frames that are further apart than this have a gap between them [s]."""
        return _GAP_PERIODS * self.period

    @property
    def span(self) -> Tuple[float, float]:
        """First and last frame [s]."""
        first, last = self.seconds(self.frames[[0, -1]]).tolist()
        return first, last

    @property
    def first_moment(self) -> str:
        """The stamp of the recording's first frame, as a date where it is one."""
        seconds, rest = divmod(self.begin, 1000000000)
        if seconds < _FIRST_DATE:
            return f'{self.begin * 1e-9:.3f} s'
        moment = datetime.fromtimestamp(seconds, timezone.utc).strftime('%Y-%m-%d %H:%M:%S')
        return f'{moment}.{rest // 1000000:03d} UTC'

    @property
    def frame_id(self) -> str:
        """Frame of reference; several are joined."""
        return ', '.join(sorted(set(self.all_people.frame_ids.tolist()) - {''}))


def select(table: KeypointTable, frames: Optional[np.ndarray] = None, joints: Optional[Sequence[str]] = None
           ) -> Selection:
    """Choose the `MOST_PERSONS` people with most rows.

    Args:
        frames: (N,) int64 [ns] stamps of all frames, if those without people are known.
        joints: names; None: all that are known in any row.

    Raises:
        BadInputError: no people are in the recording, or a joint is not.
    """
    if not len(table):
        raise BadInputError('no people are in it: no rows')
    stamps = np.unique(table.stamps if frames is None else np.concatenate([table.stamps, frames]))
    ids, counts = np.unique(table.ids, return_counts=True)
    chosen = np.sort(ids[np.argsort(-counts, kind='stable')[:MOST_PERSONS]])
    known = [joint for joint, status in zip(table.joints, table.status.T) if (status != MISSING).any()]
    for joint in joints or ():
        if joint not in known:
            raise BadInputError(f"joint '{joint}' is not in it; there are: {', '.join(known)}")
    return Selection(table.select(np.isin(table.ids, chosen)), table, stamps,
                     tuple(joint for joint in known if not joints or joint in joints), tuple(chosen.tolist()),
                     len(ids) - len(chosen))


def ground_places(table: KeypointTable) -> Tuple[np.ndarray, str]:
    """Return the position of a person, (R, D) float32, and its joint: mid_hip, or the neck if that is known more often.

    The middle of the hips replaces a mid_hip that the joint set lacks.
    """
    hip, neck, hips = (_middle(table.joints, table.positions, *names) for names in (('mid_hip',), (_NECK,), _HIPS))
    hip = np.where(np.isfinite(hip), hip, hips)
    if np.isfinite(neck[:, 0]).sum() > np.isfinite(hip[:, 0]).sum():
        return neck, _NECK
    return hip, 'mid_hip'


def vertical_axis(table: KeypointTable) -> Tuple[int, int]:
    """Return the number of the axis that is vertical, and 1 where it points up, -1 where it points down.

    Where people do not tell, down is along y, as in a camera's frame.
    """
    return upright_axis(table.joints, table.positions) or (1, -1)


def upwards_of(table: KeypointTable, up: Optional[Sequence[float]] = None) -> np.ndarray:
    """Return the (3,) upward direction, of any length: as given, else the axis along which people mostly are."""
    axis, sign = vertical_axis(table)
    return sign * np.eye(3)[axis] if up is None else np.array(up, np.float64)


def level_axis(up: np.ndarray, after: int) -> np.ndarray:
    """Return an axis of a frame, made level: that which comes `after` the one nearest to `up`, (3,) of length 1."""
    axis = np.eye(3)[(int(np.argmax(np.abs(up))) + after) % 3]
    axis = axis - (axis @ up) * up
    level: np.ndarray = axis / np.linalg.norm(axis)
    return level


def upright_axis(joints: Sequence[str], positions: np.ndarray) -> Optional[Tuple[int, int]]:
    """Return the axis along which people (R, K, 3) stand and its sign, as `vertical_axis`; None: they do not tell.

    Necks are above hips, noses above ankles.
    """
    for upper, lower in ((_NECK, _HIPS), (_NOSE, _ANKLES)):
        body = _middle(joints, positions, upper) - _middle(joints, positions, *lower)
        body = body[np.isfinite(body).all(axis=1)]
        if len(body):
            up = np.median(body / np.maximum(np.linalg.norm(body, axis=1, keepdims=True), 1e-6), axis=0)
            axis = int(np.argmax(np.abs(up)))
            if abs(up[axis]) > _UPRIGHT:
                return axis, 1 if up[axis] > 0 else -1
    return None


def _middle(joints: Sequence[str], positions: np.ndarray, *names: str) -> np.ndarray:
    """Return the mean position of joints, (R, D); NaN where one of them is missing, or is none of the recording's."""
    if not set(names) <= set(joints):
        return np.full_like(positions[:, 0], np.nan)
    return positions[:, [joints.index(name) for name in names]].mean(axis=1)

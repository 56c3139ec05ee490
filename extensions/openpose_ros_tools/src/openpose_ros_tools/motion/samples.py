"""Each person of a recording at a constant rate, y up, as files of motion capture have it."""
from dataclasses import dataclass, replace
from typing import List, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.alignment.clock import JointPaths, bridged_gap
from openpose_ros_tools.tables.keypoint_selection import level_axis, upwards_of
from openpose_ros_tools.tables.keypoint_table import KeypointTable
from skeleton_extract_3d.people import MEASURED

# Times without a joint up to this are bridged by straight lines [s].
_MAX_GAP = 0.25
# Rates are rounded to this many digits [Hz]: stamps jitter.
_RATE_DIGITS = 2
# Samples that are this much before the first frame of a person, or after the last, belong to it [of a sample].
_ROUNDING = 1e-3


@dataclass(frozen=True)
class SampledPerson:
    """A person from its first frame to its last, in a frame with y up; missing joints are NaN."""

    person: int  # track id
    first: int  # number of the first sample, where the recording begins with 0
    rate: float  # [Hz]
    joints: Tuple[str, ...]  # those that are known at any time
    positions: np.ndarray  # (T, K, 3) float64 [m]


def measured_only(table: KeypointTable) -> KeypointTable:
    """Return a table without the positions that are inferred."""
    return replace(table, positions=np.where((table.status == MEASURED)[..., None], table.positions, np.nan))


def y_up(up: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) into a frame with y upwards.

    z up becomes x -> z, y -> x, z -> y, as Pose2Sim has it (common.py, zup2yup); a camera's frame becomes x, -y, -z.

    Args:
        up: (3,) upwards, any length.
    """
    y = up / np.linalg.norm(up)
    x = level_axis(y, 2)
    return np.stack([x, y, np.cross(x, y)])


def sample_people(table: KeypointTable, rate: Optional[float] = None, up: Optional[Sequence[float]] = None,
                  begin: Optional[int] = None) -> List[SampledPerson]:
    """Return all people that are in two frames or more.

    Args:
        table: in space.
        rate: [Hz]; None: that of the recording.
        up: (3,) upwards; None: the axis along which people are most of the time.
        begin: of the recording [ns], where samples are numbered 0; None: that of the table.

    Raises:
        BadInputError: no person is.
    """
    seconds = (table.stamps - (table.stamps.min() if begin is None else begin)) * 1e-9
    frames = np.unique(seconds)
    if len(frames) < 2:
        raise BadInputError('there is one frame with people, expected two at least')
    rate = rate or round(1 / float(np.median(np.diff(frames))), _RATE_DIGITS)
    turn = y_up(upwards_of(table, up))
    found = (_sampled(table.select(table.ids == person), seconds[table.ids == person], rate)
             for person in np.unique(table.ids))
    people = [SampledPerson(one.person, one.first, rate, one.joints, one.positions @ turn.T) for one in found if one]
    if not people:
        raise BadInputError('no person is in two frames')
    return people


def _sampled(rows: KeypointTable, seconds: np.ndarray, rate: float) -> Optional[SampledPerson]:
    """Return a person in the frame of the recording; None: there are no two samples of it."""
    times, order = np.unique(seconds, return_index=True)
    first, last = np.ceil(times[0] * rate - _ROUNDING), np.floor(times[-1] * rate + _ROUNDING)
    if last <= first:
        return None
    positions = rows.positions[order].astype(np.float64)
    paths = JointPaths(times, positions[np.newaxis], bridged_gap(times, _MAX_GAP))
    samples = paths.at(np.clip(np.arange(first, last + 1) / rate, times[0], times[-1]))[0]
    known = np.isfinite(samples).all(axis=2).any(axis=0)
    return SampledPerson(int(rows.ids[0]), int(first), rate, tuple(np.array(rows.joints)[known]), samples[:, known])

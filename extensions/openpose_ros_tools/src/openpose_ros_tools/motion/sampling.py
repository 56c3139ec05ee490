"""Each person of a recording at a constant rate, y up, as files of motion capture have it."""
from typing import Dict, Optional, Sequence

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.alignment.clock import JointPaths
from openpose_ros_tools.mocap.files import MarkerRecording
from openpose_ros_tools.tables.keypoint_selection import level_axis, upwards_of
from openpose_ros_tools.tables.keypoint_table import KeypointTable

# Times without a joint up to this are bridged by straight lines [s].
_MAX_GAP = 0.25
# Rates are rounded to this many digits [Hz]: stamps jitter.
_RATE_DIGITS = 2
# Samples that are this much before the first frame of a person, or after the last, belong to it [of a sample].
_ROUNDING = 1e-3


def y_up(up: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) into a frame with y upwards, from one where `up`, (3,) of any length, is upwards.

    z up becomes x -> z, y -> x, z -> y, as Pose2Sim has it (common.py, zup2yup); a camera's frame becomes x, -y, -z.
    """
    y = up / np.linalg.norm(up)
    x = level_axis(y, 2)
    return np.stack([x, y, np.cross(x, y)])


def sample_people(table: KeypointTable, up: Optional[Sequence[float]] = None, begin: Optional[int] = None
                  ) -> Dict[int, MarkerRecording]:
    """Return the joints of all people in two frames or more, by id, at the usual rate: those that are ever known.

    Args:
        table: in space.
        up: (3,) upwards; None: the axis along which people are most of the time.
        begin: of the recording [ns], where the time is 0; None: that of the table.

    Raises:
        BadInputError: no person is.
    """
    begin = int(table.stamps.min()) if begin is None else begin
    frames = np.unique((table.stamps - begin) * 1e-9)
    if len(frames) < 2:
        raise BadInputError('there is one frame with people, expected two at least')
    rate = round(1 / float(np.median(np.diff(frames))), _RATE_DIGITS)
    turn, people = y_up(upwards_of(table, up)), {}
    for person in np.unique(table.ids).tolist():
        rows = table.of_person(person)
        times, order = np.unique((rows.stamps - begin) * 1e-9, return_index=True)
        first, last = int(np.ceil(times[0] * rate - _ROUNDING)), int(np.floor(times[-1] * rate + _ROUNDING))
        if last > first:
            samples = np.arange(first, last + 1) / rate
            paths = JointPaths(times, rows.positions[order].astype(np.float64)[None], _MAX_GAP)
            positions = paths.at(np.clip(samples, times[0], times[-1]))[0]
            known = np.isfinite(positions).all(axis=2).any(axis=0)
            people[person] = MarkerRecording(tuple(np.array(rows.joints)[known].tolist()), samples,
                                             positions[:, known] @ turn.T)
    if not people:
        raise BadInputError('no person is in two frames')
    return people

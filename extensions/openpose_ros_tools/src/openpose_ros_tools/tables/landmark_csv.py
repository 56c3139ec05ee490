"""Hands and faces as CSV, in the long form: one row per frame, hand or face, and point. See docs/recordings.md."""
import csv
from typing import List, NamedTuple, Sequence, TextIO, Tuple

import numpy as np

from openpose_ros_pkg.landmarks.records import FACE_POINTS, HAND_POINT_NAMES
from openpose_ros_tools.tables.keypoint_table import FIELDS, tidy_cells

# What can be written, and the names of its points.
POINTS = {'hands': HAND_POINT_NAMES, 'faces': tuple(map(str, range(FACE_POINTS)))}
_ORIENTATION = ('orientation_x', 'orientation_y', 'orientation_z', 'orientation_w', 'orientation_sigma')


class LandmarkRow(NamedTuple):
    """A hand or a face in a frame."""

    time: int  # [ns] of the header, or of recording where there is none
    frame_id: str  # of the header
    person: int  # track id
    side: str  # 'left' or 'right' of a hand; empty of a face
    parts: Sequence[Sequence[float]]  # values of `FIELDS` of each point
    orientation: Tuple[float, ...] = ()  # of a face in space, quaternion x, y, z, w and sigma [rad]; else empty


def landmark_columns(part: str, dimensions: int) -> List[str]:
    """Return the names of the columns of 'hands' or 'faces', in space (3) or in the image (2)."""
    values = ('x', 'y', 'confidence', 'status') if dimensions == 2 else FIELDS[3]
    return ['time', 'frame', 'frame_id', 'person_ID', *['side'] * (part == 'hands'), 'point', *values,
            *(_ORIENTATION if part == 'faces' and dimensions == 3 else ())]


class LandmarkCsvWriter:
    """Writes hands or faces, in the order of the recording, the names of the columns at once.

    Args:
        part, dimensions: as `landmark_columns`.
        missing_points: whether there are rows for missing points.
    """

    def __init__(self, handle: TextIO, part: str, dimensions: int, missing_points: bool = False) -> None:
        self.part, self.dimensions, self._missing_points = part, dimensions, missing_points
        self._rows = csv.writer(handle, lineterminator='\n')
        self._rows.writerow(landmark_columns(part, dimensions))
        self._frame, self._time = -1, -1

    def write(self, rows: Sequence[LandmarkRow]) -> int:
        """Add hands or faces, return their number; rows with another time are another frame."""
        for row in rows:
            self._frame, self._time = self._frame + (row.time != self._time), row.time
            head = [row.time, self._frame, row.frame_id, row.person, *[row.side] * (self.part == 'hands')]
            for name, part in zip(POINTS[self.part], np.asarray(row.parts, np.float32).tolist()):
                cells, known = tidy_cells(part, self.dimensions)
                if known or self._missing_points:
                    self._rows.writerow([*head, name, *cells, *row.orientation])
        return len(rows)

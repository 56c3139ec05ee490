"""Keypoints of a recording: as rows in its order, one per person and frame, and as one table of arrays."""
from dataclasses import dataclass, fields, replace
from typing import Dict, Iterable, Iterator, List, NamedTuple, Sequence, Set, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS, SkeletonModel
from openpose_ros_pkg.stream.pairing import PAIRING
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

# Fields of a joint in the order of openpose_ros_msgs/BodypartDetection and BodypartDetection_3d, by dimensions.
FIELDS: Dict[int, Tuple[str, ...]] = {2: ('x', 'y', 'confidence'),
                                      3: ('x', 'y', 'z', 'confidence', 'status', 'sigma')}
# A missing joint, as the messages have it.
MISSING_PART: Dict[int, Tuple[float, ...]] = {2: (0.0, 0.0, 0.0), 3: (np.nan, np.nan, np.nan, 0.0, MISSING, np.nan)}
STATUS_WORDS = {MISSING: 'missing', MEASURED: 'measured', INFERRED: 'inferred'}
# Rows without a stamp belong to one frame if they came within this time [ns]: frames are at least 16 ms apart at 60 Hz.
_ONE_FRAME = 10 * 10 ** 6


class PersonRow(NamedTuple):
    """A person in a frame."""

    time: int  # column %time [ns]
    sequence: int  # of the header
    stamp: int  # of the header [ns]; 0: not known
    frame_id: str  # of the header
    number: int  # people in the frame
    person: int  # track id
    parts: np.ndarray  # (K, F) float32, values of `FIELDS` for the K `MESSAGE_JOINTS`


def part_values(row: PersonRow) -> List[List[float]]:
    """Return the (K, F) values of the joints as numbers of Python; the status is a whole number."""
    parts: List[List[float]] = np.asarray(row.parts, np.float32).tolist()
    for part in parts:
        if len(part) == len(FIELDS[3]):
            part[4] = int(part[4])
    return parts


class FrameSplitter:
    """Finds where frames begin, from rows in the order of the recording.

    The people of a frame have one stamp and different ids. Where the stamp is not known, as with the columns of the
    original, they have the same number of people and came within 10 ms.
    """

    def __init__(self) -> None:
        self._time = self._stamp = self._number = -1
        self._ids: Set[int] = set()

    def begins(self, row: PersonRow) -> bool:
        """Return whether this row, which follows the one of the last call, is the first of a frame."""
        same = row.stamp == self._stamp and row.person not in self._ids
        if not row.stamp:
            same = same and row.number == self._number and abs(row.time - self._time) <= _ONE_FRAME
        if not same:
            self._time, self._stamp, self._number, self._ids = row.time, row.stamp, row.number, set()
        self._ids.add(row.person)
        return not same


def frames_of(rows: Iterable[PersonRow]) -> Iterator[List[PersonRow]]:
    """Yield the people of each frame."""
    splitter = FrameSplitter()
    frame: List[PersonRow] = []
    for row in rows:
        if splitter.begins(row) and frame:
            yield frame
            frame = []
        frame.append(row)
    if frame:
        yield frame


@dataclass(frozen=True)
class KeypointTable:
    """The joints of people over time, one row per person and frame, in the order of the recording.

    The K joints are `MESSAGE_JOINTS`, whatever the network's joint set. In space D is 3 [m], in the image 2 [px].
    """

    stamps: np.ndarray  # (R,) int64 [ns], of the image or cloud; rows of one frame have one stamp
    frame_ids: np.ndarray  # (R,) str, frame of reference
    ids: np.ndarray  # (R,) int64, track ids
    positions: np.ndarray  # (R, K, D) float32; NaN where missing
    confidence: np.ndarray  # (R, K) float32 [0..1] of the 2D detection
    # (R, K) uint8: MISSING, MEASURED or INFERRED; where a recording has no status, a joint with a position is MEASURED
    status: np.ndarray
    sigma: np.ndarray  # (R, K) float32 [m], NaN where MISSING or not known
    joints: Tuple[str, ...] = MESSAGE_JOINTS  # names of the K joints

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def dimensions(self) -> int:
        """3 in space, 2 in the image."""
        return self.positions.shape[-1]

    def frame_id(self, source: str) -> str:
        """Return the frame of reference of all rows; empty: not known. BadInputError of a source: there are several."""
        names = sorted({*self.frame_ids.tolist()} - {''})
        if len(names) > 1:
            raise BadInputError(f"{source} has people in several frames of reference: {', '.join(map(repr, names))}; "
                                'give the people of one camera at a time')
        return names[0] if names else ''

    def select(self, rows: np.ndarray) -> 'KeypointTable':
        """Return the table of some rows, (R,) bool, or indices."""
        return replace(self, **{field.name: getattr(self, field.name)[rows] for field in fields(self)
                                if field.name != 'joints'})

    def of_person(self, person: int) -> 'KeypointTable':
        """Return the rows of a person in the order of time."""
        rows = np.flatnonzero(self.ids == person)
        return self.select(rows[np.argsort(self.stamps[rows], kind='stable')])

    def measured(self) -> 'KeypointTable':
        """Return the table without the positions that are not MEASURED, and their sigma."""
        measured = self.status == MEASURED
        return replace(self, positions=np.where(measured[..., None], self.positions, np.nan),
                       sigma=np.where(measured, self.sigma, np.nan))


def table_of(rows: Iterable[PersonRow], dimensions: int, source: str) -> KeypointTable:
    """Return the table of all rows, also sorted by people; without a stamp it is the %time of their frame's first row.

    Raises:
        BadInputError: the time runs back; the text names the source.
    """
    rows = list(rows)
    parts = np.array([row.parts for row in rows], np.float32).reshape(
        len(rows), len(MESSAGE_JOINTS), len(FIELDS[dimensions]))
    positions = parts[..., :dimensions].copy()
    confidence = np.where(np.isnan(parts[..., dimensions]), 0, parts[..., dimensions])
    known = np.isfinite(positions).all(axis=2)
    known &= confidence > 0 if dimensions == 2 else parts[..., 4] != MISSING
    positions[~known] = np.nan
    status = np.where(known, MEASURED if dimensions == 2 else parts[..., 4], MISSING).astype(np.uint8)
    sigma = np.where(known, np.nan if dimensions == 2 else parts[..., 5], np.nan).astype(np.float32)
    stamps = np.array([row.stamp or frame[0].time for frame in frames_of(rows) for row in frame], np.int64)
    ids = np.array([row.person for row in rows], np.int64)
    back, is_same = np.diff(stamps) < -PAIRING.reset_backstep, np.diff(ids) == 0
    if (back & is_same).any() or (back.any() and np.count_nonzero(~is_same) >= len(np.unique(ids))):
        row = int(np.argmax(back))
        raise BadInputError(f'{source}: time runs back by {(stamps[row] - stamps[row + 1]) * 1e-9:.3f} s after row '
                            f'{row + 1}, as where two recordings were appended; give each by itself')
    return KeypointTable(stamps, np.array([row.frame_id for row in rows], np.str_), ids, positions, confidence, status,
                         sigma)


def people_of_rows(rows: KeypointTable, model: SkeletonModel) -> People3D:
    """Return the people of a frame, one of each row, with the joints of a joint set that the table has."""
    columns = [rows.joints.index(joint) for joint in model.joints]
    return People3D(model, rows.positions[:, columns], rows.confidence[:, columns], rows.status[:, columns],
                    rows.sigma[:, columns], rows.ids)


def with_status(parts: np.ndarray) -> np.ndarray:
    """Return joints in space, (..., 6) float32, with a status also where it is NaN, as the recording does not have it.

    A joint is MEASURED where its position is known: finite, and not all zeros with confidence 0.
    """
    position, confidence, status = parts[..., :3], parts[..., 3], parts[..., 4]
    known = np.isfinite(position).all(axis=-1) & ((confidence != 0) | (position != 0).any(axis=-1))
    complete = parts.copy()
    complete[..., 4] = np.where(np.isnan(status), np.where(known, MEASURED, MISSING), status)
    complete[np.isnan(status) & ~known, :3] = np.nan
    return complete


def tidy_cells(part: Sequence[float], dimensions: int) -> Tuple[List[object], bool]:
    """Return the cells of a joint, values of `FIELDS`, in the long form, with the status as a word; is it known?"""
    if dimensions == 2:
        known = part[2] > 0
        return ([*part, STATUS_WORDS[MEASURED]] if known else [np.nan, np.nan, 0.0, STATUS_WORDS[MISSING]]), known
    *position, confidence, number, sigma = part
    return [*position, confidence, STATUS_WORDS.get(int(number), str(int(number))), sigma], int(number) != MISSING

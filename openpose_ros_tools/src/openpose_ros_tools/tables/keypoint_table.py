"""Keypoints of a recording: as rows in its order, one per person and frame, and as one table of arrays."""
from dataclasses import dataclass, fields
from itertools import islice
from typing import Dict, Iterable, Iterator, List, NamedTuple, Sequence, Set, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from skeleton_extract_3d.people import MEASURED, MISSING

# Fields of a joint in the order of openpose_ros_msgs/BodypartDetection and BodypartDetection_3d, by dimensions.
FIELDS: Dict[int, Tuple[str, ...]] = {2: ('x', 'y', 'confidence'),
                                      3: ('x', 'y', 'z', 'confidence', 'status', 'sigma')}
# A missing joint, as the messages have it.
MISSING_PART: Dict[int, Tuple[float, ...]] = {2: (0.0, 0.0, 0.0), 3: (np.nan, np.nan, np.nan, 0.0, MISSING, np.nan)}
# Rows without a stamp belong to one frame if they came within this time [ns]: a node sends the people of a frame in
# quick succession, and frames are at least 16 ms apart at 60 Hz.
_ONE_FRAME = 10 * 10 ** 6
BLOCK_ROWS = 1024
"""Number of rows that are converted at a time."""


class PersonRow(NamedTuple):
    """A person in a frame."""

    time: int  # column %time [ns]
    sequence: int  # of the header
    stamp: int  # of the header [ns]; 0: not known
    frame_id: str  # of the header
    number: int  # people in the frame
    person: int  # track id
    parts: Sequence[Sequence[float]] = ()  # (K, F) values of `FIELDS` for the K `MESSAGE_JOINTS`


class RowBlock(NamedTuple):
    """R successive rows; heads have no parts, which are in one array, (R, K, F) float32."""

    heads: List[PersonRow]
    parts: np.ndarray

    def rows(self) -> Iterator[PersonRow]:
        """Yield the rows."""
        return (head._replace(parts=parts) for head, parts in zip(self.heads, self.parts.tolist()))


class FrameSplitter:
    """Finds where frames begin, from rows in the order of the recording.

    The people of a frame have one stamp and different ids. Where the stamp is not known, as with the columns of the
    original, they have the same number of people and came within 10 ms.
    """

    def __init__(self) -> None:
        self._time = self._stamp = self._number = -1
        self._ids: Set[int] = set()

    def begins(self, time: int, stamp: int, number: int, person: int) -> bool:
        """Return whether this row, which follows the one of the last call, is the first of a frame.

        Args:
            stamp: [ns]; 0: not known.
        """
        same = stamp == self._stamp and person not in self._ids
        if not stamp:
            same = same and number == self._number and abs(time - self._time) <= _ONE_FRAME
        if not same:
            self._time, self._stamp, self._number = time, stamp, number
            self._ids = set()
        self._ids.add(person)
        return not same


@dataclass(frozen=True)
class KeypointTable:
    """The joints of people over time, one row per person and frame, in the order of the recording.

    The K joints are `MESSAGE_JOINTS`, whatever the network's joint set. In space D is 3 [m], in the image 2 [px].

    Raises:
        ValueError: an array has the wrong shape.
    """

    stamps: np.ndarray  # (R,) int64 [ns], of the image or cloud; rows of one frame have one stamp
    sequence: np.ndarray  # (R,) int64, header.seq
    frame_ids: np.ndarray  # (R,) str, frame of reference
    numbers: np.ndarray  # (R,) int64, people in the frame of that row
    ids: np.ndarray  # (R,) int64, track ids
    positions: np.ndarray  # (R, K, D) float32; NaN where missing
    confidence: np.ndarray  # (R, K) float32 [0..1] of the 2D detection
    # (R, K) uint8: MISSING, MEASURED or INFERRED of `skeleton_extract_3d.people`. Where the recording has no status, as
    # in 2D and with the original's columns, a joint with a position is MEASURED.
    status: np.ndarray
    sigma: np.ndarray  # (R, K) float32 [m], NaN where MISSING or not known

    def __post_init__(self) -> None:
        rows, joints = len(self.stamps), len(MESSAGE_JOINTS)
        kinds = {'stamps': np.int64, 'sequence': np.int64, 'frame_ids': np.str_, 'numbers': np.int64, 'ids': np.int64,
                 'positions': np.float32, 'confidence': np.float32, 'status': np.uint8, 'sigma': np.float32}
        for name, kind in kinds.items():
            value: np.ndarray = np.asarray(getattr(self, name), kind)
            expected = {'positions': (rows, joints, value.shape[-1]), 'confidence': (rows, joints),
                        'status': (rows, joints), 'sigma': (rows, joints)}.get(name, (rows,))
            if value.shape != expected or (name == 'positions' and value.shape[-1] not in (2, 3)):
                raise ValueError(f'{name}: expected {expected}, got {value.shape}')
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def joints(self) -> Tuple[str, ...]:
        """Names of the K joints."""
        return MESSAGE_JOINTS

    @property
    def dimensions(self) -> int:
        """3 in space, 2 in the image."""
        return self.positions.shape[-1]

    def select(self, rows: np.ndarray) -> 'KeypointTable':
        """Return the table of some rows, (R,) bool, or indices."""
        return KeypointTable(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})

    def of_person(self, person: int) -> 'KeypointTable':
        """Return the rows of one track id."""
        return self.select(self.ids == person)


def blocks_of(rows: Iterable[PersonRow]) -> Iterator[RowBlock]:
    """Yield the blocks of rows."""
    rows = iter(rows)
    for block in iter(lambda: list(islice(rows, BLOCK_ROWS)), []):
        yield RowBlock([row._replace(parts=()) for row in block], np.array([row.parts for row in block], np.float32))


def table_of(blocks: Iterable[RowBlock], dimensions: int) -> KeypointTable:
    """Return the table of all rows.

    Rows without a stamp get the %time of the first row of their frame.

    Args:
        dimensions: 3 in space, 2 in the image.
    """
    heads: List[PersonRow] = []
    pieces = [np.zeros((0, len(MESSAGE_JOINTS), len(FIELDS[dimensions])), np.float32)]
    for block in blocks:
        heads += block.heads
        pieces.append(block.parts)
    parts = np.concatenate(pieces)
    positions = parts[..., :dimensions].copy()
    confidence = np.where(np.isnan(parts[..., dimensions]), 0, parts[..., dimensions])
    known = np.isfinite(positions).all(axis=2)
    known &= confidence > 0 if dimensions == 2 else parts[..., 4] != MISSING
    status = np.where(known, MEASURED if dimensions == 2 else parts[..., 4], MISSING)
    sigma = np.where(known, np.nan if dimensions == 2 else parts[..., 5], np.nan)
    positions[~known] = np.nan
    sequence, frame_ids, numbers, ids = (np.array([getattr(head, name) for head in heads], kind) for name, kind in (
        ('sequence', np.int64), ('frame_id', np.str_), ('number', np.int64), ('person', np.int64)))
    return KeypointTable(np.array(_known_stamps(heads), np.int64), sequence, frame_ids, numbers, ids, positions,
                         confidence, status, sigma)


def complete_status(parts: np.ndarray, has_status: np.ndarray) -> None:
    """Fill in the status of joints in space where a recording does not have it.

    A joint is MEASURED where its position is known: finite, and not all zeros with confidence 0.

    Args:
        parts: (R, K, 6) float32, changed in place.
        has_status: (R, K) bool.
    """
    position, confidence = parts[..., :3], parts[..., 3]
    known = np.isfinite(position).all(axis=2) & ((confidence != 0) | (position != 0).any(axis=2))
    parts[..., 4] = np.where(has_status, parts[..., 4], np.where(known, MEASURED, MISSING))
    parts[~known & ~has_status, :3] = np.nan


def _known_stamps(heads: Iterable[PersonRow]) -> List[int]:
    """Return the stamp of each row; where it is 0, the time of the first row of that frame."""
    frames, known, began = FrameSplitter(), [], 0
    for head in heads:
        if frames.begins(head.time, head.stamp, head.number, head.person):
            began = head.time
        known.append(head.stamp or began)
    return known

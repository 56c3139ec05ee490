"""Keypoints as CSV: columns, writer and reader. One row per person and frame, or per joint in the long form.

Columns are named as `rostopic echo -p` names the fields of the per-person messages; see docs/recordings.md.
"""
import csv
import logging
import re
from array import array
from io import StringIO
from operator import itemgetter
from pathlib import Path
from typing import Iterator, List, NamedTuple, Sequence, TextIO, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.tables.keypoint_table import (
    FIELDS,
    MISSING_PART,
    FrameSplitter,
    KeypointTable,
    PersonRow,
    part_values,
    table_of,
    tidy_cells,
    with_one_clock,
    with_status,
)

_log = logging.getLogger(__name__)

LAYOUTS = ('original', 'extended', 'tidy')
# The messages of the original C++ project have these fields of the 18 parts of COCO, and the chest.
_ORIGINAL_FIELDS = ('x', 'y', 'z', 'confidence')
_ORIGINAL_JOINTS = MESSAGE_JOINTS[:MESSAGE_JOINTS.index('chest') + 1]
# Columns of a person, by field of PersonRow; the original has three of them.
_HEAD = {'time': '%time', 'sequence': 'field.header.seq', 'stamp': 'field.header.stamp',
         'frame_id': 'field.header.frame_id', 'number': 'field.num_people_detected', 'person': 'field.person_ID'}
_ORIGINAL_HEAD = ('time', 'number', 'person')
_PART_COLUMN = re.compile(rf'field\.({"|".join(MESSAGE_JOINTS)})\.({"|".join(FIELDS[3])})')
# Greatest whole numbers in the columns of a person: of times [ns] and of uint32, as in messages.
_MOST = {'time': 2 ** 32 * 10 ** 9 - 1, 'sequence': 2 ** 32 - 1, 'stamp': 2 ** 32 * 10 ** 9 - 1,
         'number': 2 ** 32 - 1, 'person': 2 ** 32 - 1}
_NO_PARTS = np.zeros((0, 0), np.float32)
# What pandas, R and spreadsheets write for a missing number.
_NOT_THERE = ('', 'NA', 'N/A', 'null')


def columns(layout: str, dimensions: int) -> List[str]:
    """Return the names of the columns.

    Args:
        layout: one of `LAYOUTS`.
        dimensions: 3 in space, 2 in the image.
    """
    if layout not in LAYOUTS:
        raise ValueError(f"layout '{layout}': expected one of {', '.join(LAYOUTS)}")
    if layout == 'tidy':
        return ['time', 'frame', 'frame_id', 'person_ID', 'joint',
                *(('x', 'y', 'confidence', 'status') if dimensions == 2 else FIELDS[dimensions])]
    head, joints, fields = _wide_layout(layout, dimensions)
    return [*(_HEAD[name] for name in head), *(f'field.{joint}.{field}' for joint in joints for field in fields)]


def _wide_layout(layout: str, dimensions: int) -> Tuple[Sequence[str], Sequence[str], Sequence[str]]:
    """Return the fields of PersonRow, the joints, and the fields of each joint in a layout of one row per person."""
    if layout == 'extended':
        return tuple(_HEAD), MESSAGE_JOINTS, FIELDS[dimensions]
    return _ORIGINAL_HEAD, _ORIGINAL_JOINTS, [field for field in FIELDS[dimensions] if field in _ORIGINAL_FIELDS]


def _wide(row: PersonRow, head: Sequence[str], joints: Sequence[str], fields: Sequence[str]) -> List[object]:
    return [*(getattr(row, name) for name in head),
            *(value for part in part_values(row)[:len(joints)] for value in part[:len(fields)])]


class KeypointCsvWriter:
    """Writes rows of people; numbers are printed as `rostopic echo -p` prints them.

    Args:
        handle: gets the names of the columns at once.
        layout: one of `LAYOUTS`.
        dimensions: 3 in space, 2 in the image.
        missing_joints: whether the long form (tidy) has rows for missing joints.
    """

    def __init__(self, handle: TextIO, layout: str, dimensions: int, missing_joints: bool = False) -> None:
        self.dimensions = dimensions
        self._rows = csv.writer(handle, lineterminator='\n')
        self._rows.writerow(columns(layout, dimensions))
        self._wide_layout = None if layout == 'tidy' else _wide_layout(layout, dimensions)
        self._missing_joints = missing_joints
        self._frames = FrameSplitter()
        self._frame = -1

    def write(self, rows: Sequence[PersonRow]) -> int:
        """Add people; return their number."""
        for row in rows:
            self._rows.writerows([_wide(row, *self._wide_layout)] if self._wide_layout else self._tidy(row))
        return len(rows)

    def _tidy(self, row: PersonRow) -> Iterator[List[object]]:
        self._frame += self._frames.begins(row)
        for joint, part in zip(MESSAGE_JOINTS, part_values(row)):
            cells, known = tidy_cells(part, self.dimensions)
            if known or self._missing_joints:
                yield [row.stamp or row.time, self._frame, row.frame_id, row.person, joint, *cells]


class KeypointCsv(NamedTuple):
    """The content of a CSV file of keypoints."""

    rows: List[PersonRow]  # in the order of the file
    dimensions: int  # 3 in space, 2 in the image
    has_stamps: bool  # there is a column of stamps


def read_csv(path: Path) -> KeypointCsv:
    """Read a CSV file of keypoints: columns of the original, extended, or of `rostopic echo -p`, in 2D or 3D.

    Columns are found by their names, in any order. Other columns are ignored, and joints may be missing. Lines that
    repeat the names are skipped. A last line without its end, as in a recording that was cut off, is dropped with a
    warning if it can not be read. A joint has the status of the file; without such a column it is MEASURED where its
    position is known.

    pandas would read it in fewer lines, but takes a line that was cut off for one with empty cells.

    Raises:
        BadInputError: the file is not there or contains something else; the text names line and column.
    """
    try:
        text = Path(path).read_bytes().decode('utf-8-sig', errors='replace')
    except OSError as error:
        raise BadInputError(f'{path}: {error.strerror}') from error
    return _Reader(Path(path), text).read()


def read_keypoint_csv(path: Path) -> KeypointTable:
    """Return the table of a CSV file of keypoints; see `read_csv` and `with_one_clock`."""
    file = read_csv(path)
    return with_one_clock(table_of(file.rows, file.dimensions), str(path))


class _Reader:
    """Reads a file; knows its columns, and the line that it is at, for errors."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self._cut_off = not text.endswith(('\n', '\r'))
        self._reader = csv.reader(StringIO(text, newline=''))
        self._names = self._read_names()
        self._place = {name: i for i, name in enumerate(self._names)}
        self._find_columns()

    def read(self) -> KeypointCsv:
        """Return the content of the file; errors as `read_csv`."""
        heads: List[PersonRow] = []
        values: List[array[float]] = []
        lines: List[int] = []
        for row in self._rows():
            try:
                head, numbers = self._parse(row)
            except BadInputError as error:
                if not self._cut_off or next(self._rows(), None) is not None:  # not the last line
                    raise
                _log.warning('the last line is dropped, as it was cut off: %s', error)
                break
            heads.append(head)
            values.append(numbers)
            lines.append(self._reader.line_num)
        rows = [head._replace(parts=parts) for head, parts in zip(heads, self._parts(values, lines))]
        return KeypointCsv(rows, self.dimensions, _HEAD['stamp'] in self._place)

    def _rows(self) -> Iterator[List[str]]:
        """Yield the rows that are neither empty nor names of columns."""
        try:
            for row in self._reader:
                if row and not (row[0].strip() == _HEAD['time'] and [name.strip() for name in row] == self._names):
                    yield row
        except csv.Error as error:
            raise self._error(str(error)) from error

    def _read_names(self) -> List[str]:
        try:
            names = [name.strip() for name in next(self._reader)]
        except StopIteration:
            raise BadInputError(f'{self.path} is empty, expected a line with the names of columns') from None
        except csv.Error as error:
            raise BadInputError(f'{self.path}, line 1: {error}; expected the names of columns') from error
        if names in (columns('tidy', 2), columns('tidy', 3)):
            raise BadInputError(f'{self.path} is in the long form (--tidy), expected one row per person: '
                                'keypoints_to_csv writes it without --tidy')
        if any(name.startswith('field.persons') for name in names):
            raise BadInputError(f'{self.path} is what rostopic echo -p makes of an array message, which has all people '
                                'in one row; echo the topic of single persons, or let keypoints_to_csv read the bag')
        return names

    def _find_columns(self) -> None:
        """Find the columns of the joints.

        Raises:
            BadInputError: a column is missing, or there twice.
        """
        found = [match for match in map(_PART_COLUMN.fullmatch, self._names) if match]
        self.dimensions = 3 if any(match[2] == 'z' for match in found) else 2
        fields = FIELDS[self.dimensions]
        present = {match[1] for match in found}
        joints = [joint for joint in MESSAGE_JOINTS if joint in present]
        needed = [*(_HEAD[name] for name in _ORIGINAL_HEAD),
                  *(f'field.{joint}.{field}' for joint in joints or ('nose',) for field in fields
                    if field in _ORIGINAL_FIELDS)]
        missing = [name for name in needed if name not in self._place]
        if missing:
            shown = ', '.join(missing[:4]) + (', ...' if len(missing) > 4 else '')
            raise BadInputError(f'{self.path}, line 1: no column {shown}; the first columns are '
                                f"{', '.join(self._names[:4])[:100]}")
        if len(self._place) < len(self._names):
            twice = next(name for i, name in enumerate(self._names) if self._place[name] != i)
            raise BadInputError(f"{self.path}, line 1: column '{twice}' is there twice")
        cells = [(k, f, self._place[name]) for k, joint in enumerate(MESSAGE_JOINTS) for f, field in enumerate(fields)
                 for name in [f'field.{joint}.{field}'] if name in self._place]
        self._joint_of, self._field_of, self._value_places = (list(column) for column in zip(*cells))
        self._values_of = itemgetter(*self._value_places)
        self._has_status = np.array([f'field.{joint}.status' in self._place for joint in MESSAGE_JOINTS])

    def _parse(self, row: List[str]) -> Tuple[PersonRow, 'array[float]']:
        if len(row) != len(self._names):
            raise self._error(f'{len(row)} values, expected {len(self._names)} as line 1 has names')
        frame_id = frame_name(row[self._place[_HEAD['frame_id']]]) if _HEAD['frame_id'] in self._place else ''
        head = PersonRow(frame_id=frame_id, parts=_NO_PARTS, **{name: self._whole(row, name) for name in _MOST})
        try:
            return head, array('f', map(float, self._values_of(row)))
        except ValueError:
            return head, array('f', [self._real(row, place) for place in self._value_places])

    def _whole(self, row: List[str], name: str) -> int:
        """Return the whole number in the column of a field of PersonRow, 0 without such a column."""
        if _HEAD[name] not in self._place:
            return 0
        text = row[self._place[_HEAD[name]]]
        try:
            value = int(text)
        except ValueError:
            value = -1
        if not 0 <= value <= _MOST[name]:
            raise self._error(f"expected a whole number from 0 to {_MOST[name]}, got '{text[:40]}'", _HEAD[name])
        return value

    def _real(self, row: List[str], place: int) -> float:
        text = row[place].strip()
        try:
            return np.nan if text in _NOT_THERE else float(text)
        except ValueError:
            raise self._error(f"expected a number, got '{text[:40]}'", self._names[place]) from None

    def _parts(self, values: 'Sequence[array[float]]', lines: Sequence[int]) -> np.ndarray:
        """Return the values of the joints of the rows in these lines, (R, K, F) float32."""
        parts = np.tile(np.array(MISSING_PART[self.dimensions], np.float32), (len(values), len(MESSAGE_JOINTS), 1))
        parts[:, self._joint_of, self._field_of] = np.frombuffer(b''.join(values), np.float32).reshape(
            len(values), len(self._value_places))
        if self.dimensions == 2:
            parts[np.isnan(parts).any(axis=2)] = MISSING_PART[2]
            return parts
        status = np.where(self._has_status, parts[..., 4], np.nan)
        wrong = np.argwhere(~np.isnan(status) & ~np.isin(status, np.arange(256)))
        if len(wrong):
            row, joint = wrong[0].tolist()
            raise self._error(f'expected a whole number from 0 to 255, got {status[row, joint]:g}',
                              f'field.{MESSAGE_JOINTS[joint]}.status', lines[row])
        return with_status(parts, ~np.isnan(status))

    def _error(self, text: str, column: str = '', line: int = 0) -> BadInputError:
        place = f", column '{column}'" if column else ''
        return BadInputError(f'{self.path}, line {line or self._reader.line_num}{place}: {text}')

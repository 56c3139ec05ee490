"""Keypoints as CSV: columns, writer and reader. One row per person and frame, or per joint in the long form.

Columns are named as `rostopic echo -p` names the fields of the per-person messages; see docs/csv_columns.md.
"""
import csv
import logging
import re
from array import array
from operator import itemgetter
from pathlib import Path
from typing import Iterator, List, Optional, Sequence, TextIO, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.tables.keypoint_table import (
    BLOCK_ROWS,
    FIELDS,
    MISSING_PART,
    FrameSplitter,
    KeypointTable,
    PersonRow,
    RowBlock,
    complete_status,
    table_of,
)
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING

_log = logging.getLogger(__name__)

LAYOUTS = ('original', 'extended', 'tidy')
# The messages of the original C++ project have these fields of the 18 parts of COCO, and the chest.
_ORIGINAL_FIELDS = ('x', 'y', 'z', 'confidence')
_ORIGINAL_JOINTS = MESSAGE_JOINTS[:MESSAGE_JOINTS.index('chest') + 1]
_STATUS_WORDS = {MISSING: 'missing', MEASURED: 'measured', INFERRED: 'inferred'}

_TIME, _NUMBER, _PERSON = '%time', 'field.num_people_detected', 'field.person_ID'
_SEQUENCE, _STAMP, _FRAME_ID = 'field.header.seq', 'field.header.stamp', 'field.header.frame_id'
_PART_COLUMN = re.compile(rf'field\.({"|".join(MESSAGE_JOINTS)})\.({"|".join(FIELDS[3])})')
# Limits of uint32 and of a time [ns], as in messages.
_MOST, _LATEST = 2 ** 32 - 1, 2 ** 32 * 10 ** 9 - 1
# What pandas, R and spreadsheets write for a missing number.
_NOT_THERE = ('', 'NA', 'N/A', 'null')


def columns(layout: str, dimensions: int) -> List[str]:
    """Return the names of the columns.

    Args:
        layout: one of `LAYOUTS`.
        dimensions: 3 in space, 2 in the image.
    """
    fields = FIELDS[dimensions]
    if layout == 'original':
        return [_TIME, _NUMBER, _PERSON, *(f'field.{joint}.{field}' for joint in _ORIGINAL_JOINTS
                                           for field in fields if field in _ORIGINAL_FIELDS)]
    if layout == 'extended':
        return [_TIME, _SEQUENCE, _STAMP, _FRAME_ID, _NUMBER, _PERSON,
                *(f'field.{joint}.{field}' for joint in MESSAGE_JOINTS for field in fields)]
    if layout == 'tidy':
        return ['time', 'frame', 'frame_id', 'person_ID', 'joint',
                *(('x', 'y', 'confidence', 'status') if dimensions == 2 else fields)]
    raise ValueError(f"layout '{layout}': expected one of {', '.join(LAYOUTS)}")


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
        self._handle = handle
        self._missing_joints = missing_joints
        self._fields = FIELDS[dimensions]
        self._text = {'original': self._original, 'extended': self._extended, 'tidy': self._tidy}[layout]
        self._frames = FrameSplitter()
        self._frame = -1
        handle.write(','.join(columns(layout, dimensions)) + '\n')

    def write(self, row: PersonRow) -> None:
        """Add a person."""
        self._handle.write(self._text(row))

    def _original(self, row: PersonRow) -> str:
        count = sum(field in _ORIGINAL_FIELDS for field in self._fields)
        values = [str(value) for part in row.parts[:len(_ORIGINAL_JOINTS)] for value in part[:count]]
        return f'{row.time},{row.number},{row.person},{",".join(values)}\n'

    def _extended(self, row: PersonRow) -> str:
        values = [str(int(value)) if field == 'status' else str(value)
                  for part in row.parts for field, value in zip(self._fields, part)]
        return (f'{row.time},{row.sequence},{row.stamp},{_quoted(row.frame_id)},{row.number},{row.person},'
                f'{",".join(values)}\n')

    def _tidy(self, row: PersonRow) -> str:
        self._frame += self._frames.begins(row.time, row.stamp, row.number, row.person)
        head = f'{row.stamp or row.time},{self._frame},{_quoted(row.frame_id)},{row.person}'
        lines = []
        for joint, part in zip(MESSAGE_JOINTS, row.parts):
            if len(part) == len(FIELDS[2]):
                x, y, confidence = part
                status = 'measured' if confidence > 0 else 'missing'
                values = [x, y, confidence, status] if confidence > 0 else [np.nan, np.nan, 0.0, status]
            else:
                x, y, z, confidence, number, sigma = part
                status = _STATUS_WORDS.get(int(number), str(int(number)))
                values = [x, y, z, confidence, status, sigma]
            if status != 'missing' or self._missing_joints:
                lines.append(f'{head},{joint},{",".join(map(str, values))}\n')
        return ''.join(lines)


class KeypointCsv:
    """A CSV file of keypoints that is read row by row: columns of the original, extended, or of `rostopic echo -p`.

    Columns are found by their names, in any order. Other columns are ignored, and joints may be missing. Lines that
    repeat the names are skipped. A last line without its end, as in a recording that was cut off, is dropped with a
    warning if it can not be read. Use it as a context manager.

    pandas would read it in fewer lines, but takes a line that was cut off for one with empty cells.

    Attributes:
        dimensions: 3 in space, 2 in the image.
        has_stamps: whether there is a column of stamps.
        characters: number of characters that are read, for a progress bar.

    Raises:
        BadInputError: the file can not be opened, or columns are missing.
    """

    def __init__(self, path: Path) -> None:
        self.path = Path(path)
        self.characters = 0
        try:
            self._cut_off = not _ends_with_newline(self.path)
            self._handle = self.path.open(newline='', encoding='utf-8-sig', errors='replace')
        except OSError as error:
            raise BadInputError(f'{self.path}: {error.strerror}') from error
        try:
            self._reader = csv.reader(self._counted())
            self._names = self._read_names()
            self._place = {name: i for i, name in enumerate(self._names)}
            self._find_columns()
        except BaseException:
            self._handle.close()
            raise
        self.has_stamps = _STAMP in self._place

    def __enter__(self) -> 'KeypointCsv':
        return self

    def __exit__(self, *_: object) -> None:
        self._handle.close()

    def rows(self) -> Iterator[PersonRow]:
        """Yield the people, in the order of the file; errors as `blocks`."""
        for block in self.blocks():
            yield from block.rows()

    def blocks(self) -> Iterator[RowBlock]:
        """Yield the people in blocks.

        A joint has the status of the file. Without such a column it is MEASURED where its position is known.

        Raises:
            BadInputError: a value can not be read; the text names line and column.
        """
        heads: List[PersonRow] = []
        values: List[array[float]] = []
        lines: List[int] = []
        for head, numbers in self._parsed():
            heads.append(head)
            values.append(numbers)
            lines.append(self._reader.line_num)
            if len(heads) == BLOCK_ROWS:
                yield RowBlock(heads, self._parts(values, lines))
                heads, values, lines = [], [], []
        if heads:
            yield RowBlock(heads, self._parts(values, lines))

    def _counted(self) -> Iterator[str]:
        for line in self._handle:
            self.characters += len(line)
            yield line

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
        needed = [_TIME, _NUMBER, _PERSON, *(f'field.{joint}.{field}' for joint in joints or ('nose',)
                                             for field in fields if field in _ORIGINAL_FIELDS)]
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

    def _parsed(self) -> Iterator[Tuple[PersonRow, 'array[float]']]:
        """Yield head and values of each row."""
        damaged: Optional[BadInputError] = None
        try:
            for row in self._reader:
                if damaged:  # not the last line
                    raise damaged
                if not row or (row[0].strip() == _TIME and [name.strip() for name in row] == self._names):
                    continue
                try:
                    parsed = self._parse(row)
                except BadInputError as error:
                    damaged = error
                    continue
                yield parsed
        except csv.Error as error:
            raise self._error(str(error)) from error
        if damaged and not self._cut_off:
            raise damaged
        if damaged:
            _log.warning('the last line is dropped, as it was cut off: %s', damaged)

    def _parse(self, row: List[str]) -> Tuple[PersonRow, 'array[float]']:
        if len(row) != len(self._names):
            raise self._error(f'{len(row)} values, expected {len(self._names)} as line 1 has names')
        frame_id = row[self._place[_FRAME_ID]] if _FRAME_ID in self._place else ''
        head = PersonRow(self._whole(row, _TIME, _LATEST), self._whole(row, _SEQUENCE, _MOST),
                       self._whole(row, _STAMP, _LATEST), frame_id, self._whole(row, _NUMBER, _MOST),
                       self._whole(row, _PERSON, _MOST))
        try:
            return head, array('f', map(float, self._values_of(row)))
        except ValueError:
            return head, array('f', [self._real(row, place) for place in self._value_places])

    def _whole(self, row: List[str], name: str, most: int) -> int:
        """Return the whole number in a column, 0 without such a column."""
        if name not in self._place:
            return 0
        text = row[self._place[name]]
        try:
            value = int(text)
        except ValueError:
            value = -1
        if not 0 <= value <= most:
            raise self._error(f"expected a whole number from 0 to {most}, got '{text[:40]}'", name)
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
        parts[:, self._joint_of, self._field_of] = np.frombuffer(b''.join(values), np.float32).reshape(len(values), -1)
        if self.dimensions == 2:
            parts[np.isnan(parts).any(axis=2)] = MISSING_PART[2]
            return parts
        status = np.where(self._has_status, parts[..., 4], np.nan)
        wrong = np.argwhere(~np.isnan(status) & ~np.isin(status, np.arange(256)))
        if len(wrong):
            row, joint = wrong[0].tolist()
            raise self._error(f'expected a whole number from 0 to 255, got {status[row, joint]:g}',
                              f'field.{MESSAGE_JOINTS[joint]}.status', lines[row])
        complete_status(parts, ~np.isnan(status))
        return parts

    def _error(self, text: str, column: str = '', line: int = 0) -> BadInputError:
        place = f", column '{column}'" if column else ''
        return BadInputError(f'{self.path}, line {line or self._reader.line_num}{place}: {text}')


def read_keypoint_csv(path: Path) -> KeypointTable:
    """Read a CSV file of keypoints: columns of the original, extended, or of `rostopic echo -p`, in 2D or 3D.

    Raises:
        BadInputError: the file is not there or contains something else; the text names line and column.
    """
    with KeypointCsv(path) as file:
        return table_of(file.blocks(), file.dimensions)


def _quoted(text: str) -> str:
    """Return a text as a field of CSV; one with a comma or a quote would be several fields."""
    return '"' + text.replace('"', '""') + '"' if any(sign in text for sign in ',"\r\n') else text


def _ends_with_newline(path: Path) -> bool:
    with path.open('rb') as handle:
        if not handle.seek(0, 2):
            return True
        handle.seek(-1, 2)
        return handle.read(1) in b'\r\n'

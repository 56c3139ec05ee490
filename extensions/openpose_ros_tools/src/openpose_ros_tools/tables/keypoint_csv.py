"""Keypoints as CSV: columns, writer and reader. One row per person and frame, or per joint in the long form.

Columns are named as `rostopic echo -p` names the fields of the per-person messages; see docs/recordings.md.
"""
import csv
import logging
import re
from io import StringIO
from pathlib import Path
from typing import Any, Dict, Iterable, Iterator, List, Sequence, TextIO, Tuple

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
# Greatest whole numbers, as in messages: of times [ns], and of uint32.
_LAST_TIME, _GREATEST = 2 ** 32 * 10 ** 9 - 1, 2 ** 32 - 1
# Types of the columns that are read.
_KINDS: Dict[str, Any] = {**dict.fromkeys(_HEAD.values(), str), **{
    f'field.{joint}.{field}': np.float64 for joint in MESSAGE_JOINTS for field in FIELDS[3]}}


def columns(layout: str, dimensions: int) -> List[str]:
    """Return the names of the columns of a layout, in space (3) or in the image (2)."""
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


class KeypointCsvWriter:
    """Writes rows of people, the names of the columns at once; numbers are printed as `rostopic echo -p` prints them.

    Args:
        layout, dimensions: as `columns`.
    """

    def __init__(self, handle: TextIO, layout: str, dimensions: int) -> None:
        self.dimensions = dimensions
        self._rows = csv.writer(handle, lineterminator='\n')
        self._rows.writerow(columns(layout, dimensions))
        self._wide_layout = None if layout == 'tidy' else _wide_layout(layout, dimensions)
        self._frames, self._frame = FrameSplitter(), -1

    def write(self, rows: Sequence[PersonRow]) -> int:
        """Add people; return their number."""
        for row in rows:
            if self._wide_layout is None:
                self._rows.writerows(self._tidy(row))
            else:
                head, joints, fields = self._wide_layout
                self._rows.writerow([*(getattr(row, name) for name in head), *(
                    value for part in part_values(row)[:len(joints)] for value in part[:len(fields)])])
        return len(rows)

    def _tidy(self, row: PersonRow) -> Iterator[List[object]]:
        self._frame += self._frames.begins(row)
        for joint, part in zip(MESSAGE_JOINTS, part_values(row)):
            cells, known = tidy_cells(part, self.dimensions)
            if known:
                yield [row.stamp or row.time, self._frame, row.frame_id, row.person, joint, *cells]


def read_keypoint_csv(path: Path) -> KeypointTable:
    """Return the table of a CSV file of keypoints; see `read_csv` and `table_of`."""
    return table_of(*read_csv(path), str(path))


def read_csv(path: Path) -> Tuple[List[PersonRow], int]:
    """Read a CSV file of keypoints: columns of the original, extended, or of `rostopic echo -p`, in 2D or 3D.

    Columns are found by their names, in any order. Other columns are ignored, and joints may be missing. Lines that
    repeat the names are skipped. A last line that breaks off, as in a recording that was cut off, is dropped with a
    warning. A joint has the status of the file; without such a column it is MEASURED where its position is known.

    Returns:
        Rows in the order of the file; 3 in space, 2 in the image.

    Raises:
        BadInputError: the file is not there or contains something else.
    """
    try:
        text = Path(path).read_bytes().decode('utf-8-sig', errors='replace')
    except OSError as error:
        raise BadInputError(f'{path}: {error.strerror}') from error
    lines = text.splitlines()
    try:
        names = [name.strip() for name in next(csv.reader(lines), [])]
        _check_names(path, names, bool(text))
        rows = {number: line for number, line in enumerate(lines, 1)
                if number == 1 or line.strip() not in ('', lines[0].strip())}
        try:
            return _content(path, _parsed(rows, names))
        except ValueError:
            if text.endswith(('\n', '\r')) or len(rows) == 1:
                raise
            _log.warning('%s: the last line, line %d, is dropped, as it was cut off', path, rows.popitem()[0])
            return _content(path, _parsed(rows, names))
    except (csv.Error, ValueError, OverflowError) as error:
        raise BadInputError(f'{path}: {error}') from error


def _parsed(rows: Dict[int, str], names: Sequence[str]) -> Any:
    """Return the known columns of lines by number, the first of names, as a data frame.

    Raises:
        ValueError: a line has more or fewer values, or one of another kind.
    """
    import pandas as pd
    for number, row in zip(rows, csv.reader(rows.values())):
        if len(row) != len(names):
            raise ValueError(f'line {number}: {len(row)} values, expected {len(names)} as line 1 has names')
    return pd.read_csv(StringIO('\n'.join(rows.values())), header=0, names=names, usecols=lambda name: name in _KINDS,
                       dtype=_KINDS, skipinitialspace=True, float_precision='round_trip')


def _check_names(path: Path, names: Sequence[str], has_text: bool) -> None:
    """Raise BadInputError if the columns are those of another table, a column is missing, or there twice."""
    if not has_text:
        raise BadInputError(f'{path} is empty, expected a line with the names of columns')
    joints = {match[1] for match in map(_PART_COLUMN.fullmatch, names) if match} or {'nose'}
    needed = [*(_HEAD[name] for name in _ORIGINAL_HEAD), *(
        f'field.{joint}.{field}' for joint in MESSAGE_JOINTS if joint in joints for field in FIELDS[_dimensions(names)]
        if field in _ORIGINAL_FIELDS)]
    missing = [name for name in needed if name not in names]
    if missing:
        raise BadInputError(f"{path}, line 1: no column {', '.join(missing[:4])}{', ...' * (len(missing) > 4)}; the "
                            f"first columns are {', '.join(names[:4])[:100]}. Expected is a row per person, as "
                            'keypoints_to_csv writes it without --tidy')
    twice = [name for number, name in enumerate(names) if names.index(name) != number]
    if twice:
        raise BadInputError(f"{path}, line 1: column '{twice[0]}' is there twice")


def _dimensions(names: Iterable[str]) -> int:
    return 3 if any(match and match[2] == 'z' for match in map(_PART_COLUMN.fullmatch, names)) else 2


def _content(path: Path, table: Any) -> Tuple[List[PersonRow], int]:
    """Return the content of a table; errors as `read_csv`."""
    dimensions, count = _dimensions(table.columns), len(table)
    heads: Dict[str, List[Any]] = {}
    for field, name in _HEAD.items():
        most = _LAST_TIME if field in ('time', 'stamp') else _GREATEST
        texts = table[name].fillna('').str.strip() if name in table else ['0'] * count
        if field == 'frame_id':
            heads[field] = [frame_name(text) for text in texts] if name in table else [''] * count
            continue
        wrong = [text for text in texts if not (text.isdecimal() and int(text) <= most)]
        if wrong:
            raise BadInputError(f"{path}, column '{name}': expected a whole number from 0 to {most}, got "
                                f"'{wrong[0][:40]}'")
        heads[field] = list(map(int, texts))
    names = [f'field.{joint}.{field}' for joint in MESSAGE_JOINTS for field in FIELDS[dimensions]]
    parts = table.reindex(columns=names).to_numpy(np.float32).reshape(count, len(MESSAGE_JOINTS), -1)
    if dimensions == 2:
        parts[np.isnan(parts).any(axis=2)] = MISSING_PART[2]
    else:
        if not (np.isnan(parts[..., 4]) | np.isin(parts[..., 4], range(256))).all():
            raise BadInputError(f'{path}: a status is no whole number from 0 to 255')
        parts[..., 3] = np.nan_to_num(parts[..., 3])
        parts = with_status(parts)
    return [PersonRow(parts=part, **dict(zip(heads, values)))
            for part, *values in zip(parts, *heads.values())], dimensions

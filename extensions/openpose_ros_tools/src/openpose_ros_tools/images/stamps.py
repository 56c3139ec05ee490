"""Time stamps of images: integer nanoseconds from text, in names and tables, and which stamps belong together."""
import re
from fractions import Fraction
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Sequence, Set, Tuple

import numpy as np

from openpose_ros_pkg.errors import BadInputError

SECOND = 1_000_000_000
# Nanoseconds of each unit.
UNITS = {'s': SECOND, 'ms': 1_000_000, 'us': 1_000, 'ns': 1}
# Stamps of ROS have 32-bit unsigned seconds; 0 means "no stamp".
STAMP_END = 2 ** 32 * SECOND
# Unix times between 1973 and 2286 [s]: the size of such a number determines its unit.
_EPOCH = (10 ** 8, 10 ** 10)
_NUMBER = re.compile(r'\d+(?:\.\d+)?')
# Exact fractions of numbers such as 1e5000000 take seconds and megabytes: longest text of a number, and its form.
_LONGEST = 60
_DECIMAL = re.compile(r'[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,2})?', re.ASCII)
_HEADER_UNIT = re.compile(r'\[(s|ms|us|ns)\]')
# Stream by the title of its column.
_COLUMNS = {'colour': 'colour', 'color': 'colour', 'rgb': 'colour', 'depth': 'depth', 'mask': 'mask', 'masks': 'mask'}


class StampTable(NamedTuple):
    """A table of stamps."""

    names: Optional[List[str]]  # of the frames; None where the table has only stamps, in the order of the frames
    # one mapping per frame from stream ('colour', 'depth', 'mask') to stamp [ns]; the key '' is for all
    stamps: List[Dict[str, int]]


def exact_number(text: str) -> Fraction:
    """Return a decimal number exactly.

    Raises:
        ValueError: the text is none, is longer than 60 characters, or its exponent has more than two digits.
    """
    text = text.strip()
    if len(text) > _LONGEST or not _DECIMAL.fullmatch(text):
        raise ValueError(f"'{text[:_LONGEST]}' is no number, or has too many digits")
    return Fraction(text)


def parse_stamp(text: str, unit: str) -> int:
    """Return a stamp, exactly rounded to nanoseconds.

    Args:
        unit: key of UNITS.

    Raises:
        ValueError: see `exact_number`.
    """
    return round(exact_number(text) * UNITS[unit])


def detect_unit(texts: Sequence[str]) -> Optional[str]:
    """Return the unit in which all of these numbers are times; None where they are no times, or the unit is not clear.

    A number with a fraction is in seconds; an integer has the unit that makes it a time between 1973 and 2286.
    """
    if not texts or not all(len(text) <= _LONGEST and _NUMBER.fullmatch(text) for text in texts):
        return None
    if all('.' in text for text in texts):
        return 's'
    values = [Fraction(text) for text in texts]
    for unit, nanoseconds in UNITS.items():
        least, end = (limit * SECOND // nanoseconds for limit in _EPOCH)
        if all(least <= value < end for value in values):
            return unit
    return None


def number_in_name(stem: str) -> str:
    """Return the last number, with its fraction, of a file name without suffix; empty if there is none."""
    numbers = _NUMBER.findall(stem)
    return numbers[-1] if numbers else ''


def read_stamp_table(path: Path, unit: Optional[str] = None) -> StampTable:
    """Read a table of stamps: one stamp a line, or names and stamps, separated by commas, semicolons or blanks.

    A line with the titles of the columns may come first. `colour`, `depth` and `mask` are stamps of that stream alone
    (empty: the frame has no such image); `[ns]` (or s, ms, us) names the unit.

    Args:
        unit: of the stamps; None: as the first line says, else by their size (see `detect_unit`).

    Raises:
        BadInputError: the file can not be read, or is no such table.
    """
    try:
        lines = [line.strip() for line in path.read_text().splitlines() if line.strip()]
    except (OSError, UnicodeDecodeError) as error:
        raise BadInputError(f'stamps {path} can not be read: {error}') from error
    # the first line with a number: what comes before are titles or remarks
    first = next((i for i, line in enumerate(lines) if any(map(_NUMBER.fullmatch, _cells(line)))), len(lines))
    header = lines[first - 1] if first else ''
    rows = [_cells(line) for line in lines[first:] if not line.startswith('#')]
    if not rows:
        raise BadInputError(f'stamps {path}: the table is empty')
    widths = sorted({len(row) for row in rows})
    if len(widths) > 1:
        raise BadInputError(f'stamps {path}: lines have {widths[0]} to {widths[-1]} columns, expected the same number')
    name_column, stamp_columns = _columns(path, header, rows)
    texts = [row[column] for row in rows for column in stamp_columns if row[column]]
    in_header = _HEADER_UNIT.search(header)
    unit = unit or (in_header.group(1) if in_header else detect_unit(texts))
    if unit is None:
        raise BadInputError(f'stamps {path}: the unit of {texts[0] if texts else "nothing"} can not be told; give '
                            f"--stamp-unit {' or '.join(UNITS)}")
    names = None if name_column is None else [row[name_column] for row in rows]
    try:
        stamps = [{stream: parse_stamp(row[column], unit) for column, stream in stamp_columns.items() if row[column]}
                  for row in rows]
    except ValueError as error:
        raise BadInputError(f'stamps {path}: {error}') from None
    return StampTable(names, stamps)


def associate(first: Sequence[int], second: Sequence[int], max_difference: int) -> List[Tuple[int, int]]:
    """Return which stamps of two streams belong together: the nearest pairs first, each stamp in at most one pair.

    The method of the TUM RGB-D benchmark (associate.py); a nearest-neighbour join could use a stamp twice.

    Args:
        first, second: ascending [ns].
        max_difference: of a pair [ns].

    Returns:
        Pairs of indices, ascending.
    """
    other = np.array(second, np.int64)
    starts = np.searchsorted(other, np.array(first, np.int64) - max_difference, 'left')
    ends = np.searchsorted(other, np.array(first, np.int64) + max_difference, 'right')
    candidates = sorted((abs(stamp - second[j]), i, j) for i, (stamp, start, end) in enumerate(zip(first, starts, ends))
                        for j in range(start, end))
    of_first: Dict[int, int] = {}
    taken: Set[int] = set()
    for _, i, j in candidates:
        if i not in of_first and j not in taken:
            of_first[i] = j
            taken.add(j)
    return sorted(of_first.items())


def _cells(line: str) -> List[str]:
    cells = re.split('[,;\t]', line) if re.search('[,;\t]', line) else line.split()
    return [cell.strip() for cell in cells]


def _columns(path: Path, header: str, rows: List[List[str]]) -> Tuple[Optional[int], Dict[int, str]]:
    """Return the column of names (None: there is none), and the stream of each column of stamps."""
    width = len(rows[0])
    titles = [_HEADER_UNIT.sub('', title).strip().lower() for title in _cells(header.lstrip('#').strip())]
    of_streams = {column: _COLUMNS[title] for column, title in enumerate(titles[:width]) if title in _COLUMNS}
    if of_streams and 0 not in of_streams:
        return 0, of_streams
    if width == 1:
        return None, {0: ''}
    if width == 2:
        # the stamps come first in the tables of the EuRoC data set; names are not only digits
        column = 1 if any(not _NUMBER.fullmatch(row[1]) for row in rows) else 0
        return column, {1 - column: ''}
    raise BadInputError(f"stamps {path}: {width} columns, expected one (stamp), two (name, stamp), or a first line "
                        "with the titles 'frame, colour, depth, mask'")

"""Encodings, tables of numbers and units of text formats."""
import codecs
import logging
from pathlib import Path
from typing import Dict, List, Sequence

import numpy as np

from openpose_ros_pkg.errors import BadInputError

_log = logging.getLogger(__name__)

# Names of length units, in lower case, and their size [m].
UNITS: Dict[str, float] = {
    'm': 1.0, 'meters': 1.0, 'metres': 1.0, 'cm': 0.01, 'centimeters': 0.01, 'centimetres': 0.01, 'mm': 0.001,
    'millimeters': 0.001, 'millimetres': 0.001}
_BINARY = {chr(code) for code in range(9)}  # control characters that no text holds


def decode(path: Path, content: bytes) -> str:
    """Return a file's text with '\\n' at the end of lines.

    UTF-8 and UTF-16 with their byte order marks, UTF-8 without, else Latin-1, as older Windows programs write.

    Raises:
        BadInputError: it is no text.
    """
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        text = content.decode('utf-16', errors='replace')
    else:
        try:
            text = content.decode('utf-8-sig')
        except UnicodeDecodeError:
            text = content.decode('latin-1')
    if _BINARY & set(text[:4096]):
        raise BadInputError(f'{path} is a binary file, expected text')
    return text.replace('\r\n', '\n').replace('\r', '\n')


def metres_in(path: Path, unit: str) -> float:
    """Return the size of a length unit [m].

    Raises:
        BadInputError: it is none of `UNITS`.
    """
    size = UNITS.get(unit.strip().lower())
    if size is None:
        raise BadInputError(f"{path} has lengths in '{unit.strip()}', expected one of {', '.join(UNITS)}")
    return size


def read_numbers(path: Path, lines: Sequence[str], first: int, separator: str, columns: Sequence[int],
                 may_be_short: bool = False) -> np.ndarray:
    """Return columns of the rows of a table; empty cells are NaN.

    A last line that breaks off, as when the export was interrupted, is dropped with a warning.

    Args:
        lines: of the whole file.
        first: index of the first row; empty lines are skipped from there on.
        columns: to return, from 0.
        may_be_short: whether empty cells at the end of a row may be left out.

    Returns:
        (rows, columns) float64.

    Raises:
        BadInputError: a row is too short or holds something else.
    """
    filled = [number for number in range(first, len(lines)) if lines[number].strip()]
    rows: List[List[float]] = []
    for number in filled:
        cells = lines[number].split(separator)
        if may_be_short and number < len(lines) - 1:  # the line is whole: a line end follows it
            cells += [''] * (max(columns) + 1 - len(cells))
        try:
            rows.append(_numbers(cells, columns))
        except ValueError as error:
            if number != filled[-1]:
                raise BadInputError(f'{path}, line {number + 1}: {error}') from error
            _log.warning('%s breaks off: its last line, %d, is left out (%s)', path, number + 1, error)
    return np.array(rows, np.float64).reshape(len(rows), len(columns))


def _numbers(cells: Sequence[str], columns: Sequence[int]) -> List[float]:
    """Return the numbers in some cells of a row; raise ValueError where there are none."""
    if len(cells) <= max(columns):
        raise ValueError(f'has {len(cells)} cells, expected {max(columns) + 1}')
    try:
        return [float(cells[column].strip() or 'nan') for column in columns]
    except ValueError as error:
        comma = any(',' in cell for cell in cells)
        raise ValueError(f'holds something that is no number: {error}'
                         + "; decimal commas can not be read, export with '.'" * comma) from error

"""What the readers of text formats share: encodings, tables of numbers, units."""
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
_BINARY = tuple(chr(code) for code in range(9))  # control characters that no text holds


def decode(path: Path, content: bytes) -> str:
    """Return a file's text with '\\n' at the end of lines.

    UTF-8 and UTF-16 with their byte order marks, UTF-8 without, else Latin-1, as older Windows programs write.

    Raises:
        BadInputError: it is no text.
    """
    encodings = ['utf-16'] if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else ['utf-8-sig',
                                                                                                   'latin-1']
    for encoding in encodings:
        try:
            text = content.decode(encoding)
            break
        except UnicodeDecodeError:
            continue
    else:
        raise BadInputError(f'{path} starts like UTF-16 text, but can not be decoded as such')
    if any(character in text[:4096] for character in _BINARY):
        raise BadInputError(f'{path} is a binary file, expected text')
    return text.replace('\r\n', '\n').replace('\r', '\n')


def metres_in(path: Path, unit: str) -> float:
    """Return the size of a length unit [m].

    Raises:
        BadInputError: it is none of `UNITS`.
    """
    try:
        return UNITS[unit.strip().lower()]
    except KeyError:
        raise BadInputError(f"{path} has lengths in '{unit.strip()}', expected one of {', '.join(UNITS)}") from None


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
    rows: List[np.ndarray] = []
    needed = max(columns) + 1
    for number in filled:
        cells = lines[number].split(separator)
        at_end_of_file = number == len(lines) - 1  # no line end after it
        fault = ''
        if len(cells) < needed:
            if may_be_short and not at_end_of_file:
                cells += [''] * (needed - len(cells))
            else:
                fault = f'has {len(cells)} cells, expected {needed}'
        if not fault:
            try:
                rows.append(np.array([float(cell) if cell and not cell.isspace() else np.nan
                                      for cell in map(cells.__getitem__, columns)]))
                continue
            except ValueError as error:
                fault = f'holds what is no number: {error}'
                if separator != ',' and any(',' in cell for cell in cells):
                    fault += "; decimal commas can not be read, export with '.'"
        if number != filled[-1]:
            raise BadInputError(f'{path}, line {number + 1}: {fault}')
        _log.warning('%s breaks off: its last line, %d, is left out (%s)', path, number + 1, fault)
    return np.array(rows).reshape(len(rows), len(columns))

"""Time stamps of images: integer nanoseconds from and to text, and which stamps belong together."""
from decimal import Decimal
from typing import Dict, List, Sequence, Set, Tuple

import numpy as np

SECOND = 1_000_000_000
# Stamps of ROS have 32-bit unsigned seconds; 0 means "no stamp".
STAMP_END = 2 ** 32 * SECOND
# Maximum difference of the stamps of a frame [ns]; associate.py of the TUM RGB-D benchmark.
MAX_DIFFERENCE = SECOND // 50


def parse_stamp(text: str) -> int:
    """Return the stamp [ns] of a decimal number [s], exactly rounded.

    Raises:
        ValueError: the text is not a number from 0 to below 2^32.
    """
    try:
        value = Decimal(text.strip())
        if 0 <= value < 2 ** 32:
            return int((value * SECOND).to_integral_value())
    except ArithmeticError:
        pass
    raise ValueError(f"'{text[:40]}' is not a number of seconds from 0 to below 2^32")


def seconds_text(stamp: int) -> str:
    """Return a stamp [ns] in seconds, with nine decimals."""
    return f'{stamp // SECOND}.{stamp % SECOND:09d}'


def associate(first: Sequence[int], second: Sequence[int], max_difference: int = MAX_DIFFERENCE
              ) -> List[Tuple[int, int]]:
    """Associate two streams: the nearest pairs first, each stamp in at most one pair.

    The method of associate.py of the TUM RGB-D benchmark.

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

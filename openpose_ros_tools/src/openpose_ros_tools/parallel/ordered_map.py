"""A function of many items, computed by threads, with few items in memory at once."""
import os
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Callable, Deque, Iterable, Iterator, Optional, TypeVar

Item = TypeVar('Item')
Result = TypeVar('Result')
# Pictures are read and written mostly outside of Python's lock; more threads than this wait for the one that goes on.
_MOST_THREADS = 4


def ordered_map(function: Callable[[Item], Result], items: Iterable[Item], threads: Optional[int] = None
                ) -> Iterator[Result]:
    """Yield function(item) of each item, in their order; an exception is raised when its item's turn comes.

    Args:
        items: iterated in the caller's thread, one item per thread, and one more, ahead of the results.
        threads: None: one per core, up to four.
    """
    threads = threads or min(_MOST_THREADS, os.cpu_count() or 1)
    waiting: Deque[Future] = deque()
    with ThreadPoolExecutor(threads) as pool:
        try:
            for item in items:
                waiting.append(pool.submit(function, item))
                if len(waiting) > threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()

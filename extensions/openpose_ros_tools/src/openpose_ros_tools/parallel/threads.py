"""Work that threads do ahead, with a limited number of items in memory."""
import itertools
import os
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from typing import Any, Callable, Deque, Generator, Iterable, Optional, TypeVar

Item = TypeVar('Item')
Result = TypeVar('Result')
# Reading and writing images mostly releases Python's lock; with more than four threads it becomes the bottleneck.
_MOST_THREADS = 4
_END: Any = object()


def ordered_map(function: Callable[[Item], Result], items: Iterable[Item], threads: Optional[int] = None,
                ahead: Optional[int] = None) -> Generator[Result, None, None]:
    """Yield function(item) of each item, in their order; an exception is raised when its item's turn comes.

    Close the generator to end the threads.

    Args:
        items: iterated in the caller's thread.
        threads: None: one per core, at most four.
        ahead: number of results that are computed before they are asked for; None: one per thread.
    """
    threads = threads or min(_MOST_THREADS, os.cpu_count() or 1)
    ahead = threads if ahead is None else ahead
    waiting: Deque[Future[Result]] = deque()
    with ThreadPoolExecutor(threads) as pool:
        try:
            for item in items:
                waiting.append(pool.submit(function, item))
                if len(waiting) > ahead:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


def prefetched(items: Iterable[Item], ahead: int) -> Generator[Item, None, None]:
    """Yield the items, which another thread reads; an exception that it meets is raised here.

    Close the generator to end the thread: it ends after the item that it is reading.

    Args:
        ahead: number of items that are read before they are asked for.
    """
    iterator = iter(items)
    with closing(ordered_map(lambda _: next(iterator, _END), itertools.repeat(None), 1, ahead)) as results:
        for item in results:
            if item is _END:
                return
            yield item

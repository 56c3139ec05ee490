"""Read ahead in a thread of its own."""
import queue
import threading
from typing import Any, Iterable, Iterator, Optional, Tuple, TypeVar

Item = TypeVar('Item')
_END = object()


def prefetched(items: Iterable[Item], ahead: int) -> Iterator[Item]:
    """Yield the items, of which a thread makes up to so many ahead; an exception that it meets is raised here.

    Close the generator to end the thread: it ends when the item is made that it is at.
    """
    ready: queue.Queue[Tuple[Any, Optional[BaseException]]] = queue.Queue(ahead)
    stopped = threading.Event()

    def put(item: Any, error: Optional[BaseException] = None) -> None:
        while not stopped.is_set():
            try:
                ready.put((item, error), timeout=0.1)
                return
            except queue.Full:
                continue

    def read() -> None:
        try:
            for item in items:
                put(item)
                if stopped.is_set():
                    return
            put(_END)
        except BaseException as error:
            put(_END, error)

    thread = threading.Thread(target=read, name='read ahead', daemon=True)
    thread.start()
    try:
        while True:
            item, error = ready.get()
            if error is not None:
                raise error
            if item is _END:
                return
            yield item
    finally:
        stopped.set()
        thread.join()

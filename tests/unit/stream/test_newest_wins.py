"""The worker keeps callbacks short: it works on the newest item and survives errors."""
import threading

from openpose_ros_pkg.stream.frame_loop import NewestWinsWorker

TIMEOUT = 30.0


def test_older_items_are_replaced_while_the_worker_is_busy():
    started, go, done = threading.Event(), threading.Event(), threading.Event()
    seen = []

    def work(item):
        seen.append(item)
        started.set()
        assert go.wait(TIMEOUT)
        if item == 'newest':
            done.set()

    worker = NewestWinsWorker(work, on_error=seen.append, name='test')
    worker.submit('first')
    assert started.wait(TIMEOUT)
    for item in ('old', 'older than newest', 'newest'):
        worker.submit(item)
    go.set()
    assert done.wait(TIMEOUT)
    worker.stop()
    assert (seen, worker.replaced) == (['first', 'newest'], 2)

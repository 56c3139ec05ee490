"""Images are searched in the background: the newest of each camera, until another thread wants the networks."""
import threading
import time

from openpose_ros_pkg.stream.fair_lock import FairLock
from openpose_ros_pkg.stream.later_search import LaterSearch

TIMEOUT = 30.0


def wait_for(condition):
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.001)


def test_the_newest_image_of_each_camera_is_searched_after_those_that_compute():
    lock, searched, errors = FairLock(), [], []

    def search(item, wanted):
        assert not wanted(0.0)
        searched.append(item)
        if item == 'fails':
            raise ValueError(item)

    later = LaterSearch(search, lock, errors.append)
    with lock:
        for camera, item in (('left', 'left 1'), ('right', 'fails'), ('left', 'left 2')):
            later.submit(camera, item)
    wait_for(lambda: len(errors) == 1)
    later.stop()
    assert searched == ['left 2', 'fails']


def test_a_thread_that_wants_the_networks_interrupts():
    lock, begun, ended = FairLock(), threading.Event(), threading.Event()

    def search(item, wanted):
        begun.set()
        wait_for(lambda: wanted(0.0))
        ended.set()

    later = LaterSearch(search, lock, print)
    later.submit('camera', 'image')
    assert begun.wait(TIMEOUT)
    with lock:
        assert ended.is_set()
    later.stop()


def test_a_search_that_waits_for_the_networks_ends_no_other_one():
    lock, calls = FairLock(), []
    later = LaterSearch(lambda item, wanted: calls.append(item), lock, print)
    with lock:
        later.submit('camera', 'image')
        wait_for(lambda: len(lock._waiting) == 1)
        assert not lock.wanted
        other = threading.Thread(target=lambda: (lock.acquire(), lock.release()))
        other.start()
        wait_for(lambda: lock.wanted)
    other.join(TIMEOUT)
    wait_for(lambda: calls == ['image'])
    later.stop()

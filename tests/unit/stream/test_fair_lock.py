"""The lock goes to the thread that has waited longest."""
import threading
import time

import pytest

from openpose_ros_pkg.stream.fair_lock import FairLock

TIMEOUT = 30.0


def waiting(lock, number):
    """Wait until so many threads wait for the lock."""
    deadline = time.monotonic() + TIMEOUT
    while len(lock._waiting) < number:
        assert time.monotonic() < deadline
        time.sleep(0.001)


def test_threads_that_ask_again_at_once_take_turns_one_at_a_time():
    lock, turns, inside, rounds, users = FairLock(), [], [], 20, 3

    def use(name):
        for number in range(rounds):
            with lock:
                inside.append(name)
                assert inside == [name]
                turns.append(name)
                if number < rounds - 1:  # in the last round, some threads have ended
                    waiting(lock, users - 1)
                inside.remove(name)

    threads = [threading.Thread(target=use, args=(name,)) for name in range(users)]
    with lock:
        for number, thread in enumerate(threads, 1):
            thread.start()
            waiting(lock, number)
    for thread in threads:
        thread.join(TIMEOUT)
    assert turns == [number % users for number in range(rounds * users)]


def test_it_is_released_after_an_exception_and_only_when_held():
    lock = FairLock()
    with pytest.raises(ValueError, match='inside'), lock:
        raise ValueError('inside')
    with lock:
        pass
    with pytest.raises(RuntimeError, match='not held'):
        lock.release()

"""The lock goes to the one that has waited longest."""
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


def test_nobody_else_wants_it():
    lock = FairLock()
    for _ in range(3):
        with lock:
            pass


def test_those_who_wait_get_it_in_their_order():
    lock, order, threads = FairLock(), [], []

    def use(name):
        with lock:
            order.append(name)

    with lock:
        for number, name in enumerate('abcde', 1):
            threads.append(threading.Thread(target=use, args=(name,)))
            threads[-1].start()
            waiting(lock, number)
        assert order == []
    for thread in threads:
        thread.join(TIMEOUT)
    assert order == list('abcde')


@pytest.mark.parametrize('users', [2, 3])
def test_users_that_never_rest_take_turns(users):
    """Who gives it back and asks again at once comes after those who wait."""
    lock, turns, rounds = FairLock(), [], 20

    def use(name):
        for number in range(rounds):
            with lock:
                turns.append(name)
                if number < rounds - 1:  # in the last round, some have ended
                    waiting(lock, users - 1)

    threads = [threading.Thread(target=use, args=(name,)) for name in range(users)]
    with lock:
        for number, thread in enumerate(threads, 1):
            thread.start()
            waiting(lock, number)
    for thread in threads:
        thread.join(TIMEOUT)
    assert turns == [number % users for number in range(rounds * users)]


def test_only_one_at_a_time():
    lock, inside, most = FairLock(), [], []

    def use():
        for _ in range(50):
            with lock:
                inside.append(1)
                most.append(len(inside))
                time.sleep(0)
                inside.pop()

    threads = [threading.Thread(target=use) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(TIMEOUT)
    assert len(most) == 200 and max(most) == 1


def test_it_is_given_back_after_an_exception():
    lock = FairLock()
    with pytest.raises(ValueError, match='inside'), lock:
        raise ValueError('inside')
    with lock:
        pass


def test_release_without_holding():
    with pytest.raises(RuntimeError, match='not held'):
        FairLock().release()

"""Reading ahead changes nothing but when it is read."""
import itertools
import threading

import pytest

from openpose_ros_tools.parallel.prefetch import prefetched


@pytest.mark.parametrize('count', [0, 1, 10])
def test_all_items_come_in_order(count):
    assert list(prefetched(iter(range(count)), 2)) == list(range(count))


def test_it_reads_ahead_but_not_further_than_it_may():
    read, three = [], threading.Event()

    def items():
        for number in range(100):
            read.append(number)
            if number == 3:
                three.set()
            yield number

    ahead = prefetched(items(), 2)
    assert next(ahead) == 0
    # one is handed over, two wait, one is in the hands of the thread
    assert three.wait(5)
    assert not [number for number in read if number > 3]
    ahead.close()


def test_an_error_comes_after_the_items_before_it():
    def items():
        yield 1
        raise ValueError('damaged')

    ahead = prefetched(items(), 2)
    assert next(ahead) == 1
    with pytest.raises(ValueError, match='damaged'):
        next(ahead)


def test_closing_ends_the_thread():
    before = threading.active_count()
    ahead = prefetched(itertools.count(), 2)
    next(ahead)
    ahead.close()
    assert threading.active_count() == before

"""Work of threads: order, errors at their turn, few items at once; reading ahead changes only when items are read."""
import threading

import pytest

from openpose_ros_tools.parallel.threads import ordered_map, prefetched


def test_few_items_are_taken_ahead():
    taken = []

    def items():
        for item in range(100):
            taken.append(item)
            yield item

    for done, _ in enumerate(ordered_map(lambda item: item, items(), threads=2)):
        assert len(taken) <= done + 4


# ---- reading ahead


def test_it_reads_ahead_but_not_further_than_it_may():
    read, three = [], threading.Event()

    def items():
        for number in range(100):
            read.append(number)
            if number == 3:
                three.set()
            yield number

    ahead = prefetched(items(), 3)
    assert next(ahead) == 0
    # one is handed over, three are ahead
    assert three.wait(60) and max(read) == 3
    ahead.close()


def test_an_error_comes_after_the_items_before_it():
    def items():
        yield 1
        raise ValueError('damaged')

    ahead = prefetched(items(), 2)
    assert next(ahead) == 1
    with pytest.raises(ValueError, match='damaged'):
        next(ahead)

"""Maps with threads: order, errors at their turn, few items at once."""
import threading

import pytest

from openpose_ros_tools.parallel.ordered_map import ordered_map


@pytest.mark.parametrize('count', [0, 1, 2, 50])
@pytest.mark.parametrize('threads', [1, 3, None])
def test_results_come_in_order(count, threads):
    assert list(ordered_map(lambda item: item * item, range(count), threads)) == [item * item for item in range(count)]


def test_few_items_are_taken_ahead():
    taken = []

    def items():
        for item in range(100):
            taken.append(item)
            yield item

    for done, _ in enumerate(ordered_map(lambda item: item, items(), threads=2)):
        assert len(taken) <= done + 4


def test_an_error_is_raised_at_its_turn_and_ends_the_threads():
    def fails_at_five(item):
        if item == 5:
            raise ValueError('five')
        return item

    before = threading.active_count()
    found = []
    with pytest.raises(ValueError, match='five'):
        found.extend(ordered_map(fails_at_five, range(100), threads=2))
    assert threading.active_count() == before

"""Gated assignment: the most pairs, then the least sum of costs, and no forbidden pair."""
import itertools

import numpy as np
import pytest

from openpose_ros_pkg.assignment import match


@pytest.mark.parametrize('shape', [(0, 0), (0, 3), (3, 0)])
def test_nothing_matches_nothing(shape):
    assert match(np.zeros(shape), np.ones(shape, bool)) == []


def test_no_pair_is_returned_where_none_is_allowed():
    assert match(np.full((2, 3), np.nan), np.zeros((2, 3), bool)) == []


def test_the_nearest_gives_way_where_the_other_row_has_no_other_column():
    allowed = np.array([[True, True], [True, False]])
    assert match(np.array([[0.1, 0.9], [0.2, np.inf]]), allowed) == [(0, 1), (1, 0)]


@pytest.mark.parametrize('seed', range(5))
def test_as_many_pairs_as_can_be_with_the_least_sum(seed):
    random = np.random.RandomState(seed)
    costs, allowed = random.rand(4, 5), random.rand(4, 5) < 0.5
    columns = list(itertools.permutations(range(5), 4))
    best = min(columns, key=lambda choice: sum(costs[i, j] if allowed[i, j] else 1e3 for i, j in enumerate(choice)))
    assert match(costs, allowed) == [(i, j) for i, j in enumerate(best) if allowed[i, j]]

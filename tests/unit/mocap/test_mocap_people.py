"""People are paired by least distance."""

import numpy as np
import pytest

from openpose_ros_tools.alignment.people import pair_people

RATE = 15


@pytest.mark.parametrize('people, others, gate, expected', [
    ([], [0.0], 1, []), ([0.0], [], 1, []), ([0.0], [2.0], 1, []), ([0.0], [2.0], [4.0], [(0, 0)]),
    ([0.1, 1.1], [1.0, 0.0], 0.5, [(0, 1), (1, 0)]), ([np.nan, 1.0], [1.0, 1.2], 0.5, [(1, 0)])])
def test_pairs(people, others, gate, expected):
    points = [np.array(places, float).reshape(-1, 1, 1) + np.zeros((1, 4, 3)) for places in (people, others)]
    assert pair_people(*points, np.array(gate)) == expected

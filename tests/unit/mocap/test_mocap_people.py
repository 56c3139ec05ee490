"""People are paired by least distance, and followed by place where their ids do not stay with them."""
import dataclasses

import numpy as np
import pytest

from openpose_ros_tools.alignment.alignment import align
from openpose_ros_tools.alignment.people import pair_people, steady_ids
from simulated_mocap import errors, simulate, walkers

RATE = 15


@pytest.mark.parametrize('people, others, gate, expected', [
    ([], [0.0], 1, []), ([0.0], [], 1, []), ([0.0], [2.0], 1, []), ([0.0], [2.0], [4.0], [(0, 0)]),
    ([0.1, 1.1], [1.0, 0.0], 0.5, [(0, 1), (1, 0)]), ([np.nan, 1.0], [1.0, 1.2], 0.5, [(1, 0)])])
def test_pairs(people, others, gate, expected):
    points = [np.array(places, float).reshape(-1, 1, 1) + np.zeros((1, 4, 3)) for places in (people, others)]
    assert pair_people(*points, np.array(gate)) == expected


def test_numbers_in_a_frame_become_ids():
    """Two people pass each other 0.7 m apart; a third is away for 4 frames, then for a second."""
    third = np.full(40, 5.0)
    third[10:14] = third[20:35] = np.nan
    places = np.array([np.linspace(0, 2, 40), np.linspace(2, 0, 40), third]).T
    frame, person = np.nonzero(np.isfinite(places))
    times, positions = frame / RATE, places[frame, person][:, None, None] * (1, 0, 0) + np.eye(3)
    positions[person == 1, :, 1] += 0.7
    np.testing.assert_array_equal(steady_ids(times, 7 + person, positions), 7 + person)  # ids that stay are kept
    order = np.lexsort((np.random.RandomState(0).uniform(size=len(times)), times))
    number = np.concatenate([np.arange((times == time).sum()) for time in np.unique(times)])
    found = steady_ids(times[order], number, positions[order])
    assert {tuple(sorted(set(person[order][found == one].tolist()))) for one in np.unique(found)} == {(0,), (1,), (2,)}
    assert [len(np.unique(found[person[order] == one])) for one in range(3)] == [1, 1, 2]


def test_clocks_are_found_with_numbers_in_place_of_ids():
    scene = simulate(walkers(8, 3, seed=1), seed=2)
    stamps, random = scene.estimate.stamps, np.random.RandomState(0)
    numbers = np.concatenate([random.permutation((stamps == stamp).sum()) for stamp in np.unique(stamps)])
    numbered = dataclasses.replace(scene.estimate, ids=numbers)
    offset, angle, at_people, _ = errors(scene, align(numbered.measured(), scene.reference))
    assert offset < 1e3 / RATE / 4 and angle < 0.5 and at_people < 5

"""The work per frame that benchmarks grant the networks where people are published before the search."""
import numpy as np
import pytest

from chain_runs import Budget
from openpose_ros_pkg.detect.detection import NextPart
from openpose_ros_pkg.detect.schedule import SCHEDULE

WORK, RATE = 0.6, 15.0
UNIT = SCHEDULE.followed_share / RATE / WORK  # of one pass [s]


class Chain:
    """A chain of which a look takes some work, and each of many parts of the search too."""

    def __init__(self, of_look, of_part, owed=0):
        self.of_look, self.of_part, self.owed, self.done = of_look, of_part, owed, 0.0

    def look(self, frame):
        self.done += self.of_look
        return frame

    def search(self):
        for number in range(100):
            yield NextPart(self.of_part * UNIT, number < self.owed)
            self.done += self.of_part


def work_of(chain, frames):
    """Return the work of each frame."""
    budget, work = Budget(WORK, RATE, lambda: chain.done), []
    for number in range(frames):
        before = chain.done
        assert budget.result(chain, number) == number
        work.append(chain.done - before)
    return np.array(work)


@pytest.mark.parametrize('of_part', [0.05, 0.25, 1.0])
def test_the_budget_is_kept_and_two_frames_are_saved(of_part):
    """Also parts that take more than a frame has are searched."""
    work = work_of(Chain(0.1, of_part), 200)
    assert work.sum() == pytest.approx(200 * WORK, rel=0.02) and work.max() <= 2 * WORK


def test_crops_and_owed_parts_are_computed_in_any_case():
    np.testing.assert_allclose(work_of(Chain(1.0, 0.1), 10), 1.0)
    np.testing.assert_allclose(work_of(Chain(1.0, 0.1, owed=2), 10), 1.2)


def test_the_work_before_a_sequence_is_not_of_its_budget():
    """Networks are shared by sequences, and count all their work."""
    used = Chain(0.1, 0.25)
    used.done = 1000.0
    assert work_of(used, 200).sum() == pytest.approx(200 * WORK, rel=0.02)

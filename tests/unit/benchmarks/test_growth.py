"""The soak benchmark tells a leak from memory that comes and goes."""
import numpy as np
import pytest

from scoring.growth import growth

CYCLE = 300.0  # [s]


def samples(leak, files=0):
    """Return samples of an hour with visitors; memory [MB] and files grow by so much in each cycle."""
    times = np.arange(0.0, 12 * CYCLE, 6.0)
    noise = np.random.default_rng(0).normal(0.0, 8.0, len(times))
    visited, cycles = times % CYCLE > 0.4 * CYCLE, times // CYCLE
    memory = 360.0 + leak * cycles + noise + 100.0 * visited
    return list(zip(times, memory, 40 + visited, 41 + files * cycles + visited))


@pytest.mark.parametrize('leak, files, grown', [(0.0, 0, []), (5.0, 0, ['memory']), (0.0, 1, ['files'])])
def test_what_grows_from_cycle_to_cycle_is_named(leak, files, grown):
    least, faults = growth(samples(leak, files), CYCLE, (0.01, 0.0, 0))
    assert [len(values.split()) for values in least] == 3 * [12]
    assert [fault.split()[0] for fault in faults] == grown

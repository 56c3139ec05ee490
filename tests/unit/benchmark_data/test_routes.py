"""Routes of people in long sequences."""
import numpy as np
import pytest

from development.benchmark_data.people.motion import track
from development.benchmark_data.scenarios.long import SPEED, TURN, route


def test_a_person_stands_walks_and_turns_round():
    keys = route((0.0, 3.0), 1.0, (1.8, 3.0), (0.0, 3.0), 1.0)
    times = [time for time, _ in keys.path]
    path, yaw = track(keys.path), track(keys.yaw)
    assert (np.diff(times) > 0).all() and (np.diff([time for time, _ in keys.yaw]) > 0).all()
    assert path(0.9) == pytest.approx([0.0, 3.0]) and path(times[-1]) == pytest.approx([0.0, 3.0])
    middle = 1.0 + (1.8 / SPEED + 0.3) / 2
    assert (path(middle + 0.1) - path(middle - 0.1)) / 0.2 == pytest.approx([SPEED, 0.0], abs=0.3)
    back = next(time for time, place in keys.path if place[0] == 1.8)
    assert [float(yaw(back + d)) for d in (-TURN, TURN)] == pytest.approx([90.0, -90.0])

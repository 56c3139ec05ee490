"""Durations of stages over a sliding window."""
import pytest

from openpose_ros_pkg.stream.stage_timing import StageTiming


def test_percentiles_and_rate():
    """0.00, 0.01 .. 0.99 s, one each tenth of a second."""
    timing = StageTiming(('network',), 10.0)
    for i in range(100):
        timing.add('network', ((37 * i) % 100) / 100, 50.0 + i / 10)
    summary, = timing.summaries(59.9)
    assert (summary.count, summary.p50, summary.p95, summary.mean) == (100, 0.50, 0.95, pytest.approx(0.495))
    assert summary.rate == pytest.approx(10.0)


def test_what_is_older_than_the_window_does_not_count():
    timing = StageTiming(('network',), 5.0)
    timing.add('network', 1.0, 10.0)
    timing.add('network', 2.0, 14.0)
    timing.add('network', 3.0, 16.0)
    summary, = timing.summaries(16.0)
    assert (summary.count, summary.p50, summary.rate) == (2, 3.0, 0.5)
    assert timing.summaries(30.0)[0].count == 0

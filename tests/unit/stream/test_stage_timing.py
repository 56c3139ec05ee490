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

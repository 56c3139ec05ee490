"""Detectors in any number of processes; test_process_bag.py compares what they find."""
import numpy as np
import pytest

from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.params.parameters import build
from openpose_ros_tools.parallel.detector_pool import DetectorPool

DEFAULTS = build(DetectorSettings, {})


def broken(_settings):
    raise ModelError('weights are missing')


@pytest.mark.parametrize('jobs', [1, 2])
def test_a_detector_that_can_not_be_made_says_why(jobs):
    with pytest.raises(ModelError, match='weights are missing'), DetectorPool(jobs, DEFAULTS, broken) as pool:
        pool.submit(np.zeros((4, 6, 3), np.uint8)).result(30)

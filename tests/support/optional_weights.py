"""Tests of networks skip, and say how to get the weights, where these are not installed."""
import unittest
from pathlib import Path

from openpose_ros_pkg.networks.model_types import Model
from openpose_ros_pkg.networks.models import find_weights, weights_path


def need_weights(model: Model) -> Path:
    """Return the checked weights of a model; skip the test, of pytest or unittest, where they are not there."""
    if find_weights(model) is None:
        raise unittest.SkipTest(f'{model.name} is not installed: ./run model get {model.name}')
    return weights_path(model)

"""Files that commands read which need messages: transforms, reports, configurations."""
import json

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fuzzing import NUMBERS, mutated, spoiled, survives, written
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.nodes import ServiceSettings
from openpose_ros_pkg.params.parameters import build
from openpose_ros_tools.ros.evaluate_mocap import transform_of
from openpose_ros_tools.ros.process_bag.program import read_config

TRANSFORM = {'transform': {'matrix': np.eye(4).tolist()}}


@given(st.one_of(mutated(json.dumps(TRANSFORM).encode()),
                 spoiled(TRANSFORM).map(lambda values: json.dumps(values).encode())))
def test_transform(tmp_path_factory, content):
    path = written(tmp_path_factory, 'summary.json', content)
    matrix = survives(transform_of, [str(path)], size=len(content), errors=(ParameterError,))
    assert matrix is None or np.isfinite(matrix).all()


@given(st.lists(NUMBERS, min_size=2, max_size=8))
def test_transform_of_numbers(numbers):
    matrix = survives(transform_of, [str(number) for number in numbers], size=0, errors=(ParameterError,))
    assert matrix is None or np.isfinite(matrix).all()


@given(mutated(b'mode: fast\nthreads: 2\ntracking: true\ntarget_rate: 30.0\n'))
def test_configuration_file(tmp_path_factory, content):
    path = written(tmp_path_factory, 'config.yaml', content)
    values = survives(read_config, [path], size=len(content), errors=(ParameterError,))
    if values is not None:
        survives(build, ServiceSettings, values, size=len(content), errors=(ParameterError,))

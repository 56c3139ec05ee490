"""Files that commands read which need messages: transforms, reports, configurations."""
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fuzzing import NUMBERS, mutated, spoiled, survives, written
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.nodes import ServiceSettings
from openpose_ros_pkg.params.parameters import build
from openpose_ros_tools.ros.evaluate_mocap import transform_of
from openpose_ros_tools.ros.process_bag.program import read_config

TRANSFORM = {'transform': {'matrix': np.eye(4).tolist()}}


@pytest.mark.parametrize('name, contents', [
    ('summary.json', st.one_of(mutated(json.dumps(TRANSFORM).encode()),
                               spoiled(TRANSFORM).map(lambda values: json.dumps(values).encode()))),
    ('transform.txt', st.one_of(
        mutated(b'1 2 3 0 0 0 1', b'1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n'),
        st.lists(NUMBERS, max_size=16).map(lambda numbers: ' '.join(map(str, numbers)).encode())))])
@given(data=st.data())
def test_transform(tmp_path_factory, name, contents, data):
    content = data.draw(contents)
    path = written(tmp_path_factory, name, content)
    matrix = survives(transform_of, [str(path)], size=len(content), errors=(ParameterError,))
    assert matrix is None or np.isfinite(matrix).all()


@given(mutated(b'mode: fast\nthreads: 2\ntracking: true\ntarget_rate: 30.0\n'))
def test_configuration_file(tmp_path_factory, content):
    path = written(tmp_path_factory, 'config.yaml', content)
    values = survives(read_config, [path], size=len(content), errors=(ParameterError,))
    if values is not None:
        survives(build, ServiceSettings, values, size=len(content), errors=(ParameterError,))

"""Files that commands read which need messages: configurations."""

from hypothesis import given

from fuzzing import mutated, survives, written
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.nodes import ServiceSettings
from openpose_ros_pkg.params.parameters import build
from openpose_ros_tools.ros.process_bag.program import read_config


@given(mutated(b'mode: fast\nthreads: 2\ntracking: true\ntarget_rate: 30.0\n'))
def test_configuration_file(tmp_path_factory, content):
    path = written(tmp_path_factory, 'config.yaml', content)
    values = survives(read_config, [path], size=len(content), errors=(ParameterError,))
    if values is not None:
        survives(build, ServiceSettings, values, size=len(content), errors=(ParameterError,))

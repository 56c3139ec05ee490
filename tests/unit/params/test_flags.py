"""Flags in the notation of gflags set parameters; what can not be understood is refused."""
from dataclasses import dataclass

import pytest

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.flags import read_flags
from openpose_ros_pkg.params.parameters import Parameters, build, parameter


@dataclass(frozen=True)
class Client(Parameters):
    """One parameter of each kind."""

    camera_topic: str = parameter('/usb_cam/image_raw', 'Topic.')
    net_input_width: int = parameter(0, 'Width.', minimum=-1)
    alpha_pose: float = parameter(0.6, 'Opacity.', minimum=0, maximum=1)
    disable_blending: bool = parameter(False, 'Black background.')
    display: bool = parameter(True, 'Window.')
    notify: bool = parameter(False, 'A name that begins with no.')


def flags(*arguments):
    return read_flags(Client, arguments)[0]


@pytest.mark.parametrize('arguments', [['--camera_topic=/x/y'], ['-camera_topic=/x/y'], ['--camera_topic', '/x/y'],
                                       ['-camera_topic', '/x/y'], ['--camera_topic=/a', '--camera_topic=/x/y']])
def test_a_value_with_one_dash_or_two_after_an_equals_sign_or_a_space_and_the_last_one_counts(arguments):
    assert flags(*arguments) == {'camera_topic': '/x/y'}


def test_values_have_the_type_of_the_parameter():
    values = flags('--net_input_width', '656', '--alpha_pose=1', '--camera_topic=3')
    assert values == {'net_input_width': 656, 'alpha_pose': 1.0, 'camera_topic': '3'}
    assert [type(value) for value in values.values()] == [int, float, str]
    assert flags('--net_input_width', '-1') == {'net_input_width': -1}
    assert flags('--camera_topic=a=b') == {'camera_topic': 'a=b'}
    assert build(Client, values).net_input_width == 656


def test_bools():
    assert flags('--disable_blending', '--nodisplay') == {'disable_blending': True, 'display': False}
    assert flags('-disable_blending=false', '--display=1', '--notify') == {
        'disable_blending': False, 'display': True, 'notify': True}
    assert flags('--nonotify') == {'notify': False}


@pytest.mark.parametrize(('arguments', 'words'), [
    (['--camera_topics=/x'], ["'--camera_topics'", 'camera_topic', '--help']),
    (['picture.png'], ["'picture.png'", '--NAME=VALUE']),
    (['--'], ["'--'"]),
    (['--net_input_width=wide'], ["'net_input_width' = 'wide'", 'int in -1']),
    (['--alpha_pose', 'half'], ["'alpha_pose' = 'half'", 'float in 0 .. 1']),
    (['--net_input_width'], ["'--net_input_width'", 'no value']),
    (['--disable_blending=perhaps'], ["'disable_blending' = 'perhaps'", 'bool']),
    (['--nocamera_topic'], ["'--nocamera_topic'"]),
    (['--disable_blending', 'false'], ["'false'"])])
def test_what_can_not_be_understood_is_refused(arguments, words):
    with pytest.raises(ParameterError) as error:
        flags(*arguments)
    for word in words:
        assert word in str(error.value)

"""Parameters check themselves: an instance holds allowed values."""
import dataclasses
import logging
import math

import pytest
import yaml

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.flags import read_flags
from openpose_ros_pkg.params.parameters import (
    Parameters,
    accepted_names,
    build,
    flat_values,
    parameter,
    to_yaml,
)


@dataclasses.dataclass(frozen=True)
class Camera(Parameters):
    """What the camera gives."""

    rate: float = parameter(15.0, 'Frames per second.', unit='Hz', minimum=0.1, maximum=120.0)
    width: int = parameter(640, 'Width.', unit='px', minimum=1)
    encoding: str = parameter('bgr8', 'Encoding.', choices=('bgr8', 'rgb8'))
    loop: bool = parameter(False, 'Begin again at the end.')
    frame_id: str = parameter('camera', 'Frame.')


@dataclasses.dataclass(frozen=True)
class Words(Parameters):
    """Texts with words that YAML reads as booleans."""

    place: str = parameter('', 'Any text, or off.', words=('off',))
    answer: str = parameter('yes', 'How sure.', choices=('maybe', 'yes'))


@dataclasses.dataclass(frozen=True)
class Lens(Parameters):
    """What is before the camera."""

    focal_length: float = parameter(0.0, 'Focal length.', unit='px', minimum=0.0)


@dataclasses.dataclass(frozen=True)
class Optics:
    """Camera and lens."""

    camera: Camera
    lens: Lens


@dataclasses.dataclass(frozen=True)
class Tripod:
    """A record within a record."""

    optics: Optics
    words: Words


def test_values_reach_the_classes_they_belong_to_and_others_have_their_defaults():
    assert build(Tripod, {}) == Tripod(Optics(Camera(), Lens()), Words())
    made = build(Tripod, {'rate': 30, 'focal_length': 525.0, 'loop': True})
    assert made == Tripod(Optics(Camera(rate=30.0, loop=True), Lens(focal_length=525.0)), Words())
    assert type(made.optics.camera.rate) is float
    assert build(Tripod, flat_values(made)) == made
    assert {'rate', 'focal_length', 'place'} < set(flat_values(made))


@pytest.mark.parametrize('name, plain', [('/camera', 'camera'), ('camera', 'camera'), ('', ''), ('/a/b', 'a/b')])
def test_a_frame_has_no_leading_slash(name, plain):
    assert build(Camera, {'frame_id': name}).frame_id == plain


@pytest.mark.parametrize('name, value, allowed', [
    ('rate', 121.0, 'float in 0.1 .. 120 [Hz]'), ('rate', math.nan, 'float in 0.1 .. 120 [Hz]'),
    ('rate', '15', 'float in 0.1 .. 120 [Hz]'), ('width', 0, 'int in 1 .. inf [px]'),
    ('width', True, 'int in 1 .. inf [px]'), ('encoding', 'mono8', "one of 'bgr8', 'rgb8'"), ('loop', 'true', 'bool'),
    ('frame_id', None, 'str')])
def test_wrong_value_names_key_value_and_what_is_allowed(name, value, allowed):
    with pytest.raises(ParameterError) as caught:
        build(Camera, {name: value})
    assert str(caught.value) == f"parameter '{name}' = {value!r} is not allowed: {allowed}"
    assert caught.value.key == name


@pytest.mark.parametrize('values, place', [
    ({}, ''), ({'place': 'off'}, 'off'), ({'place': False}, 'off'), ({'place': 'away'}, 'away'),
    ({'answer': True}, '')])
def test_texts_that_yaml_takes_for_a_bool(values, place):
    assert build(Words, values) == Words(place=place, answer='yes')


def test_unknown_key_names_the_nearest_and_all():
    with pytest.raises(ParameterError) as caught:
        build(Optics, {'focal_lenght': 1.0})
    assert "unknown parameter 'focal_lenght' = 1.0 (did you mean 'focal_length'?)" in str(caught.value)
    assert 'allowed: encoding, focal_length, frame_id, loop, rate, width' in str(caught.value)


def test_yaml_holds_every_default_and_what_it_means():
    text = to_yaml(Optics)
    assert yaml.safe_load(text) == {**dataclasses.asdict(Camera()), **dataclasses.asdict(Lens())}
    assert '# Frames per second. (float in 0.1 .. 120 [Hz])\nrate: 15.0\n' in text
    assert max(map(len, text.splitlines())) <= 120


@dataclasses.dataclass(frozen=True)
class Gates(Parameters):
    """One that stays, and one that is gone."""

    retired = ('gone',)

    stays: int = parameter(1, 'Stays.')


def test_parameters_that_are_gone_are_ignored_with_one_warning_and_in_no_list(caplog):
    with caplog.at_level(logging.WARNING):
        assert build(Gates, {'gone': 9}) == build(Gates, {'gone': 9}) == build(Gates, {}) == Gates()
    assert [record.getMessage() for record in caplog.records] == ["parameter 'gone' = 9 is gone, and without effect"]
    for unknown in ('gate', 'limb_samples'):  # which is gone, but of another node
        with pytest.raises(ParameterError, match=r'allowed: stays$'):
            build(Gates, {unknown: 1})
    assert set(accepted_names(Gates)) == {'stays', 'gone'}
    assert read_flags(Gates, ['--gone=3', '--stays', '2'])[0] == {'gone': '3', 'stays': 2}
    assert 'gone:' not in to_yaml(Gates)

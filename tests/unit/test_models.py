"""The registry finds models by name, and their weights only when they are the right ones."""
import dataclasses
import hashlib
from pathlib import Path

import pytest

from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.models import (
    MOBILENET_THIN,
    MODELS,
    default_model_folder,
    file_sha256,
    find_model,
    weights_path,
)

CONTENT = b'weights'
MODEL = dataclasses.replace(MOBILENET_THIN, sha256=hashlib.sha256(CONTENT).hexdigest(), size=len(CONTENT))


@pytest.mark.parametrize('name', [*MODELS, 'COCO'])
def test_models_are_found_by_name_and_by_the_originals_name(name):
    assert find_model(name) in MODELS.values()


@pytest.mark.parametrize('name', ['', 'BODY_25', 'Mobilenet_Thin'])
def test_unknown_model_is_an_error_with_the_allowed_names(name):
    with pytest.raises(ParameterError, match=f"'pose_model' = '{name}' is not allowed: one of COCO, mobilenet_thin"):
        find_model(name)


def test_default_network_has_19_maps_and_two_channels_for_each_of_19_limbs():
    assert MOBILENET_THIN.channels == 57
    assert MOBILENET_THIN.heatmaps == len(MOBILENET_THIN.skeleton.joints) + 1


def test_no_model_lacks_checksum_or_licence():
    for name, model in MODELS.items():
        assert name == model.name
        assert len(model.sha256) == len(model.source.sha256) == 64
        assert model.licence == 'Apache-2.0'


def test_missing_weights_name_both_places_and_the_way_out(tmp_path):
    with pytest.raises(ModelError) as caught:
        weights_path(MODEL, str(tmp_path))
    for text in (str(tmp_path / 'mobilenet_thin' / 'graph_opt.pb'), str(tmp_path / 'graph_opt.pb'), './run model get'):
        assert text in str(caught.value)


@pytest.mark.parametrize('place', ['graph_opt.pb', 'mobilenet_thin/graph_opt.pb'])
def test_weights_may_lie_in_the_folder_or_in_the_models_own(tmp_path, place):
    (tmp_path / place).parent.mkdir(exist_ok=True)
    (tmp_path / place).write_bytes(CONTENT)
    assert weights_path(MODEL, str(tmp_path)) == tmp_path / place


@pytest.mark.parametrize('content', [b'', CONTENT[:-1], CONTENT + b'x'])
def test_damaged_weights_show_actual_and_expected(tmp_path, content):
    path = tmp_path / 'graph_opt.pb'
    path.write_bytes(content)
    with pytest.raises(ModelError) as caught:
        weights_path(MODEL, str(tmp_path))
    for text in (str(path), f'{len(content)} bytes', file_sha256(path), MODEL.sha256):
        assert text in str(caught.value)


def test_cache_follows_the_environment(monkeypatch, tmp_path):
    for name in ('OPENPOSE_ROS_CACHE', 'XDG_CACHE_HOME'):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv('HOME', str(tmp_path))
    assert default_model_folder() == tmp_path / '.cache' / 'openpose_ros' / 'models'
    monkeypatch.setenv('XDG_CACHE_HOME', '/xdg')
    assert default_model_folder() == Path('/xdg/openpose_ros/models')
    monkeypatch.setenv('OPENPOSE_ROS_CACHE', '/own')
    assert default_model_folder() == Path('/own/models')


def test_home_folder_is_understood(monkeypatch, tmp_path):
    monkeypatch.setenv('HOME', str(tmp_path))
    (tmp_path / 'graph_opt.pb').write_bytes(CONTENT)
    assert weights_path(MODEL, '~') == tmp_path / 'graph_opt.pb'


def test_checksum_of_a_file_longer_than_one_block(tmp_path):
    content = bytes(range(256)) * 5000
    (tmp_path / 'file').write_bytes(content)
    assert file_sha256(tmp_path / 'file') == hashlib.sha256(content).hexdigest()

"""The registry finds models by name, and their weights only when they are the right ones."""
import dataclasses
import hashlib
from pathlib import Path

import pytest

from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.networks.model_registry import LANDMARK_MODELS, MOBILENET_THIN, MODELS
from openpose_ros_pkg.networks.model_types import Archive, UserFiles, WebSource, WeightsFile
from openpose_ros_pkg.networks.models import default_model_folder, find_model, weights_path

CONTENT = b'weights'


def digest(kind, content=CONTENT):
    return hashlib.new(kind, content).hexdigest()


MODEL = dataclasses.replace(MOBILENET_THIN, files=(WeightsFile('graph_opt.pb', len(CONTENT), digest('sha256')),))
# Like OpenPose's own: a text without a known checksum, and weights of which the md5 is published.
CAFFE = dataclasses.replace(
    MODELS['body_25'], files=(WeightsFile('net.prototxt'), WeightsFile('net.caffemodel', md5=digest('md5'))))


def put_caffe(folder, prototxt=b'layer {}', caffemodel=CONTENT):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'net.prototxt').write_bytes(prototxt)
    (folder / 'net.caffemodel').write_bytes(caffemodel)


# --- names ----------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('written, name', [
    ('rtmpose-s-feet', 'rtmpose_s_feet'), ('rtmo-s', 'rtmo_s'), ('MPI-4-layers', 'mpi_4_layers'),
    ('human_pose_estimation_0001', 'human-pose-estimation-0001'), ('mobilenet-thin', 'mobilenet_thin'),
    ('COCO', 'mobilenet_thin'), ('BODY_25', 'body_25'), ('MPI', 'mpi'), ('MPI_4_layers', 'mpi_4_layers')])
def test_models_are_found_by_the_names_of_openpose_and_with_dashes_or_underscores(written, name):
    assert find_model(written) is MODELS[name]


@pytest.mark.parametrize('name', ['', 'BODY_26', 'Mobilenet_Thin', '../mobilenet_thin', 'missing.yaml', '/'])
def test_unknown_model_is_an_error_with_the_allowed_names(name, tmp_path):
    with pytest.raises(ParameterError, match=f"'pose_model' = '{name}' is not allowed: one of BODY_25, COCO, .*"
                                             'mobilenet_thin, .*a .yaml file that describes it'):
        find_model(name, str(tmp_path))


def test_no_model_lacks_licence_source_or_skeleton():
    for name, model in {**MODELS, **LANDMARK_MODELS}.items():
        assert name == model.name
        assert model.licence and model.files and model.outputs
        if isinstance(model.source, Archive):
            assert model.licence == 'Apache-2.0'
            assert len(model.source.sha256) == len(model.files[0].sha256) == 64 and model.files[0].size
        elif isinstance(model.source, WebSource):
            assert model.source.address.startswith('https://') and model.source.stated
            assert all(len(file.sha256) == 64 for file in model.files)
        else:
            assert isinstance(model.source, UserFiles) and model.source.where


# --- weights --------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('model, there, texts', [
    (MODEL, '', ['{}/mobilenet_thin/graph_opt.pb', '{}/graph_opt.pb', './run model get mobilenet_thin']),
    (CAFFE, '', ['net.prototxt', 'getModels.sh', 'non-commercial', 'openpose_models get body_25 --from', '{}/body_25']),
    (CAFFE, 'net.caffemodel', ['(looked for {}/body_25/net.prototxt)'])])
def test_missing_weights_name_the_places_and_the_way_out(tmp_path, model, there, texts):
    (tmp_path / 'body_25').mkdir()
    if there:
        (tmp_path / 'body_25' / there).write_bytes(CONTENT)
    with pytest.raises(ModelError) as caught:
        weights_path(model, str(tmp_path))
    for text in texts:
        assert text.format(tmp_path) in str(caught.value)


@pytest.mark.parametrize('place', ['body_25', '.', 'pose/body_25'])
def test_weights_may_lie_in_the_models_folder_beside_it_or_as_openpose_has_them(tmp_path, place):
    put_caffe(tmp_path / place)
    assert weights_path(CAFFE, str(tmp_path)) == tmp_path / place / 'net.prototxt'


def test_every_file_is_compared(tmp_path):
    put_caffe(tmp_path, caffemodel=b'other')
    with pytest.raises(ModelError) as caught:
        weights_path(CAFFE, str(tmp_path))
    for text in ('net.caffemodel', digest('md5', b'other'), digest('md5')):
        assert text in str(caught.value)


# --- folders --------------------------------------------------------------------------------------------------------

def test_cache_follows_the_environment(monkeypatch, tmp_path):
    for name in ('OPENPOSE_ROS_CACHE', 'XDG_CACHE_HOME'):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv('HOME', str(tmp_path))
    assert default_model_folder() == tmp_path / '.cache' / 'openpose_ros' / 'models'
    monkeypatch.setenv('XDG_CACHE_HOME', '/xdg')
    assert default_model_folder() == Path('/xdg/openpose_ros/models')
    monkeypatch.setenv('OPENPOSE_ROS_CACHE', '/own')
    assert default_model_folder() == Path('/own/models')

"""Runtimes of the network: choice and damaged files.

What a network takes and gives is in test_backends_networks.py, the self-check in test_backends_self_check.py. Tests on
real networks are skipped where their weights or the runtime are not there.
"""
import importlib.util
import logging
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.networks import backends
from openpose_ros_pkg.networks.backends import BackendParams, create_backend
from openpose_ros_pkg.networks.backends.opencv_dnn import has_cuda
from openpose_ros_pkg.networks.backends.self_check import reference_path
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN, MODELS, MOVENET_MULTIPOSE

NAMES = ('openvino', 'opencv_dnn')


def need(name):
    if name != 'opencv_dnn' and importlib.util.find_spec(name) is None:
        pytest.skip(f'{name} is not installed: pip install {name}')


class FakeBackend:
    """Gives the known output, spoilt by a function."""

    name = 'fake'
    description = 'Fake 1.0'
    fallback = ''

    def __init__(self, spoil=lambda fields: fields):
        self._spoil = spoil

    def infer(self, images):
        with np.load(str(reference_path(MOBILENET_THIN))) as reference:
            return (self._spoil(reference['output_0'].astype(np.float32)),)


def params(**values):
    return BackendParams(**{'compiled_cache': 'off', **values})


def with_loaders(monkeypatch, **loaders):
    """Replace the runtimes by functions without arguments; those that are not named are not there."""
    def absent():
        raise ImportError('no such library')
    loaders = {name: loaders.get(name, absent) for name in ('openvino', 'onnxruntime', 'opencv_dnn')}

    def load(name, fallback):
        backend = loaders[name]()
        backend.fallback = fallback
        return backend
    monkeypatch.setattr(backends, '_backend_class', lambda name: lambda model, weights, params, fallback: load(
        name, fallback))


def test_auto_takes_the_first_that_works_and_says_so(monkeypatch, caplog, tmp_path):
    first, second = FakeBackend(), FakeBackend()
    with_loaders(monkeypatch, openvino=lambda: first, opencv_dnn=lambda: second)
    with caplog.at_level(logging.INFO):
        assert create_backend(MOBILENET_THIN, tmp_path / 'graph.pb', BackendParams()) is first
        mine = replace(MOBILENET_THIN, description=tmp_path / 'mine.yaml', licence='MIT')
        create_backend(mine, tmp_path / 'mine.pb', BackendParams())
    assert [record.levelname for record in caplog.records] == ['INFO', 'INFO']
    assert ('Fake 1.0 computes mobilenet_thin (backend auto: the fastest that is available); licence of the weights: '
            'Apache-2.0\n') in caplog.text
    assert 'weights: MIT, a file of yours: whether it finds people was not checked\n' in caplog.text


def test_auto_skips_a_wrong_network_with_a_warning(monkeypatch, caplog, tmp_path):
    right = FakeBackend()
    with_loaders(monkeypatch, openvino=lambda: FakeBackend(np.zeros_like), opencv_dnn=lambda: right)
    with caplog.at_level(logging.INFO):
        assert create_backend(MOBILENET_THIN, tmp_path / 'graph.pb', BackendParams()) is right
    assert [record.levelname for record in caplog.records] == ['WARNING', 'INFO']
    assert 'Fake 1.0 computes mobilenet_thin, slower than asked for: openvino does not work' in caplog.text
    assert 'openvino does not work' in right.fallback and 'wrongly' in right.fallback


def off_by(fields):
    """Joints that are a cell of the fields, 8 px, beside their places."""
    return np.roll(fields, 1, axis=3)


def test_wrong_in_reduced_precision_it_is_f32_of_the_same_runtime(monkeypatch, caplog, tmp_path):
    made = []

    def load(model, weights, params, fallback):
        made.append(params.precision)
        backend = FakeBackend(off_by if params.precision == 'auto' else lambda fields: fields)
        backend.fallback = fallback
        return backend
    monkeypatch.setattr(backends, '_backend_class', lambda name: load)
    backend = create_backend(MOBILENET_THIN, tmp_path / 'graph.pb', params(precision='auto'))
    assert made == ['auto', 'f32']
    assert 'joints in a known image are off by' in backend.fallback
    assert [record.levelname for record in caplog.records] == ['WARNING']
    assert 'slower than asked for' in caplog.text


@pytest.mark.parametrize('model, backend, text', [
    (MOVENET_MULTIPOSE, 'opencv_dnn', r'not movenet\.tflite; set backend to auto or one of openvino$'),
    (MOBILENET_THIN, 'onnxruntime', r'it reads \.onnx, not graph_opt\.pb; set .* one of openvino, opencv_dnn$'),
    (MODELS['body_25'], 'openvino', r'not pose_deploy\.prototxt; set backend to auto or one of opencv_dnn$')],
    ids=['TFLite', 'TensorFlow', 'Caffe'])
def test_demanded_backend_that_does_not_read_the_file(model, backend, text, tmp_path):
    with pytest.raises(ParameterError, match=f"'backend' = '{backend}' can not compute {model.name}.*{text}"):
        create_backend(model, tmp_path / model.files[0].name, BackendParams(backend=backend))


@pytest.mark.parametrize('device', ['cuda', 'tensorrt'])
@pytest.mark.parametrize('name', ['openvino', 'onnxruntime', 'opencv_dnn'])
def test_device_that_is_not_there_is_refused_not_replaced(name, device, tmp_path):
    need(name)
    if name == 'opencv_dnn' and device == 'cuda' and has_cuda():
        pytest.skip('this OpenCV has CUDA')
    if name == 'onnxruntime':
        import onnxruntime
        if len(onnxruntime.get_available_providers()) > 2:
            pytest.skip('this onnxruntime has a GPU')
    with pytest.raises(ParameterError, match=f"'device' = '{device}'.*cpu"):
        create_backend(MOBILENET_THIN, tmp_path / 'graph.onnx', BackendParams(backend=name, device=device))


@pytest.mark.parametrize('name', NAMES)
@pytest.mark.parametrize('content', [b'', b'not a graph at all', b'\x0a\xff\xff\xff\x7f' + bytes(1000)],
                         ids=['empty', 'text', 'cut short'])
def test_damaged_weights(name, content, tmp_path):
    need(name)
    path = tmp_path / 'graph_opt.pb'
    path.write_bytes(content)
    with pytest.raises(ModelError, match=r'graph_opt\.pb'):
        create_backend(MOBILENET_THIN, path, params(backend=name))

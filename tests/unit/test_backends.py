"""Runtimes of the network: choice, equality, self-check, damaged weights.

Tests on the real network are skipped where its weights or OpenVINO are not there.
"""
import builtins
import importlib.util
import logging
import sys

import cv2
import numpy as np
import pytest

from openpose_ros_pkg import backends
from openpose_ros_pkg.backends import BackendParams, create_backend
from openpose_ros_pkg.backends.self_check import check_backend, make_reference, reference_path
from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.models import MOBILENET_THIN, weights_path

NAMES = ('openvino', 'opencv_dnn')
# Largest difference of float32 runtimes on fields that reach 1: they add up in another order (5e-6 measured).
TOLERANCE = 1e-4


@pytest.fixture(scope='module')
def weights():
    try:
        return weights_path(MOBILENET_THIN)
    except ModelError as error:
        pytest.skip(str(error))


def need(name):
    if name == 'openvino' and importlib.util.find_spec('openvino') is None:
        pytest.skip('OpenVINO is not installed: pip install openvino')


@pytest.fixture
def without_openvino(monkeypatch):
    """Make `import openvino` fail, as on a machine without it."""
    real = builtins.__import__

    def fake(name, *args, **kwargs):
        if name == 'openvino' or name.startswith('openvino.'):
            raise ImportError("No module named 'openvino'")
        return real(name, *args, **kwargs)

    monkeypatch.delitem(sys.modules, 'openpose_ros_pkg.backends.openvino', raising=False)
    monkeypatch.setattr(builtins, '__import__', fake)


class FakeBackend:
    """Returns the known output, spoilt by a function."""

    name = 'fake'
    description = 'Fake 1.0'

    def __init__(self, spoil=lambda fields: fields):
        self._spoil = spoil

    def infer(self, images):
        with np.load(str(reference_path(MOBILENET_THIN))) as reference:
            np.testing.assert_array_equal(images[0], reference['image'])
            return self._spoil(reference['fields'].astype(np.float32))[np.newaxis]


# --- self-check -----------------------------------------------------------------------------------------------------

def test_reference_is_small_and_shows_a_person():
    assert reference_path(MOBILENET_THIN).stat().st_size < 50000
    with np.load(str(reference_path(MOBILENET_THIN))) as reference:
        image, fields = reference['image'], reference['fields']
    assert image.dtype == np.uint8 and image.shape[2] == 3
    assert fields.shape == (57, image.shape[0] // 8, image.shape[1] // 8)
    # Values that a wrong network could not hit by being silent: most joints and fields are excited.
    assert np.median(fields[:18].max(axis=(1, 2))) > 0.5 and np.abs(fields[19:]).max() > 0.9


def test_right_network_passes():
    check_backend(FakeBackend(), MOBILENET_THIN, exact=True)


@pytest.mark.parametrize('spoil, text', [
    (np.zeros_like, 'off by up to 1'), (lambda fields: fields[::-1], 'off by'), (lambda fields: fields + 0.01, '0.01'),
    (lambda fields: fields * np.nan, 'nan'), (lambda fields: fields[:56], r'\(56, 14, 10\), expected \(57, 14, 10\)')],
    ids=['zero', 'channels in another order', 'small offset', 'NaN', 'channel missing'])
def test_wrong_network_is_caught_and_named(spoil, text):
    with pytest.raises(ModelError, match=f'Fake 1.0 computes mobilenet_thin wrongly.*{text}.*parameter backend'):
        check_backend(FakeBackend(spoil), MOBILENET_THIN, exact=True)


def test_reduced_precision_has_a_wider_tolerance():
    check_backend(FakeBackend(lambda fields: fields + 0.03), MOBILENET_THIN, exact=False)
    with pytest.raises(ModelError, match=r'expected at most 0\.1'):
        check_backend(FakeBackend(lambda fields: fields + 0.2), MOBILENET_THIN, exact=False)


def test_crash_in_the_runtime_is_a_model_error():
    def crash(fields):
        raise RuntimeError('illegal instruction')
    with pytest.raises(ModelError, match='illegal instruction'):
        check_backend(FakeBackend(crash), MOBILENET_THIN, exact=True)


def test_reference_can_be_made_again(weights, tmp_path, monkeypatch):
    path = tmp_path / 'new.npz'
    monkeypatch.setattr('openpose_ros_pkg.backends.self_check.reference_path', lambda model: path)
    make_reference(create_unchecked('opencv_dnn', weights), MOBILENET_THIN)
    with np.load(str(path)) as new, np.load(str(reference_path(MOBILENET_THIN))) as kept:
        np.testing.assert_array_equal(new['image'], kept['image'])
        np.testing.assert_allclose(new['fields'].astype(float), kept['fields'].astype(float), atol=1e-3)


# --- choice ---------------------------------------------------------------------------------------------------------

def create_unchecked(name, weights, params=None):
    return backends._LOADERS[name](MOBILENET_THIN, weights, params or BackendParams())


def with_loaders(monkeypatch, **loaders):
    """Replace the runtimes by functions without arguments."""
    monkeypatch.setattr(backends, '_LOADERS', {
        name: (lambda model, weights, params, load=load: load()) for name, load in loaders.items()})


def test_auto_takes_the_first_that_works_and_says_so(monkeypatch, caplog, tmp_path):
    first, second = FakeBackend(), FakeBackend()
    with_loaders(monkeypatch, openvino=lambda: first, opencv_dnn=lambda: second)
    with caplog.at_level(logging.INFO):
        assert create_backend(MOBILENET_THIN, tmp_path, BackendParams()) is first
    assert [record.levelname for record in caplog.records] == ['INFO']
    assert 'Fake 1.0 computes mobilenet_thin' in caplog.text


def test_auto_skips_a_wrong_network_with_a_warning(monkeypatch, caplog, tmp_path):
    right = FakeBackend()
    with_loaders(monkeypatch, openvino=lambda: FakeBackend(np.zeros_like), opencv_dnn=lambda: right)
    with caplog.at_level(logging.INFO):
        assert create_backend(MOBILENET_THIN, tmp_path, BackendParams()) is right
    assert [record.levelname for record in caplog.records] == ['WARNING', 'INFO']
    assert 'backend openvino is skipped' in caplog.text and 'wrongly' in caplog.records[1].getMessage()


def test_auto_without_any_that_works_names_all_reasons(monkeypatch, tmp_path):
    def absent():
        raise ImportError('no such library')
    with_loaders(monkeypatch, openvino=absent, opencv_dnn=lambda: FakeBackend(np.zeros_like))
    with pytest.raises(ModelError, match=r'openvino is not importable: no such library; opencv_dnn does not work'):
        create_backend(MOBILENET_THIN, tmp_path, BackendParams())


def test_demanded_backend_that_is_wrong_is_an_error_not_a_fallback(monkeypatch, tmp_path):
    with_loaders(monkeypatch, openvino=lambda: FakeBackend(np.zeros_like), opencv_dnn=FakeBackend)
    with pytest.raises(ModelError, match='wrongly'):
        create_backend(MOBILENET_THIN, tmp_path, BackendParams(backend='openvino'))


def test_demanded_backend_that_is_not_installed(without_openvino, tmp_path):
    with pytest.raises(ParameterError, match=r"'backend' = 'openvino' is not available: No module.*pip install"):
        create_backend(MOBILENET_THIN, tmp_path, BackendParams(backend='openvino'))


def test_auto_without_openvino_takes_opencv(without_openvino, weights, caplog):
    with caplog.at_level(logging.INFO):
        assert create_backend(MOBILENET_THIN, weights, BackendParams()).name == 'opencv_dnn'
    assert "openvino is not importable: No module named 'openvino'" in caplog.text


@pytest.mark.parametrize('key, value', [('backend', 'tensorrt'), ('threads', -1), ('precision', 'int8')])
def test_bad_parameter_is_refused(key, value):
    with pytest.raises(ParameterError, match=key):
        BackendParams(**{key: value})


# --- the real network -----------------------------------------------------------------------------------------------

@pytest.mark.parametrize('name', NAMES)
@pytest.mark.parametrize('content', [b'', b'not a graph at all', b'\x0a\xff\xff\xff\x7f' + bytes(1000)],
                         ids=['empty', 'text', 'cut short'])
def test_damaged_weights(name, content, tmp_path):
    need(name)
    path = tmp_path / 'graph_opt.pb'
    path.write_bytes(content)
    with pytest.raises(ModelError, match=r'graph_opt\.pb'):
        create_backend(MOBILENET_THIN, path, BackendParams(backend=name))


@pytest.mark.parametrize('name', NAMES)
def test_half_the_weights(name, weights, tmp_path):
    need(name)
    path = tmp_path / 'graph_opt.pb'
    path.write_bytes(weights.read_bytes()[:MOBILENET_THIN.size // 2])
    with pytest.raises(ModelError):
        create_backend(MOBILENET_THIN, path, BackendParams(backend=name))


@pytest.mark.parametrize('name', NAMES)
def test_shapes_batches_and_sizes_one_after_the_other(name, weights):
    """More sizes than are kept compiled; results do not depend on what came before, nor on the rest of the batch."""
    need(name)
    backend = create_backend(MOBILENET_THIN, weights, BackendParams(backend=name, threads=1))
    rng = np.random.default_rng(0)
    first = rng.integers(0, 256, (2, 64, 48, 3), dtype=np.uint8)
    kept = backend.infer(first)
    assert kept.shape == (2, 57, 8, 6) and kept.dtype == np.float32
    before = kept.copy()
    for height, width in ((32, 40), (40, 32), (48, 48), (56, 64), (64, 56)):
        out = backend.infer(rng.integers(0, 256, (1, height, width, 3), dtype=np.uint8))
        assert out.shape == (1, 57, height // 8, width // 8)
    np.testing.assert_array_equal(kept, before)  # the caller's own
    np.testing.assert_allclose(backend.infer(first[1:])[0], kept[1], atol=TOLERANCE)


def test_both_backends_compute_the_same(weights):
    need('openvino')
    with np.load(str(reference_path(MOBILENET_THIN))) as reference:
        person = reference['image']
    image = cv2.resize(person, (240, 336))
    image = np.clip(image + np.random.default_rng(1).normal(0, 8, image.shape), 0, 255).astype(np.uint8)[np.newaxis]
    one, other = (create_backend(MOBILENET_THIN, weights, BackendParams(backend=name)).infer(image) for name in NAMES)
    assert one[0, :18].max() > 0.5  # there is something to compare
    np.testing.assert_allclose(one, other, atol=TOLERANCE)

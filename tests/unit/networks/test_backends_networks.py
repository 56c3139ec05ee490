"""What networks take and give, with every runtime and file format: tiny networks whose output can be calculated.

Each output channel of `fields` is a weighted sum of the mean colours of 8 x 8 pixels, so that colour order, mean,
scale, layout, order of the outputs and of the channels, position and batch all show.
"""
import importlib.util
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiny_networks
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.backends import BackendParams, create_backend
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN, MODELS
from openpose_ros_pkg.networks.model_types import SIMCC_INPUT, InputRecipe, WeightsFile

LIGHTWEIGHT = MODELS['lightweight_openpose']
RUNTIMES = ('openvino', 'onnxruntime', 'opencv_dnn')
OPENCV = tuple(int(number) for number in cv2.__version__.split('.')[:2])
IMAGES = np.random.default_rng(1).integers(0, 256, (2, 48, 64, 3), dtype=np.uint8)


@pytest.fixture(params=RUNTIMES)
def runtime(request):
    if request.param != 'opencv_dnn' and importlib.util.find_spec(request.param) is None:
        pytest.skip(f'{request.param} is not installed: pip install {request.param}')
    return request.param


def weights_of(channels):
    return np.random.default_rng(2).normal(0, 1, (channels, 3)).astype(np.float32)


def expected_fields(images, recipe, weights):
    """(N, channels, H / 8, W / 8), from the recipe's definition."""
    count, height, width, _ = images.shape
    cells = images.astype(float).reshape(count, height // 8, 8, width // 8, 8, 3).mean(axis=(2, 4))
    cells = ((cells[..., ::-1] if recipe.channels == 'RGB' else cells) - recipe.mean) * recipe.scale
    return np.einsum('kc,nhwc->nkhw', weights.astype(float), cells)


def assert_fields(actual, expected):
    assert actual.dtype == np.float32 and actual.flags.c_contiguous and actual.flags.owndata
    # float32 keeps 7 digits, of sums over 192 products.
    np.testing.assert_allclose(actual, expected, atol=2e-6 * np.abs(expected).max(), rtol=1e-5)


def load(model, path, runtime, **params):
    return create_backend(model, path, BackendParams(backend=runtime, **{'compiled_cache': 'off', **params}))


def infer_all(backend, images):
    """Return the outputs for several images, one after the other."""
    return tuple(np.concatenate(outputs) for outputs in zip(*(
        backend.infer(images[i:i + 1]) for i in range(len(images)))))


def onnx_file(folder, content):
    (folder / 'tiny.onnx').write_bytes(content)
    return folder / 'tiny.onnx'


def own(model, **changes):
    """The model under another name, so that it has no known output."""
    return replace(model, **{'name': 'tiny', 'files': (WeightsFile('tiny.onnx'),), **changes})


# --- input recipe ---------------------------------------------------------------------------------------------------

RECIPES = [InputRecipe(channels='RGB', mean=127.5, scale=1 / 127.5), InputRecipe(layout='NHWC', mean=10.0, scale=0.5),
           InputRecipe(layout='NHWC', dtype='uint8'), InputRecipe(dtype='uint8', channels='RGB'), SIMCC_INPUT,
           replace(SIMCC_INPUT, channels='BGR', layout='NHWC')]


@pytest.mark.parametrize('recipe', RECIPES, ids=lambda recipe: (
    f'{recipe.layout} {recipe.dtype} {recipe.channels} {recipe.mean} {recipe.scale}'))
def test_onnx_gets_the_picture_as_its_recipe_says(runtime, recipe, tmp_path):
    weights = weights_of(57)
    kind = tiny_networks.UINT8 if recipe.dtype == 'uint8' else tiny_networks.FLOAT
    path = onnx_file(tmp_path, tiny_networks.onnx_fields([weights], layout=recipe.layout, kind=kind))
    model = own(MOBILENET_THIN, input=recipe, outputs=('fields',), output_layout=recipe.layout)
    if runtime == 'opencv_dnn' and recipe.dtype == 'uint8' and OPENCV < (4, 3):
        with pytest.raises(ModelError, match='type "Cast"'):  # which turns integers into real numbers
            load(model, path, runtime)
        return
    before = IMAGES.copy()
    fields, = infer_all(load(model, path, runtime), IMAGES)
    assert_fields(fields, expected_fields(IMAGES, recipe, weights))
    np.testing.assert_array_equal(IMAGES, before)


@pytest.mark.parametrize('name', ['body_25', 'openpose_coco', 'mpi', 'mpi_4_layers'])
def test_openpose_caffe_networks(name, tmp_path):
    """OpenPose's input (x / 256 - 0.5) and channels; the prototxt is the first file, the caffemodel lies beside it."""
    model = MODELS[name]
    weights = weights_of(model.channels)
    paths = [tmp_path / file.name for file in model.files]
    text, content = tiny_networks.caffe_fields(weights, model.outputs[0])
    paths[0].write_text(text)
    paths[1].write_bytes(content)
    backend = create_backend(model, paths[0], BackendParams(compiled_cache='off'))
    assert backend.name == 'opencv_dnn'
    expected = expected_fields(IMAGES, InputRecipe(mean=128.0, scale=1 / 256), weights)
    assert_fields(infer_all(backend, IMAGES)[0], expected)


# --- outputs --------------------------------------------------------------------------------------------------------

def test_outputs_come_in_the_order_of_the_model_not_of_the_file(runtime, tmp_path):
    """Lightweight OpenPose: the file has four, the limbs before the joints."""
    joints, limbs = weights_of(19), weights_of(38)[::-1]
    path = onnx_file(tmp_path, tiny_networks.onnx_fields(
        [limbs * 2, joints * 2, limbs, joints], outputs=('stage_0_output_0_pafs', 'stage_0_output_1_heatmaps',
                                                         'stage_1_output_0_pafs', 'stage_1_output_1_heatmaps')))
    outputs = infer_all(load(own(LIGHTWEIGHT), path, runtime), IMAGES)
    assert len(outputs) == 2
    assert_fields(outputs[0], expected_fields(IMAGES, LIGHTWEIGHT.input, joints))
    assert_fields(outputs[1], expected_fields(IMAGES, LIGHTWEIGHT.input, limbs))


def test_output_that_the_file_does_not_have_is_named_with_those_it_has(runtime, tmp_path):
    path = onnx_file(tmp_path, tiny_networks.onnx_fields([weights_of(57)], outputs=('fields',)))
    with pytest.raises(ModelError, match=r'tiny\.onnx as tiny: it has no .*concat; its outputs are fields'):
        load(own(MOBILENET_THIN, outputs=('concat',)), path, runtime)


@pytest.mark.parametrize('threads', [0, 1, 3])
def test_many_images_give_what_each_gives_alone(runtime, tmp_path, monkeypatch, threads):
    """Of any number, in their order, bit for bit, also where more sizes come than are kept; and results stay."""
    if runtime == 'openvino' and threads == 1:
        monkeypatch.setattr('openpose_ros_pkg.networks.backends.openvino._KEPT_BYTES', 0)
    path = onnx_file(tmp_path, tiny_networks.onnx_fields([weights_of(57)]))
    model = own(MOBILENET_THIN, input=InputRecipe(), outputs=('fields',), output_layout='NCHW')
    backend = load(model, path, runtime, threads=threads)
    random = np.random.default_rng(0)
    before = []
    for count, side in ((0, 16), (1, 16), (2, 16), (3, 24), (20, 16), (2, 24)):
        images = [random.integers(0, 256, (1, side, side, 3), dtype=np.uint8)[:, :, ::-1] for _ in range(count)]
        many = backend.infer_many(images)
        assert len(many) == count
        before += [(fields, backend.infer(image)[0]) for (fields,), image in zip(many, images)]
    for fields, alone in before:
        np.testing.assert_array_equal(fields, alone)


def test_after_an_error_the_next_images_are_computed(pooled):
    model, path, expected = pooled
    backend = load(model, path, 'openvino', threads=2)
    with pytest.raises(Exception, match=r'shape|dimension|size'):
        backend.infer_many([IMAGES[:1], IMAGES[:1], IMAGES[:1, 8:], IMAGES[:1]])
    many = backend.infer_many([IMAGES[i:i + 1] for i in range(len(IMAGES))])
    assert_fields(np.concatenate([fields for fields, in many]), expected)


# --- OpenVINO: hints, compiled networks on disk ---------------------------------------------------------------------

def test_openvino_sends_no_usage_data(tmp_path):
    """It would keep the number of this user in a folder of its own."""
    pytest.importorskip('openvino', reason='openvino is not installed: pip install openvino')
    environment = {name: value for name, value in os.environ.items() if name not in ('CI', 'TF_BUILD', 'JENKINS_URL')}
    environment.update(HOME=str(tmp_path), PYTHONPATH=os.pathsep.join(sys.path))
    subprocess.run([sys.executable, '-c', 'import openpose_ros_pkg.networks.backends.openvino'], env=environment,
                   check=True)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def pooled(tmp_path):
    pytest.importorskip('openvino', reason='openvino is not installed: pip install openvino')
    weights = weights_of(57)
    model = own(MOBILENET_THIN, input=InputRecipe(), outputs=('fields',), output_layout='NCHW')
    return model, onnx_file(tmp_path, tiny_networks.onnx_fields([weights])), expected_fields(
        IMAGES, model.input, weights)


def blobs(folder):
    return sorted((folder / 'openpose_ros_compiled').glob('*.blob'))


def test_compiled_network_is_kept_and_the_file_not_read_again(pooled, tmp_path, monkeypatch):
    model, path, expected = pooled
    cache = tmp_path / 'cache' / 'deep'
    assert_fields(infer_all(load(model, path, 'openvino', compiled_cache=str(cache)), IMAGES)[0], expected)
    assert len(blobs(cache)) == 2  # of the self-check's size and of this one

    from openpose_ros_pkg.networks.backends.openvino import OpenvinoBackend
    monkeypatch.delattr(OpenvinoBackend, '_prepared')
    assert_fields(infer_all(load(model, path, 'openvino', compiled_cache=str(cache)), IMAGES)[0], expected)


@pytest.mark.parametrize('change', ['mean', 'threads', 'file'])
def test_compiled_network_of_something_else_is_not_taken(pooled, tmp_path, change):
    model, path, expected = pooled
    cache = str(tmp_path / 'cache')
    load(model, path, 'openvino', compiled_cache=cache)
    if change == 'mean':
        model = replace(model, input=replace(model.input, mean=100.0))
        expected = expected_fields(IMAGES, model.input, weights_of(57))
    if change == 'file':
        onnx_file(tmp_path, tiny_networks.onnx_fields([weights_of(57) * 2, weights_of(1)], outputs=('fields', 'more')))
        expected = expected * 2
    backend = load(model, path, 'openvino', compiled_cache=cache, threads=int(change == 'threads'))
    assert len(blobs(Path(cache))) == 2
    assert_fields(infer_all(backend, IMAGES)[0], expected)


@pytest.mark.parametrize('damage', [lambda content: b'', lambda content: content[:len(content) // 2],
                                    lambda content: content[:-100] + bytes(100)],
                         ids=['empty', 'half', 'end overwritten'])
def test_damaged_compiled_network_is_compiled_again(pooled, tmp_path, caplog, damage):
    model, path, expected = pooled
    cache = tmp_path / 'cache'
    load(model, path, 'openvino', compiled_cache=str(cache))
    blob, = blobs(cache)
    blob.write_bytes(damage(blob.read_bytes()))
    assert_fields(infer_all(load(model, path, 'openvino', compiled_cache=str(cache)), IMAGES)[0], expected)
    assert 'is damaged: it is compiled again' in caplog.text
    caplog.clear()
    load(model, path, 'openvino', compiled_cache=str(cache))  # what was kept again is whole
    assert blob.exists() and 'is damaged' not in caplog.text


def test_the_cache_deletes_only_what_it_wrote(pooled, tmp_path, monkeypatch):
    model, path, _ = pooled
    cache, hexadecimal = tmp_path / 'cache', 16 * 'a1'
    own = cache / 'openpose_ros_compiled'
    own.mkdir(parents=True)
    of_user = [tmp_path / 'elsewhere.bag', cache / 'walk.bag', cache / f'{hexadecimal}.blob', own / 'notes.txt',
               own / 'camera.blob', own / f'{hexadecimal}.blob.old', own / f'{hexadecimal}.blob' / 'walk.bag']
    for file in of_user:
        file.parent.mkdir(exist_ok=True)
        file.write_bytes(bytes(100))
        os.utime(str(file), (0, 0))
    link = own / f'{16 * "b2"}.blob'
    link.symlink_to(of_user[0])
    monkeypatch.setattr('openpose_ros_pkg.networks.backends.compiled_cache._MAX_BYTES', 10)
    load(model, path, 'openvino', compiled_cache=str(cache))
    assert [file for file in of_user if not file.is_file()] == [] and link.is_symlink()
    assert set(blobs(cache)) == {link, own / 'camera.blob', own / f'{hexadecimal}.blob'}  # its own were too large

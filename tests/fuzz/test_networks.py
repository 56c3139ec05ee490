"""Files of networks: weights of TensorFlow.js, zip files, the cache of compiled networks; what files tell, outputs."""
import base64
import hashlib
import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from fuzzing import mutated, spoiled, survives, written
from openpose_ros_pkg.decode.boxes import decode_boxes
from openpose_ros_pkg.decode.direct import DirectThresholds, decode_direct
from openpose_ros_pkg.decode.paf import DecodeParams, decode_fields
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.backends.compiled_cache import CompiledCache
from openpose_ros_pkg.networks.model_registry import MODELS
from openpose_ros_pkg.networks.model_types import skeleton_of
from openpose_ros_pkg.networks.network_file import Graph, recognized
from openpose_ros_pkg.networks.preprocess import ImageToNet
from openpose_ros_pkg.networks.tfjs import frozen_graph
from openpose_ros_pkg.networks.weights_install import archive_member
from openpose_ros_pkg.people import People2D

KERNEL = np.ones((1, 1, 3, 8), np.float16)


def attribute(text):
    return {'s': base64.b64encode(text.encode()).decode()}


GRAPH = {
    'modelTopology': {'node': [
        {'name': 'input', 'op': 'Placeholder', 'attr': {'dtype': {'type': 'DT_INT32'}, 'shape': {'shape': {
            'dim': [{'size': '1'}, {'size': '4'}, {'size': '4'}, {'size': '3'}]}}}},
        {'name': 'kernel', 'op': 'Const', 'attr': {'dtype': {'type': 'DT_FLOAT'}}},
        {'name': 'bias', 'op': 'Const', 'attr': {'dtype': {'type': 'DT_FLOAT'}}},
        {'name': 'result', 'op': '_FusedConv2D', 'input': ['input', 'kernel', 'bias'], 'attr': {
            'T': {'type': 'DT_FLOAT'}, 'padding': attribute('SAME'), 'strides': {'list': {'i': ['1'] * 4}},
            'epsilon': {'f': 0.1}, 'fused_ops': {'list': {'s': [attribute('BiasAdd')['s']]}}}}]},
    'weightsManifest': [{'paths': ['graph.bin'], 'weights': [
        {'name': 'kernel', 'shape': [1, 1, 3, 8], 'dtype': 'float32', 'quantization': {'dtype': 'float16'}},
        {'name': 'bias', 'shape': [8], 'dtype': 'float32'}]}]}
STORED = KERNEL.tobytes() + np.zeros(8, np.float32).tobytes()


@example(b'{"modelTopology": {"node": [null]}, "weightsManifest": [null]}', STORED)
@given(st.one_of(mutated(json.dumps(GRAPH).encode()), spoiled(GRAPH).map(lambda value: json.dumps(value).encode())),
       st.one_of(st.just(STORED), mutated(STORED)))
def test_graph_of_tensorflow_js(tmp_path_factory, graph, stored):
    folder = tmp_path_factory.getbasetemp()
    (folder / 'graph.bin').write_bytes(stored)
    (folder / 'graph.json').write_bytes(graph)
    content = survives(frozen_graph, folder / 'graph.json', size=len(graph) + len(stored), errors=(ModelError, OSError))
    assert content is None or isinstance(content, bytes)


@given(mutated(hashlib.sha256(b'compiled' * 50).digest() + b'compiled' * 50))
def test_cache_of_compiled_networks(tmp_path_factory, content):
    folder = tmp_path_factory.getbasetemp() / 'compiled'
    cache = CompiledCache(folder)
    cache.store('key', b'compiled' * 50)
    next(folder.glob('*.blob')).write_bytes(content)
    assert survives(cache.load, 'key', size=len(content)) in (None, b'compiled' * 50)


def zip_with(**members):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, 'w', zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(f'sdk/{name}.onnx', content)
    return buffer.getvalue()


ZIP, BOMB = zip_with(end2end=bytes(range(256)) * 20, other=b'other'), zip_with(end2end=bytes(50 << 20))


@example(BOMB)
@example(BOMB.replace((50 << 20).to_bytes(4, 'little'), (1 << 20).to_bytes(4, 'little')))
@given(mutated(ZIP, BOMB))
def test_member_of_a_zip_file(tmp_path_factory, content):
    path = written(tmp_path_factory, 'net.zip', content)
    found = survives(archive_member, path, 'end2end.onnx', 1 << 20, size=len(content),
                     errors=(ModelError,), memory=32 << 20)
    assert found is None or len(found) <= 1 << 20


SIZES = st.sampled_from((None, 0, 1, 2, 5, 6, 8, 17, 26, 34, 56, 57, 85, 100, 133, 192, 256, 384, 416, 512, 640, 3549))
SHAPES = st.lists(SIZES, max_size=5).map(tuple)
NAMES = ('dets', 'keypoints', 'labels', 'simcc_x', 'simcc_y', 'output0', '0')
IMAGES = st.one_of(SHAPES, st.tuples(st.sampled_from((None, 1)), st.just(3), SIZES, SIZES))


@example((1, 3, 640, 640), [()], {'dets': (1, 60, 5), 'keypoints': (1, 60, 17, 3)})
@given(IMAGES, st.lists(SHAPES, max_size=2), st.dictionaries(st.sampled_from(NAMES), SHAPES, max_size=4))
def test_shapes_of_networks(image, others, outputs):
    model = survives(recognized, Path('/nets/mine.onnx'), Graph([image, *others], outputs), size=1000,
                     errors=(ModelError,))
    assert model is None or set(model.outputs) <= set(outputs)


# By decoder: points, and the shapes of what networks give for N people.
FORMS = (('movenet_multipose', 17, lambda n: [(n, 56)]), ('movenet_singlepose', 17, lambda n: [(1, 17, 3)]),
         ('rtmo', 17, lambda n: [(n, 5), (n, 17, 3)]), ('yolo_pose', 17, lambda n: [(56, n + 1)]),
         ('yolo_pose', 17, lambda n: [(n, 57)]), ('simcc', 17, lambda n: [(17, 64), (17, 48)]),
         ('simcc', 133, lambda n: [(133, 64), (133, 48)]), ('yolox', 17, lambda n: [(n, 5), (n,)]),
         ('yolox', 17, lambda n: [(62, 85)]), ('paf', 17, lambda n: [(57, 6, 8)]))
ODD = st.sampled_from((np.nan, np.inf, -np.inf, 0.0, 1e30, -1e30, 1e-30, 89.0, -89.0))


@given(st.sampled_from(FORMS), st.integers(0, 5), st.integers(0, 1000), st.sampled_from((0.1, 1.0, 30.0, 1e4)),
       st.lists(st.tuples(ODD, st.integers(0, 2 ** 16)), max_size=6))
def test_numbers_that_networks_give(form, people, seed, scale, odd):
    decoder, points, shapes = form
    random = np.random.RandomState(seed)
    outputs = [(scale * random.normal(0, 1, shape)).astype(np.float32) for shape in shapes(people)]
    for value, place in odd:
        flat = outputs[place % len(outputs)].reshape(-1)
        if len(flat):
            flat[place % len(flat)::max(place % 7, 1)] = value
    size = (32, 24) if decoder == 'simcc' else (64, 48)
    if decoder == 'yolox':
        boxes, scores = survives(decode_boxes, outputs, 0.0, size, size=1 << 16)
        assert np.isfinite(boxes).all() and ((scores > 0) & (scores <= 1)).all()
        return
    model = replace(MODELS['mobilenet_thin'], decoder=decoder, points=points, skeleton=skeleton_of(points))
    with np.errstate(all='ignore'):
        poses = (survives(decode_fields, outputs[0], model, DecodeParams(), size=1 << 16) if decoder == 'paf' else
                 survives(decode_direct, outputs, model, DirectThresholds(), ImageToNet(size, size, size),
                          size=1 << 16))
    found = People2D(model.skeleton, poses.keypoints, poses.scores, np.full(len(poses.scores), -1), points=poses.points)
    assert found.present.any(axis=1).all() and np.isfinite(found.scores).all()

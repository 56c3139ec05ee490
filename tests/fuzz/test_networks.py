"""Files of networks: weights of TensorFlow.js, zip files, the cache of compiled networks."""
import base64
import hashlib
import io
import json
import zipfile

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from fuzzing import mutated, spoiled, survives, written
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.backends.compiled_cache import CompiledCache
from openpose_ros_pkg.networks.tfjs import frozen_graph
from openpose_ros_pkg.networks.web_archive import DownloadLimits, zip_member

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
    found = survives(zip_member, path, 'end2end.onnx', 0, DownloadLimits(most_bytes=1 << 20), size=len(content),
                     errors=(ModelError,), memory=32 << 20)
    assert found is None or len(found) <= 1 << 20

"""A graph of TensorFlow.js becomes a frozen graph of TensorFlow that computes the same."""
import base64
import json

import numpy as np
import pytest

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.tfjs import frozen_graph

FLOAT = {'type': 'DT_FLOAT'}
# Large enough to be kept in half precision.
KERNEL = np.random.default_rng(0).normal(size=(1, 1, 3, 8)).astype(np.float16)
BIAS = np.arange(8, dtype=np.float32) - 3
STORED = KERNEL.tobytes() + BIAS.tobytes()


def text(value):
    return {'s': base64.b64encode(value.encode()).decode()}


def convolution(fused=('BiasAdd', 'Relu')):
    return {'name': 'result', 'op': '_FusedConv2D', 'input': ['picture', 'kernel', 'bias'], 'attr': {
        'T': FLOAT, 'padding': text('SAME'), 'data_format': text('NHWC'), 'strides': {'list': {'i': ['1'] * 4}},
        'dilations': {'list': {'i': ['1'] * 4}}, 'epsilon': {'f': 0.1}, 'num_args': {'i': '1'},
        'fused_ops': {'list': {'s': [text(name)['s'] for name in fused]}}}}


@pytest.fixture
def graph(tmp_path):
    """Write a graph of one convolution of a uint8 image; changes are made by the caller."""
    def write(node=None, stored=STORED):
        shape = {'shape': {'dim': [{'size': side} for side in ('1', '4', '5', '3')]}}
        nodes = [{'name': 'input', 'op': 'Placeholder', 'attr': {'dtype': {'type': 'DT_INT32'}, 'shape': shape}},
                 {'name': 'picture', 'op': 'Cast', 'input': ['input'],
                  'attr': {'SrcT': {'type': 'DT_INT32'}, 'DstT': FLOAT, 'Truncate': {'b': False}}},
                 {'name': 'kernel', 'op': 'Const', 'attr': {'dtype': FLOAT}},
                 {'name': 'bias', 'op': 'Const', 'attr': {'dtype': FLOAT}}, node or convolution()]
        weights = [{'name': 'kernel', 'shape': KERNEL.shape, 'dtype': 'float32', 'quantization': {'dtype': 'float16'}},
                   {'name': 'bias', 'shape': BIAS.shape, 'dtype': 'float32'}]
        (tmp_path / 'graph.bin').write_bytes(stored)
        path = tmp_path / 'graph.json'
        path.write_text(json.dumps({'modelTopology': {'node': nodes},
                                    'weightsManifest': [{'paths': ['graph.bin'], 'weights': weights}]}))
        return path
    return write


@pytest.mark.parametrize('fused', [('BiasAdd', 'Relu'), ('BiasAdd', 'Relu6'), ('BiasAdd',)])
def test_the_frozen_graph_computes_the_same(graph, tmp_path, fused):
    openvino = pytest.importorskip('openvino', reason='OpenVINO, which reads the graph, is not installed')
    path = tmp_path / 'graph.pb'
    path.write_bytes(frozen_graph(graph(convolution(fused))))
    core = openvino.Core()
    network = core.compile_model(core.read_model(str(path)), 'CPU', {'INFERENCE_PRECISION_HINT': 'f32'})
    image = np.random.default_rng(1).integers(0, 3, (1, 4, 5, 3), dtype=np.uint8)
    expected = image @ KERNEL[0, 0].astype(np.float32) + BIAS
    if len(fused) == 2:
        expected = np.clip(expected, 0, 6 if fused[1] == 'Relu6' else None)
    assert network.inputs[0].element_type == openvino.Type.u8
    np.testing.assert_allclose(network(image)[0], expected, atol=1e-5)


@pytest.mark.parametrize('change, expected', [
    ({'stored': KERNEL.tobytes()}, 'buffer'), ({'stored': bytes(200)}, '80 bytes of weights are described, 200'),
    ({'node': convolution(('Relu',))}, "fuses .*'Relu'"), ({'node': convolution(('BiasAdd', 'Relu', 'Relu'))}, 'fuses'),
    ({'node': {'name': 'scale', 'op': 'Const'}}, "'scale'"),
    ({'node': {'name': 'x', 'op': 'Relu', 'attr': {'f': {'tensor': {}}}}}, "kind 'tensor'")])
def test_what_is_not_known_is_refused(graph, change, expected):
    with pytest.raises(ModelError, match=expected):
        frozen_graph(graph(**change))

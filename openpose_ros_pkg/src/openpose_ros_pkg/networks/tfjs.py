"""Convert a graph of TensorFlow.js to a frozen graph of TensorFlow, without TensorFlow.

The file is written in protobuf's wire format. Numbers of fields: tensorflow/core/framework, graph.proto,
node_def.proto, attr_value.proto, tensor.proto, tensor_shape.proto, types.proto. Only what MoveNet needs is converted:

- Fused convolutions of TensorFlow.js become convolution, bias and activation.
- Weights stay in half precision and are cast to float: the file stays small.
- The input becomes uint8.
"""
import base64
import struct
from pathlib import Path
from typing import Any, Dict, Iterable, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.structured_text import json_value

_TYPES = {'DT_FLOAT': 1, 'DT_INT32': 3, 'DT_UINT8': 4, 'DT_INT64': 9, 'DT_BOOL': 10, 'DT_HALF': 19}
_STORED = {'float32': '<f4', 'float16': '<f2', 'int32': '<i4'}
# Smaller weights are scalars and axes, kept in full precision.
_LEAST_HALF = 16
_FUSED = {'_FusedConv2D': 'Conv2D', 'FusedDepthwiseConv2dNative': 'DepthwiseConv2dNative'}
_OF_CONVOLUTION = ('T', 'strides', 'padding', 'data_format', 'dilations', 'explicit_paddings')
# Version of graphs that has all their operations (versions.proto, producer).
_PRODUCER = 440

_Attributes = Iterable[Tuple[str, bytes]]


def frozen_graph(graph: Path) -> bytes:
    """Return the frozen graph (.pb) of a graph of TensorFlow.js.

    Args:
        graph: its JSON file; the weights that it names lie beside it.

    Raises:
        ModelError: the weights do not fit, or an operation or attribute is not supported.
        OSError: a file can not be read.
    """
    try:
        content = json_value(graph.read_text(encoding='utf-8'))
        weights = _weights(content['weightsManifest'], graph.parent)
        nodes = b''.join(_converted(node, weights) for node in content['modelTopology']['node'])
    except (AttributeError, KeyError, OverflowError, TypeError, ValueError, struct.error) as error:
        raise ModelError(f'{graph} is not a graph of TensorFlow.js that can be converted: {error!r}') from error
    return nodes + _bytes(4, _number(1, _PRODUCER))


def _weights(manifest: Sequence[Dict[str, Any]], folder: Path) -> Dict[str, np.ndarray]:
    weights = {}
    for group in manifest:
        stored, start = b''.join((folder / name).read_bytes() for name in group['paths']), 0
        for entry in group['weights']:
            dtype = np.dtype(_STORED[entry.get('quantization', entry)['dtype']])
            count = int(np.prod(entry['shape'], dtype=int))
            weights[entry['name']] = np.frombuffer(stored, dtype, count, start).reshape(entry['shape'])
            start += count * dtype.itemsize
        if start != len(stored):
            raise ValueError(f'{start} bytes of weights are described, {len(stored)} are there')
    return weights


def _converted(node: Dict[str, Any], weights: Dict[str, np.ndarray]) -> bytes:
    """Return the node or nodes that replace one node."""
    name, operation, inputs, attributes = node['name'], node['op'], node.get('input', []), node.get('attr', {})
    if operation == 'Const':
        return _constant(name, weights[name])
    if operation in _FUSED:
        return _convolution(name, _FUSED[operation], inputs, attributes)
    values = {key: _attribute(value) for key, value in attributes.items()}
    if operation == 'Placeholder':
        values['dtype'] = _type('DT_UINT8')
    elif operation == 'Cast' and inputs == ['input']:
        values['SrcT'] = _type('DT_UINT8')
    return _node(name, operation, inputs, values.items())


def _constant(name: str, weights: np.ndarray) -> bytes:
    if weights.dtype == np.int32:
        return _node(name, 'Const', (), (('dtype', _type('DT_INT32')), ('value', _tensor('DT_INT32', weights))))
    if weights.size < _LEAST_HALF or weights.dtype != np.float16:
        weights = weights.astype('<f4')
        return _node(name, 'Const', (), (('dtype', _type('DT_FLOAT')), ('value', _tensor('DT_FLOAT', weights))))
    half = f'{name}/half'
    return (_node(half, 'Const', (), (('dtype', _type('DT_HALF')), ('value', _tensor('DT_HALF', weights))))
            + _node(name, 'Cast', (half,), (('SrcT', _type('DT_HALF')), ('DstT', _type('DT_FLOAT')))))


def _convolution(name: str, operation: str, inputs: Sequence[str], attributes: Dict[str, Any]) -> bytes:
    """Return a fused convolution as convolution, bias and, if any, activation."""
    fused = [base64.b64decode(text).decode() for text in attributes['fused_ops']['list']['s']]
    if fused[:1] != ['BiasAdd'] or len(fused) > 2 or len(inputs) != 3:
        raise ValueError(f'{name} has {len(inputs)} inputs and fuses {fused}, expected 3, a bias and one activation')
    convolution, biased = f'{name}/conv', f'{name}/bias' if len(fused) == 2 else name
    parts = [_node(convolution, operation, inputs[:2], [(key, _attribute(value)) for key, value in attributes.items()
                                                        if key in _OF_CONVOLUTION]),
             _node(biased, 'BiasAdd', (convolution, inputs[2]),
                   (('T', _type('DT_FLOAT')), ('data_format', _bytes(2, b'NHWC'))))]
    if len(fused) == 2:
        parts.append(_node(name, fused[1], (biased,), (('T', _type('DT_FLOAT')),)))
    return b''.join(parts)


def _node(name: str, operation: str, inputs: Iterable[str], attributes: _Attributes) -> bytes:
    return _bytes(1, _bytes(1, name.encode()) + _bytes(2, operation.encode())
                  + b''.join(_bytes(3, text.encode()) for text in inputs)
                  + b''.join(_bytes(5, _bytes(1, key.encode()) + _bytes(2, value))
                             for key, value in sorted(attributes)))


def _attribute(value: Dict[str, Any]) -> bytes:
    (kind, content), = value.items()
    if kind == 'list':
        return _bytes(1, b''.join(_attribute({each: item}) for each, items in content.items() for item in items))
    if kind == 's':
        return _bytes(2, base64.b64decode(content))
    if kind in ('i', 'b'):
        return _number({'i': 3, 'b': 5}[kind], int(content))
    if kind == 'f':
        return _varint(4 << 3 | 5) + struct.pack('<f', content)
    if kind == 'type':
        return _type(content)
    if kind == 'shape':
        return _bytes(7, _shape(int(side.get('size', 0)) for side in content.get('dim', [])))
    raise ValueError(f'attributes of the kind {kind!r} are not known')


def _tensor(dtype: str, array: np.ndarray) -> bytes:
    return _bytes(8, _number(1, _TYPES[dtype]) + _bytes(2, _shape(array.shape)) + _bytes(4, array.tobytes()))


def _shape(sides: Iterable[int]) -> bytes:
    return b''.join(_bytes(2, _number(1, side)) for side in sides)


def _type(name: str) -> bytes:
    return _number(6, _TYPES[name])


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _bytes(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | 2) + _varint(len(content)) + content


def _varint(value: int) -> bytes:
    """Return seven bits in each byte, the lowest first; negative numbers as 64 bits."""
    value &= (1 << 64) - 1
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7f | 0x80)
        value >>= 7
    return bytes([*out, value])

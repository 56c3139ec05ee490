"""Networks of a few nodes in the file formats of the runtimes, for tests without weights.

ONNX and Caffe files are protocol buffers; the few fields that are needed are written by hand, so that no test needs the
libraries of those frameworks. Field numbers: onnx/onnx.proto, caffe.proto.
"""
import struct

import numpy as np


def varint(number):
    """An integer in base 128, lowest digit first."""
    number &= (1 << 64) - 1
    digits = bytearray()
    while number > 0x7f:
        digits.append(number & 0x7f | 0x80)
        number >>= 7
    return bytes([*digits, number])


def message(*fields):
    """A protocol buffer of (number, value) pairs; the value's type tells how it is written."""
    data = b''
    for number, value in fields:
        if isinstance(value, float):
            data += varint(number << 3 | 5) + struct.pack('<f', value)
        elif isinstance(value, int):
            data += varint(number << 3) + varint(value)
        else:
            value = value.encode() if isinstance(value, str) else value
            data += varint(number << 3 | 2) + varint(len(value)) + value
    return data


# --- ONNX -----------------------------------------------------------------------------------------------------------

FLOAT, UINT8, INT64 = 1, 2, 7


def onnx_tensor(name, array):
    kind = {np.dtype(np.float32): FLOAT, np.dtype(np.int64): INT64}[array.dtype]
    return message(*((1, size) for size in array.shape), (2, kind), (8, name), (9, array.tobytes()))


def onnx_node(kind, inputs, outputs, name='', **attributes):
    """A node; attributes are integers or lists of them."""
    fields = [(1, text) for text in inputs] + [(2, text) for text in outputs] + [(3, name or outputs[0]), (4, kind)]
    for key, value in attributes.items():
        if isinstance(value, int):
            fields.append((5, message((1, key), (3, value), (20, 2))))
        else:
            fields.append((5, message((1, key), *((8, item) for item in value), (20, 7))))
    return message(*fields)


def onnx_value(name, kind, shape):
    """An input or output; texts in the shape stand for sizes that are free."""
    sizes = [(1, message((2, size) if isinstance(size, str) else (1, size))) for size in shape]
    return message((1, name), (2, message((1, message((1, kind), (2, message(*sizes)))))))


def onnx_model(nodes, constants, inputs, outputs):
    """An ONNX file; constants is a dictionary of arrays."""
    graph = message(*((1, node) for node in nodes), (2, 'tiny'),
                    *((5, onnx_tensor(name, array)) for name, array in constants.items()),
                    *((11, value) for value in inputs), *((12, value) for value in outputs))
    return message((1, 7), (7, graph), (8, message((1, ''), (2, 12))))


def onnx_fields(weights, layout='NCHW', kind=FLOAT, outputs=('fields',), height='height', width='width'):
    """Fields of stride 8: output channel k is the sum over colours c of weights[k][c] * mean of c over the cell.

    Weights are (channels, 3) float32 for each output; the layout is that of input and outputs.
    """
    nodes, constants, image = [], {}, 'image'
    if kind != FLOAT:
        nodes.append(onnx_node('Cast', [image], ['real'], to=FLOAT))
        image = 'real'
    if layout == 'NHWC':
        nodes.append(onnx_node('Transpose', [image], ['planes'], perm=[0, 3, 1, 2]))
        image = 'planes'
    for i, (name, array) in enumerate(zip(outputs, weights)):
        result = f'{name}_planes' if layout == 'NHWC' else name
        constants[f'kernel_{i}'] = average_kernel(array)
        # A node is not always called as what it computes.
        nodes.append(onnx_node('Conv', [image, f'kernel_{i}'], [result], name=f'Conv_{i}', kernel_shape=[8, 8],
                               strides=[8, 8]))
        if layout == 'NHWC':
            nodes.append(onnx_node('Transpose', [result], [name], perm=[0, 2, 3, 1]))
    sizes = {'NCHW': ('batch', 3, height, width), 'NHWC': ('batch', height, width, 3)}[layout]
    free = ('batch', 'a', 'b', 'c')
    return onnx_model(nodes, constants, [onnx_value('image', kind, sizes)],
                      [onnx_value(name, FLOAT, free) for name in outputs])


def average_kernel(weights):
    """(channels, 3, 8, 8) float32 kernel that averages 8 x 8 pixels of each colour and weighs the averages."""
    return np.repeat(np.asarray(weights, np.float32)[:, :, None] / 64, 64, axis=2).reshape(-1, 3, 8, 8)


def onnx_people(outputs, size=('height', 'width'), batch=1, first='Cast'):
    """A network that finds the same people in every picture: outputs (1, ...), times the picture's mean value.

    Args:
        size: height and width of the input; texts for free ones.
        batch: number of images, or a text; the outputs then have it as well.
        first: kind of the operation on the image: Cast, Slice of each second row, Conv of means of 8 x 8 pixels, or
            DepthToSpace, which leaves it as it is.
    """
    constants = {'Conv': {'kernel': average_kernel(np.eye(3))}, 'Slice': {
        name: np.array([number]) for name, number in (('start', 0), ('end', 1 << 30), ('axis', 2), ('step', 2))}
    }.get(first, {})
    options = {'Cast': {'to': FLOAT}, 'Conv': {'kernel_shape': [8, 8]}, 'DepthToSpace': {'blocksize': 1}}.get(first, {})
    nodes = [onnx_node(first, ['image', *constants], ['real'], **options),
             onnx_node('ReduceMean', ['real'], ['mean'], keepdims=0)]
    for name, array in outputs.items():
        constants[f'{name}_constant'] = array
        nodes.append(onnx_node('Mul', [f'{name}_constant', 'mean'], [name]))
    return onnx_model(nodes, constants, [onnx_value('image', FLOAT, (batch, 3, *size))],
                      [onnx_value(name, FLOAT, (batch, *array.shape[1:])) for name, array in outputs.items()])


# --- Caffe ----------------------------------------------------------------------------------------------------------

def caffe_fields(weights, name='net_output'):
    """As `onnx_fields` with one output: (text of the prototxt, content of the caffemodel).

    As in OpenPose's files, the input has no size of its own, and a Concat of two convolutions makes the output.
    """
    parts = np.array_split(np.asarray(weights, np.float32), 2)
    text, layers = 'name: "tiny"\ninput: "image"\ninput_dim: 1\ninput_dim: 3\ninput_dim: 1\ninput_dim: 1\n', b''
    for i, part in enumerate(parts):
        text += (f'layer {{ name: "conv_{i}" type: "Convolution" bottom: "image" top: "conv_{i}" convolution_param '
                 f'{{ num_output: {len(part)} kernel_size: 8 stride: 8 bias_term: false }} }}\n')
        kernel = average_kernel(part)
        blob = message((5, kernel.tobytes()), (7, message((1, b''.join(varint(size) for size in kernel.shape)))))
        layers += message((100, message((1, f'conv_{i}'), (2, 'Convolution'), (3, 'image'), (4, f'conv_{i}'),
                                        (7, blob))))
    text += (f'layer {{ name: "{name}" type: "Concat" bottom: "conv_0" bottom: "conv_1" top: "{name}" concat_param '
             '{ axis: 1 } }\n')
    return text, message((1, 'tiny')) + layers

"""Networks recognized by names and shapes of inputs and outputs: the path of such a file is a `pose_model`."""
import math
from dataclasses import replace
from functools import reduce
from pathlib import Path
from typing import Any, Callable, Dict, FrozenSet, List, NamedTuple, Optional, Tuple

from openpose_ros_pkg.decode.boxes import cells
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.model_types import (
    RTMO_INPUT,
    RTMW_SCALE,
    SIMCC_INPUT,
    YOLO_INPUT,
    YOLOX_INPUT,
    Decoder,
    Model,
    Shape,
    UserFiles,
    WeightsFile,
    skeleton_of,
)
from openpose_ros_pkg.skeletons import POINT_SETS

_Fields = Dict[str, Any]  # of `Model`, which tell what a network turned out to be
NETWORK_SUFFIXES = ('.onnx', '.xml')
# Of mmdeploy's files of SimCC networks.
_SIMCC_NAMES = ('simcc_x', 'simcc_y')


class Graph(NamedTuple):
    """What a file tells of its network."""

    inputs: List[Shape]  # shapes of the inputs, the image first
    outputs: Dict[str, Shape]  # shapes of the outputs by name
    begins: FrozenSet[str] = frozenset()  # kinds of the operations on the image, by OpenVINO's names
    shuffles: bool = False  # whether it has an operation DepthToSpace

    @property
    def size(self) -> Optional[Tuple[int, int]]:
        """(width, height) of the image [px], the first input; None: free."""
        height, width = self.inputs[0][2:]
        return (width, height) if width and height else None


def read_network_file(path: Path) -> Model:
    """Return the pose network in a file, named like the file.

    Raises:
        ModelError: OpenVINO is not there or can not read the file, or its inputs and outputs fit no kind, or several.
    """
    try:
        from openpose_ros_pkg.networks.backends.openvino import graph_shapes
    except ImportError as error:
        raise ModelError(f'{path} can not be read: openvino is not importable: {error}; describe the network in a '
                         '.yaml file: docs/networks.md, "A network of your own"') from error
    return recognized(path, Graph(*graph_shapes(path), shuffles=b'DepthToSpace' in path.read_bytes()))


def recognized(path: Path, graph: Graph) -> Model:
    """Return the pose network of a file by what it tells; raise ModelError as `read_network_file`."""
    image = graph.inputs[0] if graph.inputs else ()
    kinds = []
    if len(image) == 4 and image[1] == 3 and image[0] in (1, None):
        kinds = [kind for kind in (recognize(graph) for recognize in _RECOGNIZERS) if kind]
    if len(kinds) != 1:
        raise _unknown(path, graph)
    kind, = kinds
    recipe = kind['input']
    if graph.size:
        recipe = replace(recipe, fixed_size=graph.size, multiple_of=reduce(math.gcd, graph.size, recipe.multiple_of))
    files = [path.name, f'{path.stem}.bin'] if path.suffix == '.xml' else [path.name]
    return Model(name=path.name, skeleton=skeleton_of(kind.get('points', 17)),
                 files=tuple(WeightsFile(name) for name in files), licence='as its maker says',
                 source=UserFiles(f'the maker of {path}'), stride=recipe.multiple_of, description=path,
                 **{**kind, 'input': recipe})


def _rtmo(graph: Graph) -> Optional[_Fields]:
    """RTMO: mmdeploy names its outputs dets and keypoints."""
    if len(graph.inputs) == 1 and set(graph.outputs) == {'dets', 'keypoints'}:
        return {'decoder': Decoder.RTMO, 'input': RTMO_INPUT, 'outputs': ('dets', 'keypoints')}
    return None


def _yolo_pose(graph: Graph) -> Optional[_Fields]:
    """YOLO-pose: one output, (1, 56, N) or (1, N, 57): box, score, and 17 joints of three numbers.

    Converters name it differently.
    """
    shapes = list(graph.outputs.values())
    if len(graph.inputs) == len(shapes) == 1 and len(shapes[0]) == 3 and (shapes[0][1] == 56 or shapes[0][2] == 57):
        return {'decoder': Decoder.YOLO_POSE, 'input': YOLO_INPUT, 'outputs': ()}
    return None


def _simcc(graph: Graph) -> Optional[_Fields]:
    """SimCC: mmdeploy's simcc_x and simcc_y, (1, points, bins) with as many bins per pixel of the input along both."""
    shapes = [graph.outputs.get(name, ()) for name in _SIMCC_NAMES]
    if len(graph.inputs) != 1 or graph.size is None or [len(shape) for shape in shapes] != [3, 3]:
        return None
    (_, points, along_x), (_, others, along_y) = shapes
    width, height = graph.size
    if points not in POINT_SETS or others != points or not (along_x and along_y) or along_x * height != along_y * width:
        return None
    # RTMW's head alone brings coarse features to finer ones by DepthToSpace.
    return {'decoder': Decoder.SIMCC, 'input': SIMCC_INPUT, 'outputs': _SIMCC_NAMES, 'points': points,
            'output_scale': RTMW_SCALE if graph.shuffles else 1.0}


def _yolox(graph: Graph) -> Optional[_Fields]:
    """YOLOX for boxes: dets (1, N, 5) and labels (1, N) by mmdeploy; or (1, N, 6) or (1, N, 85) with N cells.

    RTMDet has the outputs of the first form as well, and colours of another scale. YOLOX begins with a slice of each
    second pixel, RTMDet with a convolution.
    """
    shapes = graph.outputs
    if len(graph.inputs) != 1 or graph.size is None:
        return None
    if set(shapes) == {'dets', 'labels'} and shapes['dets'][2:] == (5,) and len(shapes['labels']) == 2:
        is_yolox = graph.begins & {'Slice', 'StridedSlice'}
        return {'decoder': Decoder.BOXES, 'input': YOLOX_INPUT, 'outputs': ('dets', 'labels')} if is_yolox else None
    for name, shape in shapes.items():
        if len(shapes) == 1 and len(shape) == 3 and shape[1] == cells(graph.size) and shape[2] in (6, 85):
            return {'decoder': Decoder.BOXES, 'input': YOLOX_INPUT, 'outputs': (name,)}
    return None


_EXPECTED = (
    'of YOLO-pose with one class and 17 joints (1, 56, N) or (1, N, 57); of RTMO dets and keypoints; of RTMPose with K '
    '= 17, 26 or 133 points simcc_x (1, K, 2 W) and simcc_y (1, K, 2 H); of YOLOX dets '
    'and labels')
_RECOGNIZERS: Tuple[Callable[[Graph], Optional[_Fields]], ...] = (_rtmo, _yolo_pose, _simcc, _yolox)


def _unknown(path: Path, graph: Graph) -> ModelError:
    def shown(shape: Shape) -> str:
        return f"({', '.join('?' if size is None else str(size) for size in shape)})"
    outputs = ', '.join(f'{name} {shown(shape)}' for name, shape in graph.outputs.items())
    return ModelError(
        f"{path} does not tell what network it is: inputs {', '.join(map(shown, graph.inputs))}, outputs "
        f'{outputs}; expected an image (1, 3, H, W), and {_EXPECTED}. Describe any other network in a .yaml file: '
        'docs/networks.md, "A network of your own"')

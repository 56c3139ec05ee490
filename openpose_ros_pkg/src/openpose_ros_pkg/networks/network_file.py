"""Networks recognized by their outputs: the path of such a file is a `pose_model`."""
from dataclasses import replace
from pathlib import Path
from typing import Dict, List, Tuple

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.model_types import RTMO_INPUT, YOLO_INPUT, Model, Shape, UserFiles, WeightsFile
from openpose_ros_pkg.skeletons import COCO_18

NETWORK_SUFFIXES = ('.onnx', '.xml')


def read_network_file(path: Path) -> Model:
    """Return the YOLO-pose or RTMO network in a file, named like the file.

    Raises:
        ModelError: no installed runtime can read the file, or its outputs are of another kind.
    """
    inputs, outputs = _graph_shapes(path)
    names, recipe, decoder = tuple(outputs), YOLO_INPUT, 'yolo_pose'
    if set(names) == {'dets', 'keypoints'}:
        names, recipe, decoder = ('dets', 'keypoints'), RTMO_INPUT, 'rtmo'
    elif _is_yolo_pose(list(outputs.values())):
        names = ()  # converters name the one output differently
    else:
        raise _unknown(path, inputs, outputs)
    if len(inputs) != 1 or len(inputs[0]) != 4 or inputs[0][1] != 3:
        raise _unknown(path, inputs, outputs)
    height, width = inputs[0][2:]
    if height and width:
        recipe = replace(recipe, fixed_size=(width, height))
    files = [path.name, f'{path.stem}.bin'] if path.suffix == '.xml' else [path.name]
    return Model(name=path.name, skeleton=COCO_18, files=tuple(WeightsFile(name) for name in files),
                 licence='as its maker says', source=UserFiles(f'the maker of {path}'), input=recipe, outputs=names,
                 decoder=decoder, stride=recipe.multiple_of, description=path)


def _is_yolo_pose(outputs: List[Shape]) -> bool:
    """Return whether there is one output, (1, 56, N) or (1, N, 57): box, score, and 17 joints of three numbers."""
    return len(outputs) == 1 and len(outputs[0]) == 3 and (outputs[0][1] == 56 or outputs[0][2] == 57)


def _graph_shapes(path: Path) -> Tuple[List[Shape], Dict[str, Shape]]:
    """Return the shapes of the inputs, and of the outputs by name; raise ModelError if it can not be read."""
    try:
        from openpose_ros_pkg.networks.backends import openvino
        return openvino.graph_shapes(path)
    except ImportError as error:
        reason = f'openvino is not importable: {error}'
    if path.suffix == '.onnx':
        try:
            from openpose_ros_pkg.networks.backends import onnxruntime
            return onnxruntime.graph_shapes(path)
        except ImportError as error:
            reason += f'; onnxruntime is not importable: {error}'
    raise ModelError(f'{path} can not be read: {reason}')


def _unknown(path: Path, inputs: List[Shape], outputs: Dict[str, Shape]) -> ModelError:
    def told(shape: Shape) -> str:
        return f"({', '.join('?' if size is None else str(size) for size in shape)})"
    return ModelError(
        f"{path} does not tell what network it is: inputs {', '.join(map(told, inputs))}, outputs "
        f"{', '.join(f'{name} {told(shape)}' for name, shape in outputs.items())}; expected an image (1, 3, H, W), and "
        '(1, 56, N) or (1, N, 57) of YOLO-pose with one class and 17 joints, or dets and keypoints of RTMO. Describe '
        'any other network in a .yaml file: docs/networks.md, "A network of your own"')

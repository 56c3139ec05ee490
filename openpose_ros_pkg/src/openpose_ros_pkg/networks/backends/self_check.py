"""Check at every start, with one small image, that a runtime computes a network right.

One version of OpenCV was seen to compute the default network wrongly on all channels without any error. Networks of
the registry that may be passed on have an image with a known output; of the others the structure is checked.

`python3 -m openpose_ros_pkg.networks.backends.self_check` makes the references again, from the weights in the model
folder.
"""
from pathlib import Path
from typing import TYPE_CHECKING, Callable, Dict, List, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.models import MOBILENET_THIN, MOVENET_MULTIPOSE, Model, weights_path

if TYPE_CHECKING:
    from openpose_ros_pkg.networks.backends import Backend

# Runtimes with float32 differ by 5e-6 on the default network, whose values reach 1; the reference is rounded to
# float16 (2.5e-4). A wrong network was off by 1.2.
_EXACT_TOLERANCE = 2e-3
# bf16 keeps 8 bits of each number. MoveNet: noise of 2 grey levels moves its scores by 0.1, red and blue exchanged by
# 0.28; positions, in parts of the image, move less.
_REDUCED_TOLERANCE = {'paf': 0.1, 'movenet_multipose': 0.2}
# People of MoveNet below this score are noise and differ between runtimes.
_SURE = 0.3
_HELP = 'set the parameter backend to another one, or install another version of this runtime'


def reference_path(model: Model) -> Path:
    """Return the file with the known input and output of a model; not every model has one."""
    return Path(__file__).resolve().parent.parent / 'data' / f'{model.name}_self_check.npz'


def check_backend(backend: 'Backend', model: Model, exact: bool) -> None:
    """Compare a backend's output with the known one, or with what the model says where none is known.

    Args:
        exact: whether it computes in float32 throughout.

    Raises:
        ModelError: it can not compute the network, or its result is wrong.
    """
    path = reference_path(model)
    if path.is_file():
        with np.load(str(path)) as reference:
            image = reference['image']
            expected = [reference[f'output_{i}'].astype(np.float32) for i in range(len(model.outputs))]
        fault = _difference_fault(_computed(backend, model, image), expected, model, exact)
    else:
        image = _any_image(model)
        fault = _structure_fault(_computed(backend, model, image), model, (image.shape[0], image.shape[1]))
    if fault:
        raise ModelError(f'{backend.description} computes {model.name} wrongly: {fault}; {_HELP}')


def _computed(backend: 'Backend', model: Model, image: np.ndarray) -> Tuple[np.ndarray, ...]:
    try:
        return backend.infer(image[np.newaxis])
    except ModelError:
        raise
    except Exception as error:  # the errors of runtimes have no class in common
        raise ModelError(f'{backend.description} can not compute {model.name}: {error}; {_HELP}') from error


def _listed(shapes: Sequence[Tuple[int, ...]]) -> str:
    return ' and '.join(str(shape) for shape in shapes)


def _difference_fault(outputs: Sequence[np.ndarray], expected: Sequence[np.ndarray], model: Model, exact: bool) -> str:
    """Return how outputs differ from the known ones; empty where they are right."""
    shapes, known = [output.shape for output in outputs], [array.shape for array in expected]
    if shapes != known:
        return f'its outputs have the shapes {_listed(shapes)}, expected {_listed(known)}'
    tolerance = _EXACT_TOLERANCE if exact else _REDUCED_TOLERANCE[model.decoder]
    difference = _DIFFERENCES[model.decoder](outputs, expected)
    if difference <= tolerance:
        return ''
    # NaN as well
    return f'its output for a known image is off by up to {difference:.3g}, expected at most {tolerance:g}'


def _greatest_difference(outputs: Sequence[np.ndarray], expected: Sequence[np.ndarray]) -> float:
    return max(float(np.abs(output - array).max()) for output, array in zip(outputs, expected))


def _greatest_difference_of_people(outputs: Sequence[np.ndarray], expected: Sequence[np.ndarray]) -> float:
    """Return the greatest difference of MoveNet's sure people from those who are most like them.

    Scores that are nearly equal change places between runtimes, and joints that it does not see jump: both count
    only where the reference is sure.
    """
    found, greatest = outputs[0][0], 0.0
    for person in expected[0][0]:
        if person[55] < _SURE:
            continue
        counts = np.ones(56, bool)
        counts[:51] = np.repeat(person[2:51:3] >= _SURE, 3)
        greatest = np.fmax(greatest, np.abs(found[:, counts] - person[counts]).max(axis=1).min())
    return float(greatest) if np.isfinite(found).all() else float('nan')


# Decoders of the models that have a reference.
_DIFFERENCES: Dict[str, Callable[[Sequence[np.ndarray], Sequence[np.ndarray]], float]] = {
    'paf': _greatest_difference, 'movenet_multipose': _greatest_difference_of_people}


def _structure_fault(outputs: Sequence[np.ndarray], model: Model, size: Tuple[int, int]) -> str:
    """Return how number, shapes and range of outputs differ from what the model says; empty where they do not.

    Args:
        size: (height, width) of the image [px].
    """
    shapes = [output.shape for output in outputs]
    if len(outputs) != len(model.outputs):
        return f'it has {len(outputs)} outputs, expected {len(model.outputs)}'
    expected, right = _STRUCTURES[model.decoder](model, shapes, size)
    if not right:
        return (f"its outputs {', '.join(model.outputs)} have the shapes {_listed(shapes)} for an image of "
                f'{size[1]}x{size[0]}, expected {expected}: does the description of the model fit its file?')
    for name, output in zip(model.outputs, outputs):
        if not np.isfinite(output).all():
            return f'its output {name} has values that are not finite'
    return ''


def _fields_structure(model: Model, shapes: List[Tuple[int, ...]], size: Tuple[int, int]) -> Tuple[str, bool]:
    height, width = (side // model.stride for side in size)
    expected = (f'(1, C, {height}, {width}) with {model.channels} channels in all ({model.heatmaps} confidence maps '
                f'and {model.channels - model.heatmaps} of the affinity fields)')
    right = all(len(shape) == 4 and shape[0] == 1 and shape[2:] == (height, width) for shape in shapes)
    return expected, right and sum(shape[1] for shape in shapes) == model.channels


def _movenet_structure(model: Model, shapes: List[Tuple[int, ...]], size: Tuple[int, int]) -> Tuple[str, bool]:
    return '(1, N, 56)', len(shapes[0]) == 3 and shapes[0][::2] == (1, 56)


def _single_person_structure(model: Model, shapes: List[Tuple[int, ...]], size: Tuple[int, int]) -> Tuple[str, bool]:
    return '(1, 1, 17, 3)', shapes[0] == (1, 1, 17, 3)


def _rtmo_structure(model: Model, shapes: List[Tuple[int, ...]], size: Tuple[int, int]) -> Tuple[str, bool]:
    boxes, joints = shapes
    right = len(boxes) == 3 and boxes[::2] == (1, 5) and joints == (1, boxes[1], 17, 3)
    return '(1, N, 5) and (1, N, 17, 3)', right


# What the outputs of each decoder's networks look like, in words, and whether shapes are so.
_STRUCTURES: Dict[str, Callable[[Model, List[Tuple[int, ...]], Tuple[int, int]], Tuple[str, bool]]] = {
    'paf': _fields_structure, 'movenet_multipose': _movenet_structure,
    'movenet_singlepose': _single_person_structure, 'rtmo': _rtmo_structure}


def _any_image(model: Model) -> np.ndarray:
    """Return an image of a person in a size that the network takes, (H, W, 3) uint8 BGR."""
    person = _mannequin()
    least = model.input.multiple_of
    width, height = model.input.fixed_size or (-(-side // least) * least for side in (person.shape[1], person.shape[0]))
    return cv2.resize(person, (width, height))


def make_reference(backend: 'Backend', model: Model, image: np.ndarray) -> None:
    """Write the file that `check_backend` reads, with a backend that is known to be right.

    Args:
        image: (H, W, 3) uint8 BGR in a size that the network takes.
    """
    outputs = {f'output_{i}': output.astype(np.float16) for i, output in enumerate(backend.infer(image[np.newaxis]))}
    path = reference_path(model)
    path.parent.mkdir(exist_ok=True)
    np.savez_compressed(str(path), image=image, **outputs)


def _mannequin() -> np.ndarray:
    """Draw a simple person, (112, 80, 3) uint8 BGR: enough to excite confidence maps and affinity fields."""
    image = np.full((112, 80, 3), (150, 165, 160), np.uint8)
    skin, shirt, trousers = (120, 150, 205), (60, 60, 180), (90, 50, 40)

    def limb(points: Tuple[Tuple[int, int], ...], colour: Tuple[int, int, int], thickness: int) -> None:
        cv2.polylines(image, [np.array(points, np.int32)], False, colour, thickness)

    limb(((34, 58), (32, 82), (31, 104)), trousers, 8)
    limb(((46, 58), (48, 82), (49, 104)), trousers, 8)
    limb(((40, 30), (40, 56)), shirt, 18)
    limb(((30, 28), (24, 44)), shirt, 6)
    limb(((50, 28), (56, 44)), shirt, 6)
    limb(((24, 44), (22, 60)), skin, 5)
    limb(((56, 44), (58, 60)), skin, 5)
    limb(((40, 20), (40, 26)), skin, 6)
    cv2.ellipse(image, (40, 13), (7, 9), 0, 0, 360, skin, -1)
    cv2.ellipse(image, (40, 8), (8, 6), 0, 180, 360, (30, 40, 50), -1)
    for x in (37, 43):
        cv2.circle(image, (x, 12), 1, (20, 20, 20), -1)
    cv2.line(image, (38, 18), (42, 18), (80, 80, 160), 1)
    return image


if __name__ == '__main__':
    # OpenCV 4 was found to agree with TensorFlow on the default network; OpenVINO is the one that reads TFLite.
    from openpose_ros_pkg.networks.backends import BackendParams
    from openpose_ros_pkg.networks.backends.opencv_dnn import OpencvBackend
    from openpose_ros_pkg.networks.backends.openvino import OpenvinoBackend
    _params = BackendParams(compiled_cache='off')
    make_reference(OpencvBackend(MOBILENET_THIN, weights_path(MOBILENET_THIN), _params), MOBILENET_THIN, _mannequin())
    # MoveNet needs a more natural image: on the drawn person a noise of half a grey level moves its scores by 0.2.
    # The file holds frame 30 of skeleton_extract_3d/demo/cross at 256 x 160, in steps of 8 grey levels: it is small.
    with np.load(str(reference_path(MOVENET_MULTIPOSE))) as _kept:
        make_reference(OpenvinoBackend(MOVENET_MULTIPOSE, weights_path(MOVENET_MULTIPOSE), _params), MOVENET_MULTIPOSE,
                       _kept['image'])

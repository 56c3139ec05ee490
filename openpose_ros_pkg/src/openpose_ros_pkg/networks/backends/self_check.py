"""Check, with one small image, that a runtime computes a network right.

One version of OpenCV was seen to compute the default network wrongly on all channels without any error. Networks of
the registry that may be passed on have an image with a known output; of the others the structure is checked. In float32
the numbers of the output are compared, in reduced precision the people that are decoded from it.

`python3 -m openpose_ros_pkg.networks.backends.self_check` makes the references again, from the weights in the model
folder.
"""
from pathlib import Path
from typing import TYPE_CHECKING, Callable, Dict, List, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.decode.direct import DirectDecodeParams, decode_direct
from openpose_ros_pkg.decode.paf import DecodeParams, decode_fields
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.models import (
    FACE_LANDMARK,
    HAND_LANDMARK,
    MOBILENET_THIN,
    MOVENET_MULTIPOSE,
    MOVENET_THUNDER,
    Model,
    weights_path,
)
from openpose_ros_pkg.people import Poses

if TYPE_CHECKING:
    from openpose_ros_pkg.networks.backends import Backend

# Runtimes with float32 differ by 5e-6 on the default network, whose values reach 1; the reference is rounded to
# float16 (2.5e-4). A wrong network was off by 1.2.
_EXACT_TOLERANCE = 2e-3
# Reduced precision: the median joint may lie this far from the known one [px of the network's input] and differ by this
# in score, and each joint may lie off by the greatest distance. On crops of 18 people bf16 moved the median joint of
# mobilenet_thin by 0.2 px and its score by 0.03, the worst joint by 0.9 px; red and blue exchanged moved the median
# joint by 2 px.
_JOINT_TOLERANCE, _SCORE_TOLERANCE, _GREATEST_DISTANCE = 0.5, 0.05, 4.0
# Landmarks in reduced precision: no number may be off by more than this, as a share of the greatest of its output. bf16
# was off by 0.007.
_LANDMARK_TOLERANCE = 0.05
# Joints and people below this score are noise and differ between runtimes.
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
        reference = _read(path)
        image = reference['image']
        expected = [reference[f'output_{i}'].astype(np.float32) for i in range(len(model.outputs))]
        outputs = _computed(backend, model, image)
        fault = _shapes_fault(outputs, expected)
        if not fault and exact:
            fault = _difference_fault(outputs, expected, model)
        elif not fault and not all(np.isfinite(output).all() for output in outputs):
            fault = 'its output for a known image has values that are not finite'
        elif not fault and model.decoder == 'landmarks':
            fault = _difference_fault(outputs, expected, model, _LANDMARK_TOLERANCE)
        elif not fault:
            known = _people(expected, model, image)
            fault = _people_fault(_people(outputs, model, image), known)
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


def _shapes_fault(outputs: Sequence[np.ndarray], expected: Sequence[np.ndarray]) -> str:
    shapes, known = [output.shape for output in outputs], [array.shape for array in expected]
    return '' if shapes == known else f'its outputs have the shapes {_listed(shapes)}, expected {_listed(known)}'


def _difference_fault(outputs: Sequence[np.ndarray], expected: Sequence[np.ndarray], model: Model,
                      tolerance: float = _EXACT_TOLERANCE) -> str:
    """Return how outputs differ from the known ones; empty where they are right."""
    difference = _DIFFERENCES[model.decoder](outputs, expected)
    if difference <= tolerance:
        return ''
    # NaN as well
    return f'its output for a known image is off by up to {difference:.3g}, expected at most {tolerance:g}'


def _greatest_difference(outputs: Sequence[np.ndarray], expected: Sequence[np.ndarray]) -> float:
    return max(float(np.abs(output - array).max()) for output, array in zip(outputs, expected))


def _greatest_difference_of_landmarks(outputs: Sequence[np.ndarray], expected: Sequence[np.ndarray]) -> float:
    """Return the greatest difference as a share of the greatest number of its output, which is 1 at least."""
    return max(float(np.abs(output - array).max() / max(np.abs(array).max(), 1.0))
               for output, array in zip(outputs, expected))


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


def _people(outputs: Sequence[np.ndarray], model: Model, image: np.ndarray) -> Poses:
    """Return the people that outputs show in an image, in its pixels."""
    size = image.shape[1], image.shape[0]
    if model.decoder == 'paf':
        return decode_fields(np.concatenate([output[0] for output in outputs]), model, DecodeParams(), size)
    return decode_direct([output[0] for output in outputs], model, DirectDecodeParams(), size)


def _people_fault(found: Poses, known: Poses) -> str:
    """Return how people differ from the known ones; empty where they are right.

    Only people and joints of which the reference is sure count.
    """
    for person in known.keypoints[known.scores >= _SURE]:
        sure = person[:, 2] >= _SURE
        distances = np.linalg.norm(found.keypoints[:, sure, :2] - person[sure, :2], axis=2)
        distances[np.isnan(distances)] = np.inf
        if len(distances) == 0 or not np.median(distances, axis=1).min() < np.inf:
            return 'it does not find a person in a known image'
        nearest = np.median(distances, axis=1).argmin()
        middle, greatest = np.median(distances[nearest]), distances[nearest].max()
        score = np.median(np.abs(found.keypoints[nearest, sure, 2] - person[sure, 2]))
        if middle > _JOINT_TOLERANCE or greatest > _GREATEST_DISTANCE or score > _SCORE_TOLERANCE:
            return (f'joints in a known image are off by {middle:.2f} px (median), {greatest:.2f} px at most, and '
                    f'{score:.3f} in score (median), expected at most {_JOINT_TOLERANCE:g}, {_GREATEST_DISTANCE:g} and '
                    f'{_SCORE_TOLERANCE:g}')
    return ''


# Decoders of the models that have a reference.
_DIFFERENCES: Dict[str, Callable[[Sequence[np.ndarray], Sequence[np.ndarray]], float]] = {
    'paf': _greatest_difference, 'movenet_multipose': _greatest_difference_of_people,
    'movenet_singlepose': _greatest_difference, 'landmarks': _greatest_difference_of_landmarks}


def _structure_fault(outputs: Sequence[np.ndarray], model: Model, size: Tuple[int, int]) -> str:
    """Return how number, shapes and range of outputs differ from what the model says; empty where they do not.

    Args:
        size: (height, width) of the image [px].
    """
    shapes = [output.shape for output in outputs]
    names = model.outputs or ('0',)
    if len(outputs) != len(names):
        return f'it has {len(outputs)} outputs, expected {len(names)}'
    expected, right = _STRUCTURES[model.decoder](model, shapes, size)
    if not right:
        return (f"its outputs {', '.join(names)} have the shapes {_listed(shapes)} for an image of "
                f'{size[1]}x{size[0]}, expected {expected}: does the description of the model fit its file?')
    for name, output in zip(names, outputs):
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


def _yolo_structure(model: Model, shapes: List[Tuple[int, ...]], size: Tuple[int, int]) -> Tuple[str, bool]:
    shape, = shapes
    return '(1, 56, N) or (1, N, 57)', len(shape) == 3 and shape[0] == 1 and (shape[1] == 56 or shape[2] == 57)


# What the outputs of each decoder's networks look like, in words, and whether shapes are so.
_STRUCTURES: Dict[str, Callable[[Model, List[Tuple[int, ...]], Tuple[int, int]], Tuple[str, bool]]] = {
    'paf': _fields_structure, 'movenet_multipose': _movenet_structure,
    'movenet_singlepose': _single_person_structure, 'rtmo': _rtmo_structure, 'yolo_pose': _yolo_structure}


def _any_image(model: Model) -> np.ndarray:
    """Return an image of a person in a size that the network takes, (H, W, 3) uint8 BGR."""
    person = _known_image(MOBILENET_THIN)
    least = model.input.multiple_of
    # The end-to-end form chooses 300 of its cells, of which a smaller input has not as many.
    zoom = 2 if model.decoder == 'yolo_pose' else 1
    width, height = model.input.fixed_size or (-(-zoom * side // least) * least for side in person.shape[1::-1])
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


def _known_image(model: Model) -> np.ndarray:
    """Return the image of a model's reference, (H, W, 3) uint8 BGR."""
    return _read(reference_path(model))['image']


def _read(path: Path) -> Dict[str, np.ndarray]:
    """Read a reference; raises ModelError where the file, which comes with the package, is damaged."""
    try:
        with np.load(str(path)) as reference:
            return dict(reference)
    except Exception as error:  # the formats of the archive, of its compression and of arrays have errors of their own
        raise ModelError(f'{path} is damaged, install the package again: {error}') from error


if __name__ == '__main__':
    # The files hold images of skeleton_extract_3d/demo/cross in steps of 8 or 16 grey levels, to be small: a person of
    # frame 8 at 96 x 128, frame 30 at 256 x 160, a person of frame 4 at 256 x 256; and a hand and a face that were
    # rendered alike. On a drawn person MoveNet's scores move by 0.2 with a noise of half a grey level, and
    # mobilenet_thin's joints by 2 px with bf16.
    # OpenCV 4 was found to agree with TensorFlow on the default network; OpenVINO is the one that reads the others.
    from openpose_ros_pkg.networks.backends import BackendParams
    from openpose_ros_pkg.networks.backends.opencv_dnn import OpencvBackend
    from openpose_ros_pkg.networks.backends.openvino import OpenvinoBackend
    _params = BackendParams(compiled_cache='off')
    for _model, _backend in ((MOBILENET_THIN, OpencvBackend), (MOVENET_MULTIPOSE, OpenvinoBackend),
                             (MOVENET_THUNDER, OpenvinoBackend), (HAND_LANDMARK, OpenvinoBackend),
                             (FACE_LANDMARK, OpenvinoBackend)):
        make_reference(_backend(_model, weights_path(_model), _params), _model, _known_image(_model))

"""Check, with one small image, that a runtime computes a network right.

One version of OpenCV computed the default network wrongly on all channels without an error. The fetched networks have
an image with a known output: the people that are decoded from both are compared, and the numbers of landmarks. Of other
networks the structure is checked.

A reference, data/NAME_self_check.npz, holds `image` (H, W, 3) uint8 BGR and `output_0` ... as float16. The images are
of skeleton_extract_3d/demo/cross, in steps of 8 or 16 grey levels to be small; the outputs are of OpenCV 4, which
agreed with TensorFlow on the default network, and of OpenVINO on the others.
"""
from pathlib import Path
from typing import TYPE_CHECKING, Callable, Dict, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.decode.boxes import cells
from openpose_ros_pkg.decode.direct import DirectThresholds, decode_direct
from openpose_ros_pkg.decode.paf import DecodeParams, decode_fields
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN
from openpose_ros_pkg.networks.model_types import Decoder, Model
from openpose_ros_pkg.networks.preprocess import ImageToNet
from openpose_ros_pkg.people import Poses

if TYPE_CHECKING:
    from openpose_ros_pkg.networks.backends import Backend

# Largest distance of the median joint [px of the network's input], its largest difference in score, and largest
# distance of any joint [px]. On crops of 18 people bf16 moved the median joint of mobilenet_thin by 0.2 px and its
# score by 0.03, the worst joint by 0.9 px; red and blue exchanged moved the median joint by 2 px.
_JOINT_TOLERANCE, _SCORE_TOLERANCE, _GREATEST_DISTANCE = 0.5, 0.05, 4.0
# Landmarks: largest difference as a share of the output's greatest number; 0.007 with bf16.
_LANDMARK_TOLERANCE = 0.05
# Joints and people below this score are noise and differ between runtimes.
_SURE = 0.3
_HELP = 'set the parameter backend to another one, or install another version of this runtime'

_Shapes = Sequence[Tuple[int, ...]]


def reference_path(model: Model) -> Path:
    """Return the file with the known input and output of a model; it need not exist."""
    return Path(__file__).resolve().parent.parent / 'data' / f'{model.name}_self_check.npz'


def check_backend(backend: 'Backend', model: Model) -> None:
    """Compare a backend's output with the known one, or its structure with what the model says.

    Raises:
        ModelError: it can not compute the network, or its result is wrong.
    """
    path = reference_path(model)
    if path.is_file():
        reference = _read(path)
        image = reference['image']
        expected = [reference[f'output_{i}'].astype(np.float32) for i in range(len(model.outputs))]
        fault = _output_fault(_computed(backend, model, image), expected, model, image)
    else:
        image = _any_image(model)
        fault = _structure_fault(_computed(backend, model, image), model, image.shape[:2])
    if fault:
        raise ModelError(f'{backend.description} computes {model.name} wrongly: {fault}; {_HELP}')


def _computed(backend: 'Backend', model: Model, image: np.ndarray) -> Tuple[np.ndarray, ...]:
    try:
        return backend.infer(image[np.newaxis])
    except ModelError:
        raise
    except Exception as error:  # the errors of runtimes have no class in common
        raise ModelError(f'{backend.description} can not compute {model.name}: {error}; {_HELP}') from error


def _output_fault(outputs: Sequence[np.ndarray], expected: Sequence[np.ndarray], model: Model, image: np.ndarray
                  ) -> str:
    """Return how outputs differ from the known ones; empty: they do not."""
    shapes, known = [output.shape for output in outputs], [array.shape for array in expected]
    if shapes != known:
        return f'its outputs have the shapes {_listed(shapes)}, expected {_listed(known)}'
    if not all(np.isfinite(output).all() for output in outputs):
        return 'its output for a known image has values that are not finite'
    if model.decoder != 'landmarks':
        return _people_fault(_people(outputs, model, image), _people(expected, model, image))
    difference = max(float(np.abs(output - array).max() / max(np.abs(array).max(), 1.0))
                     for output, array in zip(outputs, expected))
    if difference <= _LANDMARK_TOLERANCE:
        return ''
    return f'its output for a known image is off by up to {difference:.3g}, expected at most {_LANDMARK_TOLERANCE:g}'


def _people(outputs: Sequence[np.ndarray], model: Model, image: np.ndarray) -> Poses:
    """Return the people decoded from outputs [px of the image]."""
    size = image.shape[1], image.shape[0]
    if model.decoder == Decoder.PAF:
        return decode_fields(np.concatenate([output[0] for output in outputs]), model, DecodeParams(), size)
    return decode_direct([output[0] for output in outputs], model, DirectThresholds(), ImageToNet(size, size, size))


def _people_fault(found: Poses, known: Poses) -> str:
    """Return how the sure people and joints of the reference are off; empty: they are right."""
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


def _listed(shapes: _Shapes) -> str:
    return ' and '.join(str(shape) for shape in shapes)


def _structure_fault(outputs: Sequence[np.ndarray], model: Model, size: Sequence[int]) -> str:
    """Return how number, shapes and values of outputs differ from what the model says; empty: they do not.

    Args:
        size: (height, width) of the image [px].
    """
    shapes = [output.shape for output in outputs]
    names = model.outputs or ('0',)
    if len(outputs) != len(names):
        return f'it has {len(outputs)} outputs, expected {len(names)}'
    if model.decoder == Decoder.PAF:
        expected, right = _fields_structure(model, shapes, size)
    else:
        expected, is_right = _STRUCTURES[model.decoder]
        right = is_right(model, size, *shapes)
    if not right:
        return (f"its outputs {', '.join(names)} have the shapes {_listed(shapes)} for an image of "
                f'{size[1]}x{size[0]}, expected {expected}: does the description of the model fit its file?')
    infinite = [name for name, output in zip(names, outputs) if not np.isfinite(output).all()]
    return f'its output {infinite[0]} has values that are not finite' if infinite else ''


def _fields_structure(model: Model, shapes: _Shapes, size: Sequence[int]) -> Tuple[str, bool]:
    """Return the expected shapes of fields in words, and whether shapes are so."""
    height, width = (side // model.stride for side in size)
    expected = (f'(1, C, {height}, {width}) with {model.channels} channels in all ({model.heatmaps} confidence maps '
                f'and {model.channels - model.heatmaps} of the affinity fields)')
    right = all(len(shape) == 4 and shape[0] == 1 and shape[2:] == (height, width) for shape in shapes)
    return expected, right and sum(shape[1] for shape in shapes) == model.channels


# By decoder: the expected shapes of the outputs in words, and whether shapes are so, for a model and (height, width).
_STRUCTURES: Dict[str, Tuple[str, Callable[..., bool]]] = {
    Decoder.MOVENET_MULTIPOSE: ('(1, N, 56)', lambda _, size, people: len(people) == 3 and people[::2] == (1, 56)),
    Decoder.MOVENET_SINGLEPOSE: ('(1, 1, 17, 3)', lambda _, size, person: person == (1, 1, 17, 3)),
    Decoder.RTMO: ('(1, N, 5) and (1, N, 17, 3)', lambda _, size, boxes, joints: (
        len(boxes) == 3 and boxes[::2] == (1, 5) and joints == (1, boxes[1], 17, 3))),
    Decoder.YOLO_POSE: ('(1, 56, N) or (1, N, 57)', lambda _, size, people: (
        len(people) == 3 and people[0] == 1 and (people[1] == 56 or people[2] == 57))),
    Decoder.SIMCC: ('(1, points, bins) along x and along y, as many per pixel', lambda model, size, x, y: (
        len(x) == len(y) == 3 and x[:2] == y[:2] == (1, model.points) and x[2] * size[0] == y[2] * size[1] > 0)),
    Decoder.HEAT_MAPS: ('(1, points, rows, columns)', lambda model, size, maps: (
        len(maps) == 4 and maps[:2] == (1, model.points) and maps[2] * size[1] == maps[3] * size[0] > 0)),
    Decoder.PICODET: ('(1, N, 4) and (1, 1, N)', lambda _, size, boxes, scores: (
        len(boxes) == 3 and boxes[::2] == (1, 4) and scores == (1, 1, boxes[1]))),
    Decoder.BOXES: ('(1, N, 5) and (1, N), or (1, cells, 6 or more)', lambda _, size, boxes, *classes: (
        len(boxes) == 3 and boxes[0] == 1 and (boxes[2] == 5 and classes == (boxes[:2],) if classes else
                                               boxes[2] >= 6 and boxes[1] == cells(size[::-1]))))}


def _any_image(model: Model) -> np.ndarray:
    """Return an image of a person in a size that the network takes, (H, W, 3) uint8 BGR."""
    person = _read(reference_path(MOBILENET_THIN))['image']
    least = model.input.multiple_of
    # The end-to-end form chooses 300 of its cells; a smaller input has fewer.
    zoom = 2 if model.decoder == Decoder.YOLO_POSE else 1
    width, height = model.input.fixed_size or (-(-zoom * side // least) * least for side in person.shape[1::-1])
    return cv2.resize(person, (width, height))


def _read(path: Path) -> Dict[str, np.ndarray]:
    """Read a reference; raises ModelError where the file, which comes with the package, is damaged."""
    try:
        with np.load(str(path)) as reference:
            return dict(reference)
    except Exception as error:  # the formats of the archive, of its compression and of arrays have errors of their own
        raise ModelError(f'{path} is damaged, install the package again: {error}') from error

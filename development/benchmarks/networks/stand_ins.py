"""Networks of known answers and known work: random weights compute, and MoveNet's people are put into their outputs.

Random weights find no people, so the chain would have nothing to lift and to follow. A stand-in computes the network
and then writes into its outputs what MoveNet finds in the same input, MultiPose in whole images and Thunder on crops.
MoveNet computes each input once, as a camera that plays a sequence brings the same ones again. All passes are recorded,
also these.
"""
import hashlib
import json
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.networks.backends import BackendParams, create_backend
from openpose_ros_pkg.networks.model_registry import MOVENET_MULTIPOSE, MOVENET_THUNDER
from openpose_ros_pkg.networks.model_types import Decoder, Model
from openpose_ros_pkg.networks.models import weights_path

Outputs = Tuple[np.ndarray, ...]
# Rows of MoveNet MultiPose below this are no people.
_SURE = 0.2


class Call(NamedTuple):
    """Passes of a network that were asked for at once."""

    end: float  # time.monotonic() [s]
    network: str
    shapes: List[Tuple[int, ...]]  # of each image
    together: bool  # by `infer_many`
    seconds: float  # that it took [s]


class Recorder:
    """A network whose passes are recorded."""

    def __init__(self, name: str, network: Any, calls: List[Call]) -> None:
        self._title, self._network, self._calls = name, network, calls
        self.name, self.description, self.fallback = network.name, network.description, network.fallback

    def infer(self, images: np.ndarray) -> Outputs:
        return self._recorded(self._network.infer, images, [images.shape])

    def infer_many(self, images: Sequence[np.ndarray]) -> List[Outputs]:
        return self._recorded(self._network.infer_many, images, [image.shape for image in images])

    def _recorded(self, call: Callable[[Any], Any], images: Any, shapes: List[Tuple[int, ...]]) -> Any:
        begin = time.monotonic()
        outputs, end = call(images), time.monotonic()
        self._calls.append(Call(end, self._title, shapes, call == self._network.infer_many, end - begin))
        return outputs


class StandIn:
    """A network with MoveNet's people in its outputs.

    Args:
        teacher: MoveNet; it sees images of this size (width, height), after `fit`.
        answer: puts the people of the teacher's outputs into those of the network, for an input of a size (H, W).
    """

    def __init__(self, network: Any, teacher: Any, fit: Callable[[np.ndarray], np.ndarray],
                 answer: Callable[[Outputs, np.ndarray, Tuple[int, int]], Outputs]) -> None:
        self._network, self._teacher, self._fit, self._answer = network, teacher, fit, answer
        self._known: Dict[bytes, np.ndarray] = {}
        self.name, self.description, self.fallback = network.name, network.description, network.fallback

    def infer(self, images: np.ndarray) -> Outputs:
        return self._answered(self._network.infer(images), images)

    def infer_many(self, images: Sequence[np.ndarray]) -> List[Outputs]:
        return [self._answered(outputs, image) for outputs, image in zip(self._network.infer_many(images), images)]

    def _answered(self, outputs: Outputs, images: np.ndarray) -> Outputs:
        # a part of the pixels tells images of a played sequence apart
        key = hashlib.blake2b(np.ascontiguousarray(images[0, ::8, ::8]).tobytes(), digest_size=16).digest()
        if key not in self._known:
            self._known[key] = self._teacher.infer(self._fit(images[0])[np.newaxis])[0]
        return self._answer(outputs, self._known[key], images.shape[1:3])


def create_stand_in(model: Model, weights: Path, params: BackendParams, calls: List[Call]) -> Any:
    """Return a recorded network; one of a file, with MoveNet's people in its outputs (of RF-DETR: with its own)."""
    network = Recorder(model.name, create_backend(model, weights, params), calls)
    if model.description is None or model.decoder not in ANSWERS:
        return network
    of_crops = model.decoder == Decoder.SIMCC
    taught_by = MOVENET_THUNDER if of_crops else MOVENET_MULTIPOSE
    teacher = Recorder(taught_by.name, create_backend(taught_by, weights_path(taught_by), params), calls)
    return StandIn(network, teacher, _square if of_crops else _smaller, ANSWERS[model.decoder])


def write_calls(calls: Sequence[Call], path: Path) -> None:
    path.write_text('\n'.join(json.dumps(call) for call in calls))


def read_calls(path: Path) -> List[Call]:
    return [Call(*json.loads(line)) for line in path.read_text().splitlines()]


def _smaller(image: np.ndarray) -> np.ndarray:
    """Return a whole image in the size that MultiPose sees, with the same proportions."""
    scale = 384 / max(image.shape[:2])
    height, width = (max(round(side * scale / 32), 1) * 32 for side in image.shape[:2])
    return cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)


def _square(image: np.ndarray) -> np.ndarray:
    """Return a crop of 3:4 in the middle of Thunder's square."""
    side = MOVENET_THUNDER.input.fixed_size or (256, 256)
    crop = cv2.resize(image, (side[0] * 3 // 4, side[1]), interpolation=cv2.INTER_AREA)
    border = (side[0] - crop.shape[1]) // 2
    return cv2.copyMakeBorder(crop, 0, 0, border, side[0] - crop.shape[1] - border, cv2.BORDER_REPLICATE)


def _people(rows: np.ndarray, size: Tuple[int, int]) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return joints (P, 17, 3) and boxes (P, 4) [px of an input of a size (H, W)] and scores (P,) of MultiPose."""
    rows = rows[0] if rows.ndim == 3 else rows
    rows = rows[rows[:, 55] >= _SURE]
    joints = rows[:, :51].reshape(-1, 17, 3)[..., [1, 0, 2]] * (size[1], size[0], 1)
    boxes = rows[:, [52, 51, 54, 53]] * (size[1], size[0], size[1], size[0])
    return joints.astype(np.float32), boxes.astype(np.float32), np.full(len(rows), 0.9, np.float32)


def _as_simcc(outputs: Outputs, rows: np.ndarray, size: Tuple[int, int]) -> Outputs:
    """Write a maximum of a joint's score into its row of bins; of Thunder's square the middle three quarters count."""
    joints = rows.reshape(17, 3)
    answers = [np.full_like(output, -0.1) for output in outputs]
    places = ((joints[:, 1] - 1 / 8) * 4 / 3, joints[:, 0])
    for answer, place in zip(answers, places):
        bins = answer.shape[2]
        answer[0, np.arange(17), np.clip(np.rint(place * bins), 0, bins - 1).astype(int)] = joints[:, 2]
    return tuple(answers)


def _as_rtmo(_outputs: Outputs, rows: np.ndarray, size: Tuple[int, int]) -> Outputs:
    joints, boxes, scores = _people(rows, size)
    return np.concatenate([boxes, scores[:, None]], axis=1)[None], joints[None]


def _as_yolo(outputs: Outputs, rows: np.ndarray, size: Tuple[int, int]) -> Outputs:
    joints, boxes, scores = _people(rows, size)
    answer = np.zeros_like(outputs[0])
    if answer.shape[2] == 57:
        rows = np.hstack([boxes, scores[:, None], np.zeros((len(boxes), 1)), joints.reshape(-1, 51)])
        answer[0, :len(rows)] = rows
    else:
        sides = boxes[:, 2:] - boxes[:, :2]
        rows = np.hstack([boxes[:, :2] + sides / 2, sides, scores[:, None], joints.reshape(-1, 51)])
        answer[0, :, :len(rows)] = rows.T
    return (answer,)


def _as_detr(outputs: Outputs, rows: np.ndarray, size: Tuple[int, int]) -> Outputs:
    joints, _, scores = _people(rows, size)
    answers = [np.zeros_like(output) for output in outputs]
    answers[0][0, :len(scores)] = scores
    answers[-1].reshape(answers[-1].shape[1], 17, 2)[:len(scores)] = joints[..., :2] / (size[1], size[0])
    return tuple(answers)


def _as_boxes(_outputs: Outputs, rows: np.ndarray, size: Tuple[int, int]) -> Outputs:
    _, boxes, scores = _people(rows, size)
    return np.concatenate([boxes, scores[:, None]], axis=1)[None], np.zeros((1, len(boxes)), np.float32)


ANSWERS: Dict[str, Callable[[Outputs, np.ndarray, Tuple[int, int]], Outputs]] = {
    Decoder.SIMCC: _as_simcc, Decoder.RTMO: _as_rtmo, Decoder.YOLO_POSE: _as_yolo, Decoder.DETR_POSE: _as_detr,
    Decoder.BOXES: _as_boxes}

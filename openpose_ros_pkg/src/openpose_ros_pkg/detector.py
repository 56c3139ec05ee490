"""From an image to the people in it: preprocess, network, decoder."""
import logging
import os
import threading
import time
from dataclasses import dataclass, replace
from typing import List

import cv2
import numpy as np

from openpose_ros_pkg.backends import Backend, BackendParams, create_backend
from openpose_ros_pkg.decode import DecodeParams, decode
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.models import Model, find_model, weights_path
from openpose_ros_pkg.params import Parameters, parameter
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.preprocess import ImageToNet, fit_image

_log = logging.getLogger(__name__)

# Share of a frame's time that the network may take on all cores; the rest is for messages (a cloud of 960 x 540 points
# takes 17 MB through the loopback), decoding, lifting and other programs.
_NETWORK_SHARE = 0.5
# The network's input does not become smaller than this share of its sides: people would no longer be found.
_LEAST_SCALE = 0.5
_TIMED_RUNS = 5


@dataclass(frozen=True)
class DetectorParams(Parameters):
    """Which network, and how large a picture it sees. Names and sizes are OpenPose's.

    Raises:
        ParameterError: both sides of the network's input are -1, or the scales reach zero.
    """

    pose_model: str = parameter(
        'mobilenet_thin', 'Network. COCO, the joint set that OpenPose calls so, means mobilenet_thin.')
    model_folder: str = parameter(
        '', 'Folder with the weights (<folder>/<network>/<file> or <folder>/<file>); empty: where setup puts them.')
    net_input_width: int = parameter(
        656, 'Width of the box that the image is fitted into for the network, aspect kept; -1: as the height makes it. '
             'Time goes with width times height. Smaller is faster, larger finds smaller people.',
        unit='px', minimum=-1, maximum=4096)
    net_input_height: int = parameter(
        368, 'Height of that box; -1: as the width makes it.', unit='px', minimum=-1, maximum=4096)
    target_rate: float = parameter(
        0.0, 'Make that box smaller at start, down to half its sides, as far as this processor needs to reach this '
             'rate; the log says what came out. 0: never, so that results do not depend on the machine.', unit='Hz',
        minimum=0.0, maximum=1000.0)
    num_scales: int = parameter(
        1, 'Number of sizes whose results are averaged. Each costs time; more of them finds more people of very '
           'different size.', minimum=1, maximum=8)
    scale_gap: float = parameter(
        0.3, 'Each size is smaller than the one before by this share of the first; only with num_scales above 1.',
        minimum=0.01, maximum=0.99)

    def __post_init__(self) -> None:
        super().__post_init__()
        sides = (self.net_input_width, self.net_input_height)
        if 0 in sides or max(sides) < 0:
            raise ParameterError(f"parameters 'net_input_width', 'net_input_height' = {sides[0]}, {sides[1]} are not "
                                 'allowed: pixels above 0, or -1 for one of them')
        smallest = 1 - (self.num_scales - 1) * self.scale_gap
        if smallest <= 0:
            raise ParameterError(f"parameters 'num_scales', 'scale_gap' = {self.num_scales}, {self.scale_gap} are not "
                                 f'allowed: the last scale would be {smallest:g}, expected above 0')


class Detector:
    """Find people in images. Any thread may call it; the network computes one image at a time."""

    def __init__(self, model: Model, backend: Backend, params: DetectorParams, decode_params: DecodeParams) -> None:
        self.model = model
        self.backend = backend
        self._params = params
        self._decode_params = decode_params
        self._lock = threading.Lock()

    def detect(self, bgr: np.ndarray) -> People2D:
        """Find the people in an image, the surest first.

        Args:
            bgr: (H, W, 3) uint8 BGR; not modified.

        Returns:
            People in pixels of the image, without ids. Joints lie within it: x in 0 .. W - 1, y in 0 .. H - 1.

        Raises:
            BadInputError: not such an image, or an empty one.
        """
        _check_image(bgr)
        size = (bgr.shape[1], bgr.shape[0])
        plans = [self._plan(size, 1 - i * self._params.scale_gap) for i in range(self._params.num_scales)]
        fields = [self._infer(plan.apply(bgr)) for plan in plans]
        keypoints, scores = decode(_averaged(fields, plans, self.model.stride), self.model, self._decode_params,
                                   plans[0].scaled_size)
        # Half a pixel beyond the centre of the outermost pixel is still that pixel.
        keypoints[..., :2] = np.clip(plans[0].to_image(keypoints[..., :2]), 0, np.subtract(size, 1))
        return People2D(self.model.skeleton, keypoints, scores, np.full(len(scores), -1))

    def _plan(self, image_size: tuple, zoom: float) -> ImageToNet:
        return fit_image(image_size, self._params.net_input_width, self._params.net_input_height, self.model.stride,
                         zoom)

    def _infer(self, image: np.ndarray) -> np.ndarray:
        with self._lock:
            return self.backend.infer(image[np.newaxis])[0]


def create_detector(params: DetectorParams, backend_params: BackendParams, decode_params: DecodeParams) -> Detector:
    """Load the network that the parameters name, and fit its input to the processor if `target_rate` asks for it.

    Raises:
        ParameterError: no such network, or a runtime that is not installed.
        ModelError: weights are missing or damaged, or the network computes wrong results.
    """
    model = find_model(params.pose_model)
    backend = create_backend(model, weights_path(model, params.model_folder), backend_params)
    if params.target_rate > 0:
        threads = backend_params.threads or os.cpu_count() or 1
        params = fitted_to_rate(params, _seconds_per_frame(model, backend, params, threads), model.stride)
    return Detector(model, backend, params, decode_params)


def fitted_to_rate(params: DetectorParams, seconds: float, stride: int) -> DetectorParams:
    """Return the parameters with a network input that `target_rate` allows.

    The time of the network goes with the area of its input.

    Args:
        seconds: what the network takes for the input as it is [s].
        stride: sides become multiples of it [px].
    """
    scale = np.sqrt(_NETWORK_SHARE / (params.target_rate * seconds))
    if scale >= 1:
        _log.info('the network takes %.0f ms: fast enough for %g Hz', 1000 * seconds, params.target_rate)
        return params
    scale = max(scale, _LEAST_SCALE)
    width, height = (side if side < 0 else max(int(side * scale) // stride, 1) * stride
                     for side in (params.net_input_width, params.net_input_height))
    _log.info('the network takes %.0f ms for an input of %d x %d: made %d x %d for %g Hz (target_rate)', 1000 * seconds,
              params.net_input_width, params.net_input_height, width, height, params.target_rate)
    return replace(params, net_input_width=width, net_input_height=height)


def _seconds_per_frame(model: Model, backend: Backend, params: DetectorParams, threads: int) -> float:
    """Return what the network takes when this process has its cores to itself [s].

    Other nodes start at the same moment, so the wall clock alone would make the network look slow: the processor time
    of its threads tells what it needs, and the least of a few runs leaves out what disturbs even that.
    """
    sides = [params.net_input_width, params.net_input_height]
    width, height = (side if side > 0 else max(sides) for side in sides)
    plan = fit_image((width, height), width, height, model.stride)
    images = plan.apply(np.zeros((height, width, 3), np.uint8))[np.newaxis]
    backend.infer(images)  # compiles the network for this size
    seconds = []
    for _ in range(_TIMED_RUNS):
        wall, processor = time.perf_counter(), time.process_time()
        backend.infer(images)
        seconds += [time.perf_counter() - wall, (time.process_time() - processor) / threads]
    return params.num_scales * min(seconds)


def _check_image(bgr: np.ndarray) -> None:
    """Raise BadInputError unless it is a non-empty (H, W, 3) uint8 image."""
    if not isinstance(bgr, np.ndarray) or bgr.dtype != np.uint8 or bgr.ndim != 3 or bgr.shape[2] != 3:
        actual = f'{bgr.shape} {bgr.dtype}' if isinstance(bgr, np.ndarray) else type(bgr).__name__
        raise BadInputError(f'image: expected an (H, W, 3) uint8 array, got {actual}')
    if bgr.size == 0:
        raise BadInputError(f'image of {bgr.shape[1]}x{bgr.shape[0]} pixels: expected at least 1x1')


def _averaged(fields: List[np.ndarray], plans: List[ImageToNet], stride: int) -> np.ndarray:
    """Average the fields of several scales on the grid of the first, (C, h, w) float32."""
    total = fields[0]
    for field, plan in zip(fields[1:], plans[1:]):
        total = total + _resampled(field, plan, fields[0].shape[1:], plans[0], stride)
    return total if len(fields) == 1 else total / len(fields)


def _resampled(field: np.ndarray, plan: ImageToNet, shape: tuple, target: ImageToNet, stride: int) -> np.ndarray:
    """Sample a field at the cells of another scale's grid; both differ in padding, so a plain resize would shift it."""
    height, width = shape
    cells = np.stack([np.arange(max(width, height))] * 2, axis=1)
    image = target.to_image((cells + 0.5) * stride - 0.5)
    source = ((plan.to_net(image) + 0.5) / stride - 0.5).astype(np.float32)
    x, y = np.meshgrid(source[:width, 0], source[:height, 1])
    return np.stack([cv2.remap(channel, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
                     for channel in field])

"""OpenCV's dnn module: needs nothing but OpenCV. Reads TensorFlow's frozen graphs, ONNX and, in OpenCV 4, Caffe."""
from pathlib import Path
from typing import Any, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.networks.backends import Backend, BackendParams
from openpose_ros_pkg.networks.backends.arrays import network_input, output_names, own_output
from openpose_ros_pkg.networks.model_types import InputRecipe, Model


class OpencvBackend(Backend):
    """A network by OpenCV; see `backends.Backend`.

    Raises:
        ParameterError: this OpenCV can not compute on the device.
        ModelError: OpenCV can not read the weights, or the graph lacks outputs of the model.
    """

    name = 'opencv_dnn'

    def __init__(self, model: Model, weights: Path, params: BackendParams, fallback: str = '') -> None:
        self._model, self.fallback = model, fallback
        target = _target(params.device, params.precision)
        try:
            self._net = _read(model, weights)
            existing = self._net.getUnconnectedOutLayersNames()
            self._outputs = output_names(model.outputs or existing, self._net.getLayerNames(), existing)
        except (cv2.error, ValueError) as error:
            raise ModelError(f'OpenCV can not load {weights} as {model.name}: {error}') from error
        if params.threads > 0:
            cv2.setNumThreads(params.threads)
        if params.device == 'cuda':
            cv2.cuda.setDevice(params.num_gpu_start)
            self._net.setPreferableBackend(cv2.dnn.DNN_BACKEND_CUDA)
        else:
            self._net.setPreferableBackend(cv2.dnn.DNN_BACKEND_OPENCV)
        self._net.setPreferableTarget(target)
        # The importers of TensorFlow and Caffe make NCHW of any layout; that of ONNX keeps it.
        onnx = weights.suffix == '.onnx'
        self._recipe = InputRecipe(model.input.channels, model.input.layout if onnx else 'NCHW', 'float32',
                                   model.input.mean, model.input.scale)
        self._layout = model.output_layout if onnx else 'NCHW'
        self.description = f'OpenCV dnn {cv2.__version__} (device {params.device}, precision {params.precision})'

    def infer(self, images: np.ndarray) -> Tuple[np.ndarray, ...]:
        """Compute the network; see `Backend.infer`."""
        self._net.setInput(network_input(images, self._recipe))
        # Copies: OpenCV overwrites the memory of its results.
        return tuple(own_output(output, self._model, self._layout) for output in self._net.forward(self._outputs))


def has_cuda() -> bool:
    """Return whether this OpenCV computes networks on a GPU of this machine; 4.2 never does."""
    targets = getattr(cv2.dnn, 'getAvailableTargets', None)
    return targets is not None and len(targets(cv2.dnn.DNN_BACKEND_CUDA)) > 0


def _target(device: str, precision: str) -> int:
    """Return OpenCV's number of the device and precision."""
    if device == 'cpu':
        return cv2.dnn.DNN_TARGET_CPU
    # Without CUDA it would fall back to the processor without an error.
    if device != 'cuda' or not has_cuda():
        raise ParameterError(f"parameter 'device' = {device!r} is not available in the installed OpenCV "
                             f'{cv2.__version__}: it computes on cpu, and on cuda when built with CUDA '
                             '(OPENCV_DNN_CUDA) on a machine with such a GPU; set device to cpu')
    return cv2.dnn.DNN_TARGET_CUDA_FP16 if precision == 'auto' else cv2.dnn.DNN_TARGET_CUDA


def _read(model: Model, weights: Path) -> Any:
    """Read a network; raises cv2.error for a damaged file, ModelError without a reader or one of Caffe's files."""
    # The new engine of OpenCV 5.0.0 computes networks wrongly from ONNX files; the classic one is right for all.
    engine = {'engine': cv2.dnn.ENGINE_CLASSIC} if int(cv2.__version__.split('.')[0]) >= 5 else {}
    if weights.suffix == '.onnx':
        return cv2.dnn.readNetFromONNX(str(weights), **engine)
    if weights.suffix == '.pb':
        return cv2.dnn.readNetFromTensorflow(str(weights), **engine)
    if not hasattr(cv2.dnn, 'readNetFromCaffe'):
        raise ModelError(f'OpenCV {cv2.__version__} can not load {weights} as {model.name}: it reads no Caffe '
                         'networks; OpenCV 4 does')
    files = {Path(file.name).suffix: weights.parent / file.name for file in model.files}
    if not {'.prototxt', '.caffemodel'} <= set(files):
        raise ModelError(f'OpenCV can not load {weights} as {model.name}: expected a .prototxt and a .caffemodel file, '
                         f"got {', '.join(file.name for file in model.files)}")
    return cv2.dnn.readNetFromCaffe(str(files['.prototxt']), str(files['.caffemodel']))

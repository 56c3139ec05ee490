"""Runtimes that compute a network, behind one protocol."""
import logging
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, List, NamedTuple, Protocol, Sequence, Tuple, cast

import numpy as np

from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.networks.backends.self_check import check_backend
from openpose_ros_pkg.networks.model_types import Model
from openpose_ros_pkg.params.parameters import Parameters, parameter

# With this package, each import of OpenVINO sends usage data to its maker, from a fork of the process; without it,
# OpenVINO takes a stub.
sys.modules.setdefault('openvino_telemetry', cast(Any, None))
_log = logging.getLogger(__name__)


class Backend(Protocol):
    """A network, loaded by one runtime."""

    name: str  # value of the parameter `backend` for this runtime
    description: str  # runtime, version and precision, for the log
    fallback: str  # why it is slower than what the parameters ask for; empty: it is not

    def infer(self, images: np.ndarray) -> Tuple[np.ndarray, ...]:
        """Compute the network; not thread-safe.

        The backend applies the model's `InputRecipe` but for the size: colours, layout, type, mean and scale.

        Args:
            images: (1, H, W, 3) uint8 BGR, H and W multiples of the recipe's `multiple_of`, or its `fixed_size`.
                Batches gain nothing (development/notes/decisions.md).

        Returns:
            A float32 array, not shared, for each of the model's `outputs`. Decoder 'paf': (1, C, H / stride, W /
            stride); others: as the network gives them.
        """

    def infer_many(self, images: Sequence[np.ndarray]) -> List[Tuple[np.ndarray, ...]]:
        """Return what `infer` returns for each image of one size; computed side by side where the runtime can."""
        return [self.infer(image) for image in images]


def _precision(default: str) -> str:
    doc = ('f32: reproducible. auto: OpenVINO may use bf16 (arm64: f16) where the processor has it, about twice as '
           'fast, and a GPU f16; joints move by less than a pixel. Where it computes the known image of a network '
           'wrongly, f32 takes its place. The default is auto in nodes, and f32 in programs for files and recordings.')
    return cast(str, parameter(default, doc, choices=('f32', 'auto')))


@dataclass(frozen=True)
class BackendParams(Parameters):
    """What computes the network, and how."""

    retired = ('hint',)

    backend: str = parameter(
        'auto', 'Runtime of the network: openvino (fastest on processors; all formats but Caffe), onnxruntime (ONNX '
                "only; the one for GPUs), opencv_dnn (needs nothing but OpenCV; TensorFlow's frozen graphs, ONNX, "
                "Caffe), or auto: the first of these that is installed, reads the network's file, computes on the "
                'device and passes the self-check.', choices=('auto', 'openvino', 'onnxruntime', 'opencv_dnn'))
    threads: int = parameter(
        0, 'Threads that compute the network; 0: as many as the machine has cores. With opencv_dnn this holds for all '
           'of OpenCV in the process.', minimum=0, maximum=256)
    precision: str = _precision('f32')
    device: str = parameter(
        'cpu', 'Where the network is computed: cpu; cuda, by onnxruntime-gpu or an OpenCV built with CUDA; tensorrt, '
               'by onnxruntime-gpu with TensorRT.', choices=('cpu', 'cuda', 'tensorrt'))
    num_gpu_start: int = parameter(0, 'Number of the GPU; without effect where device is cpu.', minimum=0)
    compiled_cache: str = parameter(
        '', 'Folder in which networks that OpenVINO has compiled are kept, in its subfolder openpose_ros_compiled, for '
            "a faster start; empty: the folder compiled beside that of the models in the user's cache; off: nowhere. "
            '1 GB at most; those unused for the longest time are deleted.',
        words=('off',))


@dataclass(frozen=True)
class LiveBackendParams(BackendParams):
    """What computes the network, and how."""

    precision: str = _precision('auto')


def create_backend(model: Model, weights: Path, params: BackendParams) -> Backend:
    """Load a network, check its results, and log the chosen runtime with the reason.

    Args:
        weights: the first of the model's files.

    Raises:
        ParameterError: the runtime of `params.backend` is not installed, does not read such files, or does not compute
            on the device.
        ModelError: the weights can not be loaded, or the results are wrong.
    """
    if params.backend != 'auto':
        backend = _demanded(model, weights, params)
        _log.info('%s computes %s, as the parameter backend demands%s', backend.description, model.name, _terms(model))
        return backend
    reasons: List[str] = []
    faults: List[str] = []
    for name, runtime in _RUNTIMES.items():
        if weights.suffix not in runtime.reads:
            reasons.append(f'{name} does not read {weights.name}')
            continue
        try:
            backend = _load(name, model, weights, params, '; '.join(faults))
        except ImportError as error:
            reasons.append(f'{name} is not importable: {error} ({runtime.install})')
            continue
        except ParameterError as error:
            reasons.append(f'{name} is not able to: {error}')
            continue
        except ModelError as error:
            faults.append(f'{name} does not work: {error}')
            continue
        why = '; '.join(reasons) if reasons else 'the fastest that is available'
        _log.info('%s computes %s (backend auto: %s)%s', backend.description, model.name, why, _terms(model))
        return backend
    raise ModelError(f'no backend can compute {model.name} on {params.device}: ' + '; '.join(reasons + faults))


def _terms(model: Model) -> str:
    """Return what the log says of a network beside its runtime."""
    own = '' if model.description is None else ', a file of yours: whether it finds people was not checked'
    return f'; licence of the weights: {model.licence}{own}'


def _demanded(model: Model, weights: Path, params: BackendParams) -> Backend:
    """Load the backend that the parameter names; raises as `create_backend` does."""
    name, runtime = params.backend, _RUNTIMES[params.backend]
    others = ', '.join(other for other in _RUNTIMES if weights.suffix in _RUNTIMES[other].reads)
    if weights.suffix not in runtime.reads:
        raise ParameterError(f"parameter 'backend' = {name!r} can not compute {model.name}: it reads "
                             f"{', '.join(runtime.reads)}, not {weights.name}; set backend to auto or one of {others}")
    try:
        return _load(name, model, weights, params)
    except ImportError as error:
        raise ParameterError(f"parameter 'backend' = {name!r} is not available: {error}; install it "
                             f'({runtime.install}) or set backend to auto or one of {others}') from error


def _load(name: str, model: Model, weights: Path, params: BackendParams, fallback: str = '') -> Backend:
    """Load and check one backend, in f32 if another precision gives wrong results; ImportError: not installed."""
    if name == 'openvino' and params.device != 'cpu':
        raise ParameterError(f"parameter 'device' = {params.device!r} is not available in openvino: it computes on cpu")
    backend = _backend_class(name)(model, weights, params, fallback)
    try:
        check_backend(backend, model)
    except ModelError as error:
        if params.precision == 'f32':
            raise
        faults = '; '.join(filter(None, (fallback, str(error))))
        return _load(name, model, weights, replace(params, precision='f32'), faults)
    if fallback:
        _log.warning('%s computes %s, slower than asked for: %s', backend.description, model.name, fallback)
    return backend


class _Runtime(NamedTuple):
    """A runtime before it is imported: suffixes of the first files that it reads, and how to install it."""

    reads: Tuple[str, ...]
    install: str


# In the order in which `auto` tries them: the fastest first, as measured on the default network. OpenCV 4.8 and later
# read TFLite, but not the operations of MoveNet.
_RUNTIMES = {
    'openvino': _Runtime(('.pb', '.onnx', '.tflite', '.xml'), './run setup, or pip install openvino'),
    'onnxruntime': _Runtime(('.onnx',), 'pip install onnxruntime, or onnxruntime-gpu'),
    'opencv_dnn': _Runtime(('.pb', '.onnx', '.prototxt', '.caffemodel'), 'apt install python3-opencv')}


def _backend_class(name: str) -> Callable[[Model, Path, BackendParams, str], Backend]:
    """Return the class of a runtime; raise ImportError if it is not installed."""
    if name == 'openvino':
        from openpose_ros_pkg.networks.backends.openvino import OpenvinoBackend
        return OpenvinoBackend
    if name == 'onnxruntime':
        from openpose_ros_pkg.networks.backends.onnxruntime import OnnxruntimeBackend
        return OnnxruntimeBackend
    from openpose_ros_pkg.networks.backends.opencv_dnn import OpencvBackend
    return OpencvBackend

"""Runtimes that compute a network, behind one protocol."""
import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Dict, Protocol

import numpy as np

from openpose_ros_pkg.backends.self_check import check_backend
from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.models import Model
from openpose_ros_pkg.params import Parameters, parameter

_log = logging.getLogger(__name__)


class Backend(Protocol):
    """A network, loaded by one runtime.

    Attributes:
        name: value of the `backend` parameter that demands it.
        description: runtime, version and precision, for people.
    """

    name: str
    description: str

    def infer(self, images: np.ndarray) -> np.ndarray:
        """Compute the network; not thread-safe.

        Args:
            images: (N, H, W, 3) uint8 BGR, H and W multiples of the model's stride.

        Returns:
            (N, C, H / stride, W / stride) float32, the caller's own.
        """


@dataclass(frozen=True)
class BackendParams(Parameters):
    """What computes the network, and how."""

    backend: str = parameter(
        'auto', 'Runtime of the network: openvino (fastest), opencv_dnn (needs nothing but OpenCV), or auto: openvino '
                'where it works, else opencv_dnn.', choices=('auto', 'openvino', 'opencv_dnn'))
    threads: int = parameter(
        0, 'Threads that compute the network; 0: as many as the machine has cores. With opencv_dnn this holds for all '
           'of OpenCV in the process.', minimum=0, maximum=256)
    precision: str = parameter(
        'f32', 'f32: reproducible. auto: OpenVINO may use bf16 where the processor has it, about twice as fast, with '
               'results that differ in the second digit.', choices=('f32', 'auto'))
    num_gpu_start: int = parameter(
        0, "First GPU to use. Without effect, as the network runs on the processor: kept so that the original's launch "
           'files load.', minimum=0)


def create_backend(model: Model, weights: Path, params: BackendParams) -> Backend:
    """Load a network, check that it computes what it should, and log which runtime was taken and why.

    Raises:
        ParameterError: the runtime that `params.backend` demands is not installed.
        ModelError: the weights can not be loaded, or the network computes wrong results.
    """
    if params.backend != 'auto':
        try:
            backend = _load(params.backend, model, weights, params)
        except ImportError as error:
            raise ParameterError(
                f"parameter 'backend' = {params.backend!r} is not available: {error}; install it "
                f"(`{_INSTALL[params.backend]}`) or set backend to auto or another of "
                f"{', '.join(_LOADERS)}") from error
        _log.info('%s computes %s, as the parameter backend demands', backend.description, model.name)
        return backend
    failures = []
    for name in _LOADERS:
        try:
            backend = _load(name, model, weights, params)
        except ImportError as error:
            failures.append(f'{name} is not importable: {error}')
            continue
        except ModelError as error:
            failures.append(f'{name} does not work: {error}')
            _log.warning('backend %s is skipped: %s', name, error)
            continue
        why = '; '.join(failures) if failures else 'the fastest that is available'
        _log.info('%s computes %s (backend auto: %s)', backend.description, model.name, why)
        return backend
    raise ModelError(f'no backend can compute {model.name}: ' + '; '.join(failures))


def _load(name: str, model: Model, weights: Path, params: BackendParams) -> Backend:
    """Load and check one backend.

    Raises:
        ImportError: its runtime is not installed.
        ModelError: it can not load the weights, or computes wrong results.
    """
    backend = _LOADERS[name](model, weights, params)
    check_backend(backend, model, exact=params.precision == 'f32')
    return backend


def _load_openvino(model: Model, weights: Path, params: BackendParams) -> Backend:
    from openpose_ros_pkg.backends.openvino import OpenvinoBackend
    return OpenvinoBackend(model, weights, params.threads, params.precision)


def _load_opencv(model: Model, weights: Path, params: BackendParams) -> Backend:
    from openpose_ros_pkg.backends.opencv_dnn import OpencvBackend
    return OpencvBackend(model, weights, params.threads)


# In the order in which `auto` tries them.
_LOADERS: Dict[str, Callable[[Model, Path, BackendParams], Backend]] = {
    'openvino': _load_openvino, 'opencv_dnn': _load_opencv}
_INSTALL = {'openvino': './run setup, or pip install openvino', 'opencv_dnn': 'apt install python3-opencv'}

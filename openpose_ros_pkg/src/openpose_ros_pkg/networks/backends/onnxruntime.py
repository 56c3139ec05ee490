"""onnxruntime: ONNX networks on the processor, or on a GPU where the installed package has CUDA or TensorRT."""
from pathlib import Path
from typing import Any, Dict, List, Tuple

import numpy as np
import onnxruntime as ort

from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.networks.backends import Backend, BackendParams
from openpose_ros_pkg.networks.backends.arrays import network_input, own_output
from openpose_ros_pkg.networks.model_types import Model

_PROVIDERS = {'cpu': 'CPUExecutionProvider', 'cuda': 'CUDAExecutionProvider', 'tensorrt': 'TensorrtExecutionProvider'}


class OnnxruntimeBackend(Backend):
    """A network by onnxruntime; see `backends.Backend`.

    Raises:
        ParameterError: the installed package can not compute on the device.
        ModelError: onnxruntime can not read the weights, or the graph lacks outputs of the model.
    """

    name = 'onnxruntime'

    def __init__(self, model: Model, weights: Path, params: BackendParams, fallback: str = '') -> None:
        self._model, self.fallback = model, fallback
        device, precision = params.device, params.precision
        wanted = _PROVIDERS[device]
        if wanted not in ort.get_available_providers():
            raise _no_device(device, f'it has {", ".join(ort.get_available_providers())}')
        options = ort.SessionOptions()
        options.intra_op_num_threads = params.threads
        options.log_severity_level = 3  # errors; its warnings are about single nodes of the graph
        # Idle threads sleep: other nodes need the processor as well.
        options.add_session_config_entry('session.intra_op.allow_spinning', '0')
        try:
            self._session = ort.InferenceSession(str(weights), options, providers=_providers(params))
        except Exception as error:  # its errors have no common class of their own
            raise ModelError(f'onnxruntime can not load {weights} as {model.name}: {error}') from error
        # It falls back to the processor without an error.
        if wanted not in self._session.get_providers():
            raise _no_device(device, f'the network would run on {self._session.get_providers()[0]}; are the libraries '
                                     'of the GPU installed in the versions that it needs?')
        self._input = self._session.get_inputs()[0].name
        self._outputs = _output_names(self._session, weights, model)
        self.description = f'onnxruntime {ort.__version__} (device {device}, precision {precision})'

    def infer(self, images: np.ndarray) -> Tuple[np.ndarray, ...]:
        """Compute the network; see `Backend.infer`."""
        outputs = self._session.run(self._outputs, {self._input: network_input(images, self._model.input)})
        return tuple(own_output(output, self._model, self._model.output_layout) for output in outputs)


def _no_device(device: str, reason: str) -> ParameterError:
    return ParameterError(f"parameter 'device' = {device!r} is not available in the installed onnxruntime: {reason}; "
                          'install onnxruntime-gpu in place of onnxruntime, or set device to cpu')


def _providers(params: BackendParams) -> List[Any]:
    """Return the execution providers of a device with their options, in the order of preference."""
    # TF32 keeps 11 bits of each number.
    cuda: Dict[str, Any] = {'device_id': params.num_gpu_start, 'use_tf32': int(params.precision == 'auto')}
    tensorrt: Dict[str, Any] = {'device_id': params.num_gpu_start, 'trt_fp16_enable': params.precision == 'auto'}
    chains: Dict[str, List[Any]] = {
        'cpu': [_PROVIDERS['cpu']],
        'cuda': [(_PROVIDERS['cuda'], cuda), _PROVIDERS['cpu']],
        'tensorrt': [(_PROVIDERS['tensorrt'], tensorrt), (_PROVIDERS['cuda'], cuda), _PROVIDERS['cpu']]}
    return chains[params.device]


def _output_names(session: ort.InferenceSession, weights: Path, model: Model) -> List[str]:
    existing = [output.name for output in session.get_outputs()]
    if not model.outputs:
        return existing
    names = [name if name in existing else f'{name}:0' for name in model.outputs]
    missing = [name for name, full in zip(model.outputs, names) if full not in existing]
    if missing:
        raise ModelError(f'onnxruntime can not load {weights} as {model.name}: it has no output '
                         f"{', '.join(missing)}; its outputs are {', '.join(existing)}")
    return names

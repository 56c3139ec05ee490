"""onnxruntime: ONNX networks on the processor, or on a GPU where the installed package has CUDA or TensorRT."""
from pathlib import Path
from typing import Any, Dict, List, Tuple

import numpy as np
import onnxruntime as ort

from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.networks.backends import Backend, BackendParams
from openpose_ros_pkg.networks.backends.arrays import network_input, output_names, own_output
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
            existing = [output.name for output in self._session.get_outputs()]
            self._outputs = output_names(model.outputs or existing, existing, existing)
        except Exception as error:  # its errors have no common class of their own
            raise ModelError(f'onnxruntime can not load {weights} as {model.name}: {error}') from error
        # It falls back to the processor without an error.
        if wanted not in self._session.get_providers():
            raise _no_device(device, f'the network would run on {self._session.get_providers()[0]}; are the libraries '
                                     'of the GPU installed in the versions that it needs?')
        self._input = self._session.get_inputs()[0].name
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
    fast, gpu, names = params.precision == 'auto', params.num_gpu_start, list(_PROVIDERS)
    options: Dict[str, Any] = {'cpu': {}, 'cuda': {'device_id': gpu, 'use_tf32': int(fast)},
                               'tensorrt': {'device_id': gpu, 'trt_fp16_enable': fast}}
    return [(_PROVIDERS[name], options[name]) for name in names[names.index(params.device)::-1]]

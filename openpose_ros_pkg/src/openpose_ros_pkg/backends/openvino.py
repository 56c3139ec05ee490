"""OpenVINO: the fastest runtime on x86, and on ARM where its wheel exists. It reads TensorFlow's frozen graphs."""
from collections import OrderedDict
from pathlib import Path
from typing import Any, Tuple

import numpy as np
import openvino as ov

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.models import Model

# A network is compiled per input size; this many stay in memory.
_KEPT_SIZES = 4


class OpenvinoBackend:
    """A network on the CPU by OpenVINO; see `backends.Backend`.

    Raises:
        ModelError: OpenVINO can not read the weights.
    """

    name = 'openvino'

    def __init__(self, model: Model, weights: Path, threads: int, precision: str) -> None:
        """Read the weights.

        Args:
            threads: 0 for as many as there are cores.
            precision: 'f32', or 'auto' for what the processor is fastest at.
        """
        self.description = f'OpenVINO {ov.__version__.split("-")[0]} (precision {precision})'
        self._core = ov.Core()
        self._config = {'PERFORMANCE_HINT': 'LATENCY'}
        if precision == 'f32':
            self._config['INFERENCE_PRECISION_HINT'] = 'f32'
        if threads > 0:
            self._config['INFERENCE_NUM_THREADS'] = threads
        self._requests: OrderedDict[Tuple[int, ...], Any] = OrderedDict()
        try:
            self._graph = self._prepared(self._core.read_model(str(weights)), model)
        except (RuntimeError, ValueError) as error:
            raise ModelError(f'OpenVINO can not load {weights} as {model.name}: {error}') from error

    @staticmethod
    def _prepared(graph: ov.Model, model: Model) -> ov.Model:
        """Let the graph take uint8 (N, H, W, 3) and give float32 (N, C, h, w)."""
        steps = ov.preprocess.PrePostProcessor(graph)
        steps.input().tensor().set_element_type(ov.Type.u8).set_layout(ov.Layout('NHWC'))
        steps.input().preprocess().convert_element_type(ov.Type.f32)
        steps.input().model().set_layout(ov.Layout('NHWC'))
        steps.output(f'{model.output_name}:0').model().set_layout(ov.Layout('NHWC'))
        steps.output(f'{model.output_name}:0').tensor().set_layout(ov.Layout('NCHW'))
        return steps.build()

    def infer(self, images: np.ndarray) -> np.ndarray:
        """Compute the network; see `Backend.infer`."""
        request = self._request(images.shape)
        request.infer({0: np.ascontiguousarray(images)})
        return request.get_output_tensor(0).data.copy()

    def _request(self, shape: Tuple[int, ...]) -> Any:
        """Return the request for an input size, compiling the network for sizes that are new or long unused."""
        if shape not in self._requests:
            graph = self._graph.clone()
            graph.reshape(list(shape))
            self._requests[shape] = self._core.compile_model(graph, 'CPU', self._config).create_infer_request()
            if len(self._requests) > _KEPT_SIZES:
                self._requests.popitem(last=False)
        self._requests.move_to_end(shape)
        return self._requests[shape]

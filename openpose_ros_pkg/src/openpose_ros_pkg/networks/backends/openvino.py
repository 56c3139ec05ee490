"""OpenVINO: the fastest runtime on x86, and on ARM where its wheel exists.

It reads TensorFlow's frozen graphs, ONNX, TFLite and its own IR.
"""
import functools
import io
import logging
import os
from collections import OrderedDict
from pathlib import Path
from typing import Any, Dict, FrozenSet, List, Sequence, Tuple

import numpy as np
import openvino as ov

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.backends import BackendParams
from openpose_ros_pkg.networks.backends.arrays import output_names
from openpose_ros_pkg.networks.backends.compiled_cache import open_cache
from openpose_ros_pkg.networks.model_types import Decoder, InputRecipe, Model, Shape

_log = logging.getLogger(__name__)

# A network is compiled per input size; the last used ones stay in memory up to this sum, and two at least: one image
# and several of the same size, which take turns as people come and go.
_KEPT_BYTES, _LEAST_KEPT = 512 << 20, 2
# Memory of a compiled network: bytes per pixel of each image that is computed at a time, and per byte of the weights'
# files, which hold 2 bytes of each number, ONNX 4. Measured in f32: mobilenet_thin 656 x 368 takes 58 MB, 984 x 552
# 119 MB, movenet_multipose 512 x 288 69 MB, 512 x 512 95 MB; RTMPose-l 192 x 256 (111 MB of ONNX) 176 MB.
_BYTES_PER_PIXEL, _WEIGHTS_SHARE, _ONNX_SHARE = 220, 4, 1.5
# Images that `infer_many` computes at a time; with more cores each gets several (development/notes/decisions.md).
_MOST_STREAMS = 4
# Only the first sizes of a process go to the disk: a folder of images may have a new one each.
_CACHED_SIZES = 8


@functools.lru_cache(maxsize=None)
def _core() -> ov.Core:
    """Return the one core of this process.

    A core installs a signal stack with its first network and removes it when it is deleted. Several cores deleted in
    another order leave a stack of freed memory: the next signal ends the program with a segmentation fault.
    """
    return ov.Core()


class OpenvinoBackend:
    """A network on the CPU by OpenVINO; see `backends.Backend`."""

    name = 'openvino'

    def __init__(self, model: Model, weights: Path, params: BackendParams, fallback: str = '') -> None:
        """Prepare; the first `infer` reads the weights unless the compiled network is cached."""
        self._model, self._weights, self.fallback = model, weights, fallback
        self._core = _core()
        self._config: Dict[str, Any] = {'PERFORMANCE_HINT': 'LATENCY'}  # all threads for one image
        if params.precision == 'f32':
            self._config['INFERENCE_PRECISION_HINT'] = 'f32'
        if params.threads > 0:
            self._config['INFERENCE_NUM_THREADS'] = params.threads
            # Else the threads of all processes are bound to the same first cores.
            self._config['ENABLE_CPU_PINNING'] = False
        threads = params.threads or len(os.sched_getaffinity(0))
        self._streams = min(threads, _MOST_STREAMS)
        self._side_by_side = {**self._config, 'NUM_STREAMS': self._streams, 'INFERENCE_NUM_THREADS': threads,
                              'ENABLE_CPU_PINNING': False}
        self._cache = open_cache(params.compiled_cache)
        # requests by input size and number of streams; the longest unused first
        self._requests: OrderedDict[Tuple[Tuple[int, ...], int], List[Any]] = OrderedDict()
        self._sizes = 0
        self.description = f'OpenVINO {ov.__version__.split("-")[0]} (precision {params.precision})'

    def infer(self, images: np.ndarray) -> Tuple[np.ndarray, ...]:
        """Compute the network; see `Backend.infer`.

        Raises:
            ModelError: OpenVINO can not read the weights, or the graph lacks outputs of the model.
        """
        request, = self._requests_for(images.shape, 1)
        request.infer({0: np.ascontiguousarray(images)}, share_inputs=True)
        return _outputs(request)

    def infer_many(self, images: Sequence[np.ndarray]) -> List[Tuple[np.ndarray, ...]]:
        """Compute the network, as many images at a time as there are streams; see `Backend.infer_many`.

        What is left over for less than half of the streams is quicker one by one, on all threads.
        """
        alone = len(images) % self._streams if self._streams > 1 else len(images)
        together = len(images) - (alone if 2 * alone <= self._streams or self._streams < 2 else 0)
        results = self._infer_together(images[:together]) if together else []
        return [*results, *(self.infer(image) for image in images[together:])]

    def _infer_together(self, images: Sequence[np.ndarray]) -> List[Tuple[np.ndarray, ...]]:
        requests = self._requests_for(images[0].shape, self._streams)
        arrays = [np.ascontiguousarray(image) for image in images]  # requests read their memory
        results = []
        try:
            for i, array in enumerate(arrays):
                request = requests[i % len(requests)]
                if i >= len(requests):
                    request.wait()
                    results.append(_outputs(request))
                request.start_async({0: array}, share_inputs=True)
        finally:
            for request in requests:
                request.wait()
        return results + [_outputs(requests[i % len(requests)]) for i in range(len(results), len(arrays))]

    def _requests_for(self, shape: Tuple[int, ...], streams: int) -> List[Any]:
        """Return the requests for an input size, compiling the network for new and dropped sizes."""
        key = shape, streams
        if key not in self._requests:
            network = self._compile(shape, self._side_by_side if streams > 1 else self._config)
            self._requests[key] = [network.create_infer_request() for _ in range(streams)]
            while len(self._requests) > _LEAST_KEPT and sum(map(self._bytes_of, self._requests)) > _KEPT_BYTES:
                self._requests.popitem(last=False)
        self._requests.move_to_end(key)
        return self._requests[key]

    def _bytes_of(self, key: Tuple[Tuple[int, ...], int]) -> float:
        """Return the estimated memory of the requests of an input size [bytes]."""
        (_, height, width, _), streams = key
        weights = sum(path.stat().st_size for path in self._files)
        share = _ONNX_SHARE if self._weights.suffix == '.onnx' else _WEIGHTS_SHARE
        return share * weights + _BYTES_PER_PIXEL * height * width * streams

    @property
    def _files(self) -> List[Path]:
        paths = [self._weights.parent / file.name for file in self._model.files]
        return [path for path in paths if path.is_file()]

    def _compile(self, shape: Tuple[int, ...], config: Dict[str, Any]) -> Any:
        self._sizes += 1
        cache = self._cache if self._sizes <= _CACHED_SIZES else None
        key = self._key(shape, config)
        data = cache.load(key) if cache else None
        if data is not None:
            try:
                return self._core.import_model(io.BytesIO(data), 'CPU', config)
            except RuntimeError as error:
                _log.warning('OpenVINO does not take a compiled network from the cache, it compiles it again: %s',
                             error)
        graph = self._prepared.clone()
        graph.reshape(list(shape))
        network = self._core.compile_model(graph, 'CPU', config)
        if cache:
            content = io.BytesIO()
            network.export_model(content)
            cache.store(key, content.getvalue())
        return network

    def _key(self, shape: Tuple[int, ...], config: Dict[str, Any]) -> str:
        """Return all that a compiled network depends on: files, model, options, runtime and processor."""
        files = [(str(path.resolve()), path.stat().st_size, path.stat().st_mtime_ns) for path in self._files]
        model = (self._model.input, self._model.outputs, self._model.decoder, self._model.output_layout)
        processor = [self._core.get_property('CPU', name) for name in ('FULL_DEVICE_NAME', 'OPTIMIZATION_CAPABILITIES')]
        return repr((files, model, shape, sorted(config.items()), ov.__version__, processor))

    @functools.cached_property
    def _prepared(self) -> ov.Model:
        """The graph, which takes uint8 (N, H, W, 3) BGR and gives what `Backend.infer` says."""
        try:
            graph = self._core.read_model(str(self._weights))
            return _with_recipe(_with_outputs(graph, self._model), self._model)
        except (RuntimeError, ValueError) as error:
            raise ModelError(f'OpenVINO can not load {self._weights} as {self._model.name}: {error}') from error


def _outputs(request: Any) -> Tuple[np.ndarray, ...]:
    """Return copies of a request's outputs: its memory is overwritten by the next image."""
    return tuple(tensor.data.copy() for tensor in request.output_tensors)


def graph_shapes(path: Path) -> Tuple[List[Shape], Dict[str, Shape], FrozenSet[str]]:
    """Return the shapes of the inputs of a network's file, and those of its outputs by name, or else number; and the
    kinds of the operations on its first input.

    Raises:
        ModelError: OpenVINO can not read it.
    """
    try:
        graph = _core().read_model(str(path))
    except RuntimeError as error:
        raise ModelError(f'OpenVINO can not read {path}: {error}') from error
    inputs = _shapes(graph.inputs)
    if any(None in shape[1:] for shape in _shapes(graph.outputs)) and not any(None in shape[1:] for shape in inputs):
        # With one image at a time, more of the outputs is known.
        graph.reshape({port: [1, *shape[1:]] for port, shape in zip(graph.inputs, inputs)})
    names = [next(iter(sorted(port.get_names())), str(i)) for i, port in enumerate(graph.outputs)]
    begins = frozenset(target.get_node().get_type_name() for port in graph.inputs[:1]
                       for target in port.get_target_inputs())
    return inputs, dict(zip(names, _shapes(graph.outputs))), begins


def _shapes(ports: Sequence[Any]) -> List[Shape]:
    return [tuple(None if size.is_dynamic else size.get_length() for size in port.get_partial_shape())
            for port in ports]


def _with_outputs(graph: ov.Model, model: Model) -> ov.Model:
    """Return the graph with the outputs of the model, in its order; parts that only others need fall away."""
    if not model.outputs:
        return graph
    nodes, tensors = {}, {}
    for node in graph.get_ordered_ops():
        if node.get_type_name() in ('Result', 'Constant'):
            continue
        nodes[node.get_friendly_name()] = node.output(0)
        tensors.update({name: output for output in node.outputs() for name in output.get_names()})
    found = {**nodes, **tensors}  # a node may be called as one of its tensors, not always as the first
    names = output_names(model.outputs, found, (output.get_any_name() for output in graph.outputs))
    return ov.Model([found[name] for name in names], graph.get_parameters())


def _with_recipe(graph: ov.Model, model: Model) -> ov.Model:
    recipe: InputRecipe = model.input
    steps = ov.preprocess.PrePostProcessor(graph)
    given, wanted = steps.input(), ov.preprocess.ColorFormat
    given.tensor().set_element_type(ov.Type.u8).set_layout(ov.Layout('NHWC')).set_color_format(wanted.BGR)
    if recipe.channels == 'RGB':
        given.preprocess().convert_color(wanted.RGB)
    if recipe.dtype == 'float32':
        given.preprocess().convert_element_type(ov.Type.f32)
        if recipe.mean != 0:
            given.preprocess().mean(list(recipe.mean) if isinstance(recipe.mean, tuple) else recipe.mean)
        if recipe.scale != 1:  # OpenVINO divides
            given.preprocess().scale([1 / scale for scale in recipe.scale] if isinstance(recipe.scale, tuple) else
                                     1 / recipe.scale)
    given.model().set_layout(ov.Layout(recipe.layout))
    for i in range(len(graph.outputs)):
        steps.output(i).tensor().set_element_type(ov.Type.f32)
        if model.decoder == Decoder.PAF:
            steps.output(i).model().set_layout(ov.Layout(model.output_layout))
            steps.output(i).tensor().set_layout(ov.Layout('NCHW'))
    return steps.build()

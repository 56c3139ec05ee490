"""OpenCV's dnn module: needs nothing but OpenCV."""
from pathlib import Path

import cv2
import numpy as np

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.models import Model


class OpencvBackend:
    """A network on the CPU by OpenCV; see `backends.Backend`.

    Raises:
        ModelError: OpenCV can not read the weights.
    """

    name = 'opencv_dnn'

    def __init__(self, model: Model, weights: Path, threads: int) -> None:
        """Read the weights.

        Args:
            threads: for all of OpenCV in this process; 0 leaves them as they are.
        """
        self.description = f'OpenCV dnn {cv2.__version__} (precision f32)'
        self._output = model.output_name
        if threads > 0:
            cv2.setNumThreads(threads)
        # The new engine of OpenCV 5.0.0 computes this family of networks wrongly from ONNX files; the classic one
        # is right for all.
        engine = {'engine': cv2.dnn.ENGINE_CLASSIC} if int(cv2.__version__.split('.')[0]) >= 5 else {}
        try:
            self._net = cv2.dnn.readNetFromTensorflow(str(weights), **engine)
        except cv2.error as error:
            raise ModelError(f'OpenCV can not load {weights} as {model.name}: {error}') from error
        self._net.setPreferableBackend(cv2.dnn.DNN_BACKEND_OPENCV)
        self._net.setPreferableTarget(cv2.dnn.DNN_TARGET_CPU)

    def infer(self, images: np.ndarray) -> np.ndarray:
        """Compute the network; see `Backend.infer`."""
        self._net.setInput(cv2.dnn.blobFromImages(list(images)))
        # A copy: OpenCV reuses the memory of its result.
        return self._net.forward(self._output).copy()

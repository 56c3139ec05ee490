"""What runtimes have in common: names of outputs, and conversion of arrays where that can not be in the graph."""
import re
from typing import Collection, Iterable, List, Sequence

import cv2
import numpy as np

from openpose_ros_pkg.networks.model_types import Decoder, InputRecipe, Model


def network_input(images: np.ndarray, recipe: InputRecipe) -> np.ndarray:
    """Convert (1, H, W, 3) uint8 BGR to (1, 3, H, W) or (1, H, W, 3), float32 or uint8, as the recipe says."""
    mean, scale = np.broadcast_to(recipe.mean, 3), np.broadcast_to(recipe.scale, 3)
    if recipe.dtype == 'float32' and recipe.layout == 'NCHW':
        # One pass over the pixels: colours, mean, one scale and layout at once.
        blob = cv2.dnn.blobFromImages(list(images), scale[0], mean=mean.tolist(), swapRB=recipe.channels == 'RGB')
        if scale.min() != scale.max():
            blob *= (scale / scale[0]).astype(np.float32)[:, None, None]
        return blob
    array = images[..., ::-1] if recipe.channels == 'RGB' else images
    if recipe.layout == 'NCHW':
        array = array.transpose(0, 3, 1, 2)
    if recipe.dtype == 'uint8':
        return np.ascontiguousarray(array)
    values = array.astype(np.float32, order='C')
    axis = (slice(None), None, None) if recipe.layout == 'NCHW' else slice(None)
    if mean.any():
        values -= mean.astype(np.float32)[axis]
    if (scale != 1).any():
        values *= scale.astype(np.float32)[axis]
    return values


def own_output(output: np.ndarray, model: Model, layout: str) -> np.ndarray:
    """Return a copy of an output as `Backend.infer` gives it: contiguous float32, fields as NCHW.

    Args:
        layout: of a field as the runtime gives it, 'NHWC' or 'NCHW'.
    """
    if model.decoder == Decoder.PAF and layout == 'NHWC' and output.ndim == 4:
        output = output.transpose(0, 3, 1, 2)
    return np.array(output, np.float32, order='C')


def output_names(wanted: Sequence[str], there: Collection[str], outputs: Iterable[str]) -> List[str]:
    """Return the names of outputs as they are there, with or without the `:0` of a tensor of TensorFlow.

    Args:
        outputs: of the graph, for the error.

    Raises:
        ValueError: an output is not there.
    """
    found = [[each for each in (name, f'{name}:0', re.sub(':0$', '', name)) if each in there] for name in wanted]
    missing = [name for name, names in zip(wanted, found) if not names]
    if missing:
        raise ValueError(f"it has no output {', '.join(missing)}; its outputs are {', '.join(outputs)}")
    return [names[0] for names in found]

"""From images to a network's input, and from its outputs to ours, for runtimes that can not do it in the graph."""
from typing import Callable, List, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.networks.models import InputRecipe, Model


def network_input(images: np.ndarray, recipe: InputRecipe) -> np.ndarray:
    """Turn images into what a network takes.

    Args:
        images: (N, H, W, 3) uint8 BGR.

    Returns:
        (N, 3, H, W) or (N, H, W, 3), float32 or uint8, as the recipe says.
    """
    if recipe.dtype == 'float32' and recipe.layout == 'NCHW':
        # One pass over the pixels: colours, mean, scale and layout at once.
        return cv2.dnn.blobFromImages(list(images), recipe.scale, mean=(recipe.mean,) * 3,
                                      swapRB=recipe.channels == 'RGB')
    array = images[..., ::-1] if recipe.channels == 'RGB' else images
    if recipe.layout == 'NCHW':
        array = array.transpose(0, 3, 1, 2)
    if recipe.dtype == 'uint8':
        return np.ascontiguousarray(array)
    values = array.astype(np.float32, order='C')
    if recipe.mean != 0:
        values -= np.float32(recipe.mean)
    if recipe.scale != 1:
        values *= np.float32(recipe.scale)
    return values


def own_output(output: np.ndarray, model: Model, layout: str) -> np.ndarray:
    """Return a copy of an output as `Backend.infer` gives it: contiguous float32, fields as NCHW.

    Args:
        layout: of a field as the runtime gives it, 'NHWC' or 'NCHW'.
    """
    if model.decoder == 'paf' and layout == 'NHWC' and output.ndim == 4:
        output = output.transpose(0, 3, 1, 2)
    return np.array(output, np.float32, order='C')


def takes_batches(model: Model) -> bool:
    """Whether a network computes several images at once: those that find people themselves are made for one."""
    return model.decoder == 'paf'


def one_by_one(infer: Callable[[np.ndarray], Tuple[np.ndarray, ...]], images: np.ndarray) -> Tuple[np.ndarray, ...]:
    """Compute images one after the other and put their outputs together.

    Their number of candidates may differ; what lacks is filled with zeros, which is nobody: the scores are zero.
    """
    results = [infer(images[i:i + 1]) for i in range(len(images))]
    if len(results) == 1:
        return results[0]
    return tuple(_joined(list(outputs)) for outputs in zip(*results))


def _joined(outputs: List[np.ndarray]) -> np.ndarray:
    most = max(output.shape[1] for output in outputs)
    joined = np.zeros((len(outputs), most, *outputs[0].shape[2:]), np.float32)
    for row, output in zip(joined, outputs):
        row[:output.shape[1]] = output[0]
    return joined

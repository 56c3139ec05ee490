"""Conversion of images and outputs for runtimes that can not do it in the graph."""
import cv2
import numpy as np

from openpose_ros_pkg.networks.model_types import Decoder, InputRecipe, Model


def network_input(images: np.ndarray, recipe: InputRecipe) -> np.ndarray:
    """Convert (1, H, W, 3) uint8 BGR to (1, 3, H, W) or (1, H, W, 3), float32 or uint8, as the recipe says."""
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
    if model.decoder == Decoder.PAF and layout == 'NHWC' and output.ndim == 4:
        output = output.transpose(0, 3, 1, 2)
    return np.array(output, np.float32, order='C')

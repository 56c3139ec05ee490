"""Average the fields that one network gives for several views of one image: other sizes, the mirror image."""
from typing import Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.networks.model_types import Model
from openpose_ros_pkg.networks.preprocess import ImageToNet
from openpose_ros_pkg.skeletons import mirrored_joint


def average_fields(fields: Sequence[np.ndarray], plans: Sequence[ImageToNet], mirrored: Sequence[bool],
                   model: Model) -> np.ndarray:
    """Return the mean of the fields on the grid of the first, (C, h, w) float32.

    Args:
        fields: (C, h, w) float32 each.
        plans: how the image became the network's input, for each.
        mirrored: whether the network saw the mirror image; the first view is not mirrored.
    """
    if len(fields) == 1:
        return fields[0]
    total = fields[0].copy()
    for field, plan, mirror in zip(fields[1:], plans[1:], mirrored[1:]):
        if mirror:
            channels, signs = _mirror_channels(model)
            field = field[channels] * signs[:, None, None]
        total += _resampled(field, plan, mirror, total.shape[1:], plans[0], model.stride)
    return total / len(fields)


def _mirror_channels(model: Model) -> Tuple[np.ndarray, np.ndarray]:
    """Return for each channel the one that holds its mirror image, and the sign of its values there.

    The x component of a field changes its sign, left and right change their names, the background stays.
    """
    skeleton = model.skeleton
    channels, signs = np.arange(model.channels), np.ones(model.channels, np.float32)
    channels[:len(skeleton.joints)] = skeleton.swap
    limbs = {(limb.start, limb.end): limb.paf for limb in skeleton.limbs}
    for limb in skeleton.limbs:
        mirror = limbs[mirrored_joint(limb.start), mirrored_joint(limb.end)]
        channels[model.heatmaps + np.array(limb.paf)] = model.heatmaps + np.array(mirror)
        signs[model.heatmaps + limb.paf[0]] = -1
    return channels, signs


def _resampled(field: np.ndarray, plan: ImageToNet, mirror: bool, shape: Tuple[int, ...], target: ImageToNet,
               stride: int) -> np.ndarray:
    """Sample a field at the cells of another grid; both differ in padding, so a plain resize would shift it."""
    height, width = shape
    cells = np.stack([np.arange(max(width, height))] * 2, axis=1)
    image = target.to_image((cells + 0.5) * stride - 0.5)
    if mirror:
        image[:, 0] = target.image_size[0] - 1 - image[:, 0]
    source = ((plan.to_net(image) + 0.5) / stride - 0.5).astype(np.float32)
    x, y = np.meshgrid(source[:width, 0], source[:height, 1])
    return np.stack([cv2.remap(channel, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
                     for channel in field])

"""The network's input of an image, and the coordinate transform between the two."""
from dataclasses import dataclass, replace
from typing import Optional, Sequence, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.networks.model_types import InputRecipe

# Longest side of the network's input that is still computed; beyond it, memory grows to gigabytes.
MAX_NET_SIDE = 4096


@dataclass(frozen=True)
class ImageToNet:
    """Scaling to `scaled_size` and padding to `net_size`, at the right and bottom unless `centred`.

    Coordinates are those of pixel centres: x_net = offset + (x_image + 0.5) * scale - 0.5, with the scale that rounding
    to whole pixels leaves on each axis.
    """

    image_size: Tuple[int, int]  # (width, height) [px]
    scaled_size: Tuple[int, int]  # (width, height) of the image within the network's input [px]
    net_size: Tuple[int, int]  # (width, height) of the network's input [px], multiples of the network's stride
    offset: Tuple[int, int] = (0, 0)  # left and top of the image within the network's input [px]

    def centred(self) -> 'ImageToNet':
        """Return the same with the padding on both sides."""
        left, top = ((net - scaled) // 2 for net, scaled in zip(self.net_size, self.scaled_size))
        return replace(self, offset=(left, top))

    @property
    def scale(self) -> np.ndarray:
        """(2,) float64: network pixels per image pixel, along x and y."""
        return np.array(self.scaled_size, np.float64) / self.image_size

    def to_net(self, xy: np.ndarray) -> np.ndarray:
        """Convert (..., 2) image pixels to network pixels, float64."""
        return (np.asarray(xy, np.float64) + 0.5) * self.scale - 0.5 + self.offset

    def to_image(self, xy: np.ndarray) -> np.ndarray:
        """Convert (..., 2) network pixels to image pixels, float64."""
        return (np.asarray(xy, np.float64) - self.offset + 0.5) / self.scale - 0.5

    def apply(self, image: np.ndarray, padding: Optional[int] = None) -> np.ndarray:
        """Scale and pad an image.

        Args:
            image: (H, W, 3) uint8 of `image_size`; not modified.
            padding: value of the padded pixels, 0..255; None repeats the border.

        Returns:
            (H, W, 3) uint8 of `net_size`.
        """
        scaled = _resized(image, self.scaled_size)
        if self.scaled_size == self.net_size:
            return np.ascontiguousarray(scaled)
        left, top = self.offset
        border = top, self.net_size[1] - self.scaled_size[1] - top, left, self.net_size[0] - self.scaled_size[0] - left
        return _padded(scaled, border, padding)


def _resized(image: np.ndarray, size: Tuple[int, int]) -> np.ndarray:
    """Bring an image, (H, W, 3) uint8, to (width, height) [px].

    Averaging over areas avoids aliasing where an image is halved or more. It is fast by whole factors alone: where the
    sides are multiples of one, the rest is left to linear interpolation.
    """
    height, width = image.shape[:2]
    factor = min(width // size[0], height // size[1])
    if factor > 1 and width % factor == height % factor == 0:
        image = cv2.resize(image, (width // factor, height // factor), interpolation=cv2.INTER_AREA)
        factor = 1
    if image.shape[1::-1] == size:
        return image
    return cv2.resize(image, size, interpolation=cv2.INTER_AREA if factor > 1 else cv2.INTER_LINEAR)


def fit_image(image_size: Tuple[int, int], net_width: int, net_height: int, stride: int,
              zoom: float = 1.0, whole_box: bool = False) -> ImageToNet:
    """Fit an image into a box of the network's input, aspect kept, padded to the stride.

    640x480 in a box of 656x368 becomes 491x368, padded to 496x368.

    Args:
        image_size: (width, height) [px].
        net_width, net_height: the box [px]; -1 for one of them: from the aspect.
        stride: the input's sides are multiples of it [px].
        zoom: factor on the box, for several scales.
        whole_box: pad to the whole box, so that images of all shapes give inputs of one size.

    Raises:
        BadInputError: the image is empty, or the free side would exceed `MAX_NET_SIDE`.
    """
    width, height = image_size
    if width < 1 or height < 1:
        raise BadInputError(f'image of {width}x{height} pixels: expected at least 1x1')
    limits = [side / length for side, length in ((net_width, width), (net_height, height)) if side > 0]
    scale = zoom * min(limits)
    scaled = (max(1, round(width * scale)), max(1, round(height * scale)))
    if max(scaled) > MAX_NET_SIDE:
        raise BadInputError(f'image of {width}x{height} pixels would become a network input of {scaled[0]}x{scaled[1]}'
                            f', expected at most {MAX_NET_SIDE} on a side: set both net_input_width '
                            f'({net_width}) and net_input_height ({net_height})')
    net = (net_width, net_height) if whole_box else scaled
    return ImageToNet(image_size=(width, height), scaled_size=scaled,
                      net_size=(-(-net[0] // stride) * stride, -(-net[1] // stride) * stride))


def fit_recipe(image_size: Tuple[int, int], recipe: InputRecipe, box: Tuple[int, int], zoom: float = 1.0
               ) -> ImageToNet:
    """Fit an image into the input of a network, or into a box where that is free; see `fit_image`.

    One that is stretched to its size has no zoom.
    """
    if recipe.fixed_size is None:
        plan = fit_image(image_size, *box, recipe.multiple_of, zoom)
    elif recipe.stretched:
        plan = ImageToNet(image_size, recipe.fixed_size, recipe.fixed_size)
    else:
        plan = fit_image(image_size, *recipe.fixed_size, recipe.multiple_of, zoom, whole_box=True)
    return plan.centred() if recipe.centred else plan


def cut(bgr: np.ndarray, part: Tuple[int, int, int, int], padding: Optional[int]) -> np.ndarray:
    """Return a part of an image, (height, width, 3) uint8; it shares pixels with the image.

    Args:
        part: left, top, width and height [px].
        padding: value of the pixels beyond the image, 0..255; None repeats its border.
    """
    left, top, width, height = part
    bottom, right = top + height, left + width
    beyond = [max(pixels, 0) for pixels in (-top, bottom - bgr.shape[0], -left, right - bgr.shape[1])]
    inside = bgr[max(top, 0):bottom, max(left, 0):right]
    return _padded(inside, beyond, padding) if any(beyond) else inside


def _padded(image: np.ndarray, border: Sequence[int], padding: Optional[int]) -> np.ndarray:
    kind = cv2.BORDER_REPLICATE if padding is None else cv2.BORDER_CONSTANT
    return cv2.copyMakeBorder(image, *border, kind, value=(padding or 0,) * 3)

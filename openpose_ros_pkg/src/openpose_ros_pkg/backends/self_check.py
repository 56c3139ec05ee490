"""Does a runtime compute a network rightly? One small picture with a known output tells, at every start.

One version of OpenCV was seen to compute the default network wrongly on all channels without any error.

`python3 -m openpose_ros_pkg.backends.self_check WEIGHTS` makes the reference again.
"""
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Tuple

import cv2
import numpy as np

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.models import MOBILENET_THIN, Model

if TYPE_CHECKING:
    from openpose_ros_pkg.backends import Backend

# Runtimes with float32 differ by 5e-6 on the default network, whose values reach 1; the reference is rounded to
# float16 (2.5e-4). A wrong network was off by 1.2.
_EXACT_TOLERANCE = 2e-3
# bf16 keeps 8 bits of each number.
_REDUCED_TOLERANCE = 0.1


def reference_path(model: Model) -> Path:
    """Return the file with the known input and output of a model."""
    return Path(__file__).resolve().parent.parent / 'data' / f'{model.name}_self_check.npz'


def check_backend(backend: 'Backend', model: Model, exact: bool) -> None:
    """Compare a backend's output with the known one.

    Args:
        exact: whether it computes in float32 throughout.

    Raises:
        ModelError: it can not compute the network, or its result is wrong.
    """
    with np.load(str(reference_path(model))) as reference:
        image, expected = reference['image'], reference['fields'].astype(np.float32)
    tolerance = _EXACT_TOLERANCE if exact else _REDUCED_TOLERANCE
    help_text = 'set the parameter backend to another one, or install another version of this runtime'
    try:
        actual = backend.infer(image[np.newaxis])[0]
    except (RuntimeError, cv2.error) as error:
        raise ModelError(f'{backend.description} can not compute {model.name}: {error}; {help_text}') from error
    if actual.shape != expected.shape:
        raise ModelError(f'{backend.description} computes {model.name} wrongly: its output has the shape '
                         f'{actual.shape}, expected {expected.shape}; {help_text}')
    difference = float(np.abs(actual - expected).max())
    if not difference <= tolerance:  # not "greater": NaN is wrong as well
        raise ModelError(f'{backend.description} computes {model.name} wrongly: its output for a known picture is off '
                         f'by up to {difference:.3g}, expected at most {tolerance:g}; {help_text}')


def make_reference(backend: 'Backend', model: Model) -> None:
    """Write the file that `check_backend` reads, with a backend that is known to be right (OpenCV 4)."""
    image = _mannequin()
    path = reference_path(model)
    path.parent.mkdir(exist_ok=True)
    np.savez_compressed(str(path), image=image, fields=backend.infer(image[np.newaxis])[0].astype(np.float16))


def _mannequin() -> np.ndarray:
    """Draw a simple person, (112, 80, 3) uint8 BGR: enough to excite confidence maps and affinity fields."""
    image = np.full((112, 80, 3), (150, 165, 160), np.uint8)
    skin, shirt, trousers = (120, 150, 205), (60, 60, 180), (90, 50, 40)

    def limb(points: Tuple[Tuple[int, int], ...], colour: Tuple[int, int, int], thickness: int) -> None:
        cv2.polylines(image, [np.array(points, np.int32)], False, colour, thickness)

    limb(((34, 58), (32, 82), (31, 104)), trousers, 8)
    limb(((46, 58), (48, 82), (49, 104)), trousers, 8)
    limb(((40, 30), (40, 56)), shirt, 18)
    limb(((30, 28), (24, 44)), shirt, 6)
    limb(((50, 28), (56, 44)), shirt, 6)
    limb(((24, 44), (22, 60)), skin, 5)
    limb(((56, 44), (58, 60)), skin, 5)
    limb(((40, 20), (40, 26)), skin, 6)
    cv2.ellipse(image, (40, 13), (7, 9), 0, 0, 360, skin, -1)
    cv2.ellipse(image, (40, 8), (8, 6), 0, 180, 360, (30, 40, 50), -1)
    for x in (37, 43):
        cv2.circle(image, (x, 12), 1, (20, 20, 20), -1)
    cv2.line(image, (38, 18), (42, 18), (80, 80, 160), 1)
    return image


if __name__ == '__main__':
    from openpose_ros_pkg.backends.opencv_dnn import OpencvBackend
    make_reference(OpencvBackend(MOBILENET_THIN, Path(sys.argv[1]), threads=0), MOBILENET_THIN)

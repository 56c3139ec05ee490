"""Points that are no depth of the view, and cameras that no lens has."""
from typing import Any, Callable

import numpy as np

from faults.fault import Fault
from faults.injectors import Injector, altered, changed
from skeleton_extract_3d.points.depth import XYZRGB


def _cloud(change: Callable[[np.ndarray], Any]) -> Injector:
    """Return what sends a frame after a function changed x, y and z of its cloud, (N, 3) float32."""
    def alter(frame: Any) -> None:
        cloud = np.frombuffer(frame.points.data, XYZRGB).copy()
        xyz = np.stack([cloud[axis] for axis in 'xyz'], axis=-1)
        change(xyz)
        for i, axis in enumerate('xyz'):
            cloud[axis] = xyz[:, i]
        frame.points.data = cloud.tobytes()
    return altered(alter)


def _depth(value: int) -> Injector:
    """Return what sends a frame with the same depth everywhere [mm]."""
    def alter(frame: Any) -> None:
        frame.points.data = np.full(frame.points.width * frame.points.height, value, '<u2').tobytes()
    return altered(alter)


def _fill(value: float) -> Injector:
    return _cloud(lambda xyz: xyz.fill(value))


def _camera(index: int, value: float) -> Injector:
    """Return what sends a frame with another value in K."""
    def alter(frame: Any) -> None:
        frame.info.K = [value if i == index else old for i, old in enumerate(frame.info.K)]
    return altered(alter)


FAULTS = [
    Fault('cloud of NaN alone', _fill(np.nan), event='no depth', words=('0 % of the points are valid', 'NaN')),
    Fault('cloud in millimetres', _cloud(lambda xyz: np.multiply(xyz, 1000, out=xyz)), event='implausible depth',
          words=('the median depth is', 'is it in millimetres?')),
    Fault('depth image of zeros alone', _depth(0), node='depth/people', event='no depth',
          words=('is the depth camera covered',)),
    Fault('focal length of 1e-300', _camera(0, 1e-300), node='depth/people', words=('fx is 1e-300 px',)),
    Fault('lens that folds the image', changed('info', D=[-50.0, 0, 0, 0, 0], distortion_model='plumb_bob'),
          node='depth/people', words=('folds the image',)),
]

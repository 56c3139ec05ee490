"""Points that are no depth of the view, and cameras that no lens has."""
from typing import Callable

import numpy as np

from faults.fault import Fault
from faults.injectors import Injector, changed, with_matrix
from skeleton_extract_3d.points.depth import XYZRGB


def cloud_of(value: Callable[[np.ndarray], np.ndarray]) -> Injector:
    """Return what sends a cloud whose x, y and z are functions of the good ones, (N,) float32 each."""
    def altered(data: bytes) -> bytes:
        cloud = np.frombuffer(data, XYZRGB).copy()
        for axis in 'xyz':
            cloud[axis] = value(cloud[axis])
        return cloud.tobytes()
    return changed('points', data=altered)


FAULTS = [
    Fault('cloud of NaN alone', cloud_of(lambda good: good * np.nan), event='no depth',
          words=('0 % of the points are valid', 'NaN')),
    Fault('cloud in millimetres', cloud_of(lambda good: good * 1000), event='implausible depth',
          words=('the median depth is', 'is it in millimetres?')),
    Fault('depth image of zeros alone', changed('points', data=lambda data: bytes(len(data))), node='depth/people',
          event='no depth', words=('is the depth camera covered',)),
    Fault('focal length of 1e-300', with_matrix(k0=1e-300), node='depth/people', words=('fx is 1e-300 px',)),
    Fault('lens that folds the image', changed('info', D=[-50.0, 0, 0, 0, 0], distortion_model='plumb_bob'),
          node='depth/people', words=('folds the image',)),
]

"""Scale of a rig without depth: by the bones of the people, or by the distance of two cameras."""
from dataclasses import replace
from typing import List, Sequence

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.calibration.edges import Standing
from skeleton_extract_3d.constants import METHOD

_BODY = METHOD.body


def scale_of_bones(people: np.ndarray, stature: float) -> float:
    """Return by which factor people must grow so that their bones are those of bodies of a stature.

    Args:
        people: (N, 18, 3), each at one time; NaN where not known.
        stature: mean of the people [m].

    Raises:
        BadInputError: no bone of `BodyConstants.sized_bones` is seen.
    """
    found = expected = 0.0
    for start, end, length in _BODY.sized_bones:
        bone = np.linalg.norm(people[:, COCO_18.index[start]] - people[:, COCO_18.index[end]], axis=1)
        if np.isfinite(bone).any():
            found += float(np.median(bone[np.isfinite(bone)]))
            expected += length * stature / _BODY.adult_stature
    if not found:
        raise BadInputError('no bones are seen, so that the scale can not be found; give the distance of two cameras')
    return expected / found


def scaled(standing: Sequence[Standing], factor: float, root: int) -> List[Standing]:
    """Return the cameras with all distances from the root multiplied."""
    origin = standing[root].pose[1]
    return [replace(one, pose=(one.pose[0], origin + factor * (one.pose[1] - origin))) for one in standing]

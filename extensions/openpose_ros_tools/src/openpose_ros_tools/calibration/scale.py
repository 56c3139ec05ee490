"""Scale of a rig without depth, by the bones of the people."""
import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.body import BODY, BodyConstants


def scale_of_bones(people: np.ndarray, stature: float, constants: BodyConstants = BODY) -> float:
    """Return by which factor people must grow so that their bones are those of bodies of a stature.

    Args:
        people: (N, 18, 3), each at one time; NaN where not known.
        stature: mean of the people [m].

    Raises:
        BadInputError: no bone of `BodyConstants.sized_bones` is visible.
    """
    found = expected = 0.0
    for start, end, length in constants.sized_bones:
        bone = np.linalg.norm(people[:, COCO_18.index[start]] - people[:, COCO_18.index[end]], axis=1)
        if np.isfinite(bone).any():
            found += float(np.median(bone[np.isfinite(bone)]))
            expected += length * stature / constants.adult_stature
    if not found:
        raise BadInputError('no bones are seen, so that the scale can not be found; give the distance of two cameras')
    return expected / found

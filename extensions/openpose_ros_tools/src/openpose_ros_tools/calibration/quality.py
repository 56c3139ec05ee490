"""How good a calibration is: how far two cameras disagree about joints, and how certain the poses are."""
import itertools
from typing import List, NamedTuple, Sequence

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.calibration.bundle import Adjusted
from openpose_ros_tools.calibration.gathering import Gathered
from openpose_ros_tools.calibration.image_edges import LEAST_JOINTS
from openpose_ros_tools.calibration.recording import CameraPaths

# Standard deviations above make the result doubtful [degrees, m, s].
_LARGE = (1.0, 0.05, 0.02)
# Cameras whose angle is less certain are refused [degrees]: at 3 m people would be 0.16 m apart.
_REFUSED = 3.0
# Pairs that share fewer joints are not reported.
_LEAST_SHARED = 10
# Least extent (standard deviation) of the joints along the axis in which they spread least [m]: a plane tells no pose.
_LEAST_SPREAD = 0.05


class EdgeQuality(NamedTuple):
    """Two cameras after the adjustment.

    Attributes:
        first, second: names.
        joints: joints at single times that both see.
        distance: median distance of what they measured, [m]; NaN where one has no depth.
        pixels: median distance of the adjusted joints from the keypoints of both [px]; NaN where no focal length
            is known.
    """

    first: str
    second: str
    joints: int
    distance: float
    pixels: float


def edge_qualities(cameras: Sequence[CameraPaths], adjusted: Adjusted) -> List[EdgeQuality]:
    """Return the quality of all pairs of cameras that see joints together."""
    data = adjusted.gathered
    rotations = np.array([one.pose[0] for one in adjusted.poses])[data.camera]
    centres = np.array([one.pose[1] for one in adjusted.poses])[data.camera]
    placed = np.einsum('mij,mj->mi', rotations, data.measured) + centres
    local = np.einsum('mji,mj->mi', rotations, adjusted.joints[data.point] - centres)
    offsets = local[:, :2] / local[:, 2:] - data.measured[:, :2] / data.measured[:, 2:]
    focal = np.array([camera.recording.focal for camera in cameras])[data.camera]
    pixels = focal * np.linalg.norm(offsets, axis=1)
    row = np.full((len(cameras), len(adjusted.joints)), -1)
    row[data.camera, data.point] = np.arange(len(data.point))
    found = []
    for first, second in itertools.combinations(range(len(cameras)), 2):
        both = (row[first] >= 0) & (row[second] >= 0)
        if both.sum() < _LEAST_SHARED:
            continue
        one, other = row[first, both], row[second, both]
        deep = cameras[first].has_depth and cameras[second].has_depth
        apart = float(np.median(np.linalg.norm(placed[one] - placed[other], axis=1))) if deep else float('nan')
        known = np.concatenate([pixels[one], pixels[other]])
        known = known[np.isfinite(known)]
        found.append(EdgeQuality(cameras[first].name, cameras[second].name, int(both.sum()), apart,
                                 float(np.median(known)) if len(known) else float('nan')))
    return found


def check_connected(names: Sequence[str], gathered: Gathered) -> None:
    """Raise BadInputError where cameras share too few joints after the adjustment to tie them together."""
    seen = coo_matrix((np.ones(len(gathered.point)), (gathered.camera, gathered.point)),
                      (len(names), len(gathered.joints))).tocsr()
    groups, labels = connected_components((seen @ seen.T).toarray() >= LEAST_JOINTS, directed=False)
    if groups > 1:
        named = ' | '.join(', '.join(np.array(names)[labels == group]) for group in range(groups))
        raise BadInputError('the people do not tell how these groups of cameras stand to one another: '
                            f'{named}; let one person walk where all of them see it')


def check_spread(people: np.ndarray) -> None:
    """Raise BadInputError where people (N, 18, 3) [m] in a plane tell no poses of cameras."""
    joints = people[np.isfinite(people).all(axis=2)]
    thickness = np.linalg.svd(joints - joints.mean(axis=0), compute_uv=False)[-1] / np.sqrt(len(joints))
    if thickness < _LEAST_SPREAD:
        raise BadInputError('all joints that cameras share lie in a plane: they spread by '
                            f'{1e3 * thickness:.0f} mm across it, expected {1e3 * _LEAST_SPREAD:.0f} or more; let '
                            'people walk to and fro')


def doubts(names: Sequence[str], std: np.ndarray) -> List[str]:
    """Return which cameras are uncertain.

    Args:
        std: (C, 3) standard deviations of cameras: angle [degrees], position [m], clock [s].

    Raises:
        BadInputError: the people do not tell how a camera stands; the text names the cameras.
    """
    unknown = [f'{name} (to {angle:.1f} degrees)' for name, angle in zip(names, std[:, 0].tolist())
               if not angle <= _REFUSED]
    if unknown:
        raise BadInputError(f'the people do not tell how these cameras stand to {names[0]}: {", ".join(unknown)}; let '
                            'people walk longer where they and others see them')
    return [f'{name} is uncertain by {angle:.1f} degrees, {1e3 * position:.0f} mm and {1e3 * clock:.0f} ms; let people '
            'walk longer where it and others see them' for name, (angle, position, clock) in zip(names, std.tolist())
            if angle > _LARGE[0] or position > _LARGE[1] or clock > _LARGE[2]]

"""Where people are, how they move and how sure that is, and boxes round them: what other packages ask for."""
import math
from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.people import distinct_ids
from openpose_ros_signals.constants import SIGNALS, MotionConstants
from openpose_ros_signals.records import UNKNOWN, FloorPose, PersonSignals
from skeleton_extract_3d.body.body import JOINTS, TRUNK
from skeleton_extract_3d.people import MEASURED, People3D

_TRUNK = frozenset(JOINTS[joint] for joint in TRUNK)
# Variance of what is not known, [m^2], [(m/s)^2] or [rad^2]: spencer_tracking_msgs has more than 99999 for it.
UNKNOWN_VARIANCE = 999999.0


class Box(NamedTuple):
    """A box along the axes: centre and size, (D,) each, in the unit of the points."""

    centre: np.ndarray
    size: np.ndarray


@dataclass(frozen=True)
class Located:
    """A person whose place on the floor is known."""

    id: int
    position: np.ndarray  # (3,) on the floor below the trunk [m]
    orientation: np.ndarray  # (4,) unit quaternion x, y, z, w: x level to where the body faces, z upwards
    velocity: Optional[np.ndarray]  # (3,) over the floor [m/s], zeros while standing still; None: not known yet
    sigma: float  # root mean square distance of the true position [m]; NaN: not known
    turn_sigma: float  # the same of the turn about z [rad]; NaN: not known
    reliability: float  # mean confidence of the joints that were seen in the image, 0 to 1; 0: none was
    measured: bool  # whether any joint was measured in this frame; false: hidden, and estimated
    tags: Tuple[Tuple[str, str], ...]  # names and values of what the person does


def located(people: People3D, signals: Sequence[PersonSignals]) -> List[Located]:
    """Return the people of a frame whose place is known, by their joints and signals, in the order of these."""
    rows = {name: row for row, name in enumerate(distinct_ids(people.ids).tolist())}
    return [_located(people, rows[person.id], person, person.floor) for person in signals
            if person.floor is not None and person.id in rows]


def _located(people: People3D, row: int, person: PersonSignals, floor: FloorPose) -> Located:
    # a lying body faces up or down, which tells no direction on the floor
    walk, body = person.walk, None if person.posture.name == 'lying' else person.body
    tags = [*([] if person.posture.name == UNKNOWN else [('posture', person.posture.name)]),
            *(('gesture', f'{gesture.name} {gesture.arm}') for gesture in person.gestures),
            *([('fallen', 'true')] if person.fall is not None else [])]
    return Located(person.id, floor.position, floor.orientation, None if walk is None else walk.speed * walk.direction,
                   sigma_of(people, row), math.nan if body is None else body.sigma,
                   reliability_of(people.confidence[row]), bool((people.status[row] == MEASURED).any()), tuple(tags))


def sigma_of(people: People3D, row: int) -> float:
    """Return the sigma of a person's place [m]: that of the joints of the trunk, else of all; NaN if none is known."""
    trunk = np.array([name in _TRUNK for name in people.skeleton.joints])
    for sigma in (people.sigma[row, trunk], people.sigma[row]):
        known = sigma[np.isfinite(sigma)].astype(np.float64)
        if len(known):
            return float(np.sqrt(np.mean(known ** 2)))
    return math.nan


def velocity_sigma(person: Located, constants: MotionConstants = SIGNALS.motion) -> float:
    """Return the root mean square error of a velocity [m/s], a difference of two positions; NaN: not known."""
    return math.nan if person.velocity is None else math.sqrt(2) * person.sigma / constants.time


def reliability_of(confidence: np.ndarray) -> float:
    """Return the mean of the confidences (K,) of joints that were seen, which is above 0; 0 if none was."""
    seen = confidence[confidence > 0]
    return float(min(seen.mean(dtype=np.float64), 1.0)) if len(seen) else 0.0


def region_round(keypoints: np.ndarray, margin: float) -> Box:
    """Return the box round keypoints (K, 2), wider on each side by a share of its longer side."""
    return box_round(keypoints, margin * float(box_round(keypoints, 0.0).size.max()))


def box_round(points: np.ndarray, margin: float) -> Box:
    """Return the box round the points (K, D) that are not NaN, one at least, wider by a margin on each side."""
    known = points[np.isfinite(points).all(axis=1)].astype(np.float64)
    least, most = known.min(axis=0), known.max(axis=0)
    return Box((least + most) / 2, most - least + 2 * margin)


def covariance(sigma: float, turn_sigma: float) -> List[float]:
    """Return a 6 x 6 covariance, row by row: of x, y, z, and turns about x, y, z, of which the first two are not known.

    Args:
        sigma: root mean square length of the error in space, the same in all directions; NaN: not known.
        turn_sigma: that of the turn about z; NaN: not known.
    """
    variances = np.array([sigma ** 2 / 3] * 3 + [np.nan, np.nan, turn_sigma ** 2])
    return np.diag(np.where(np.isfinite(variances), variances, UNKNOWN_VARIANCE)).ravel().tolist()

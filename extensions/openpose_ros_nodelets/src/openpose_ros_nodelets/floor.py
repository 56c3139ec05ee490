"""The floor in a point cloud: the largest plane across the vertical that nothing lies below, and over time."""
from dataclasses import dataclass
from typing import Callable, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.params.nodes import DemandParams
from openpose_ros_pkg.params.parameters import direction, parameter

# Points are thinned to their mean in each cube of this size, so that near surfaces do not outvote far ones [m].
_CELL = 0.06
# Points further from the camera are not used [m].
_RANGE = 8.0
# Planes through this many random samples are tried, at most, in steps; RANSAC ends when it is this likely that no
# better one is met.
_SAMPLES, _STEP, _PROBABILITY = 1500, 100, 0.999
# A point below a plane counts against it as this many on it count for it.
_WEIGHT_BELOW = 5.0
# Points within this distance of a plane are on it [m].
_THICKNESS = 0.025
# Points are below a plane from this many thicknesses on, further away by noise: a share of the distance.
_BELOW, _BELOW_PER_METRE = 2.5, 0.01
# The plane is fitted this many times to the points on it.
_FITS = 3
# Greatest share of points below the floor, in points on it and below it. More: it is a table, or a stair leads down.
_MOST_BELOW = 0.03
# At least this much of the floor has to be seen [m^2].
_LEAST_AREA = 0.4
# A floor whose normal is less sure is none: standard deviation [rad]. It grows where a narrow strip is seen.
_MOST_TILT_SIGMA = np.radians(0.4)
# The errors of points within this area are alike: uneven floors and lenses, skirtings, carpets [m^2].
_ALIKE = 0.25
# Planes whose normals and heights differ by less [rad], [m] are the same.
_SAME_ANGLE, _SAME_HEIGHT = 0.05, 0.06
# A plane above the known floor has to stay for this long [s].
_RISE_TIME = 2.0
# The floor is forgotten when no plane has agreed with it for this long, or when time goes back [s].
_MEMORY = 10.0
# Time constant of the mean over time [s].
_SMOOTHING = 0.5


@dataclass(frozen=True)
class FloorParams(DemandParams):
    """Where the floor may be."""

    retired = ('points', 'gravity_tolerance', 'thickness', 'least_area', 'most_below', 'most_tilt_sigma',
               'smoothing_time', 'rate', 'tolerance', 'range')

    up: str = parameter(
        '0 -1 0', "Direction upwards in the frame of the cloud: three numbers. The default is the image's up: of a "
                  'camera that is tilted or rolled by less than 40 degrees.', is_direction=True)
    gravity_frame: str = parameter('', 'Frame of tf whose z axis is up, such as base_link or odom: used instead of '
                                       '`up`, with a tolerance of 10 degrees. Empty: none.')
    least_height: float = parameter(
        0.2, 'Least height of the camera above the floor: the narrower the limits, the fewer tables and beds are taken '
             'for it.', unit='m', minimum=0.0, maximum=100.0)
    most_height: float = parameter(3.0, 'Greatest height of the camera above the floor.', unit='m', minimum=0.0,
                                   maximum=100.0)
    publish_tf: bool = parameter(
        False, 'Publish the frame `floor_frame` on tf, child of the frame of the cloud: origin on the floor below the '
               "camera, x along the camera's view, y left, z up (REP 103). While the floor is hidden, it stays where "
               'it was seen last. The node is then not lazy.')
    floor_frame: str = parameter('world', 'Name of that frame.')

    @property
    def upwards(self) -> np.ndarray:
        """(3,) unit vector of `up`."""
        return direction(self.up, 'up')


class Floor(NamedTuple):
    """A plane n x + d = 0 in the frame of the camera."""

    normal: np.ndarray  # n, (3,) unit vector that points up
    height: float  # d, of the camera above it [m]
    share: float  # of the points, that lie on it
    area: float  # that is seen, at most [m^2]
    height_sigma: float  # standard deviation of the height, by the spread of the points [m]
    tilt_sigma: float  # and of the direction of the normal [rad]

    @property
    def frame(self) -> np.ndarray:
        """(4, 4) transform from the frame on the floor below the camera, x along its view and z up, to the camera's."""
        forward = np.array([0.0, 0, 1]) - self.normal[2] * self.normal
        if np.linalg.norm(forward) < 0.1:  # it looks straight down or up: the upper border of its image is in front
            forward = np.array([0.0, -1, 0]) + self.normal[1] * self.normal
        forward /= np.linalg.norm(forward)
        axes = np.stack([forward, np.cross(self.normal, forward), self.normal, -self.height * self.normal], axis=1)
        return np.vstack([axes, (0, 0, 0, 1)])

    def agrees(self, other: 'Floor') -> bool:
        """Tell whether another plane is the same one."""
        angle = np.arctan2(np.linalg.norm(np.cross(self.normal, other.normal)), self.normal @ other.normal)
        return bool(angle < _SAME_ANGLE and abs(self.height - other.height) < _SAME_HEIGHT)


def find_floor(points: np.ndarray, up: np.ndarray, tolerance: float, params: FloorParams
               ) -> Tuple[Optional[Floor], str]:
    """Return the floor, or None and why there is none, one of a few texts.

    Args:
        points: (N, 3) [m] of one view, finite, in a frame whose origin is the camera.
        up: (3,) about opposite to gravity, unit length.
        tolerance: greatest angle between `up` and the normal [rad].
    """
    cells = _means_in_cells(points[(points ** 2).sum(axis=1) <= _RANGE ** 2]).astype(np.float32)
    if len(cells) * _CELL ** 2 < _LEAST_AREA:
        return None, 'too few points'
    margins = -_BELOW * _THICKNESS - _BELOW_PER_METRE * np.linalg.norm(cells, axis=1)

    def allowed(planes: np.ndarray) -> np.ndarray:
        """Return which planes (N, 4), with their normals up, may be a floor."""
        return ((planes[:, :3] @ up >= np.cos(tolerance)) & (planes[:, 3] >= params.least_height)
                & (planes[:, 3] <= params.most_height))

    def counted(planes: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return the number of cells on planes (N, 4) and below them."""
        heights = planes[:, :3] @ cells.T + planes[:, 3:]
        return np.count_nonzero(np.abs(heights) <= _THICKNESS, axis=1), np.count_nonzero(heights < margins, axis=1)

    planes, fault = _best_plane(cells, up, allowed, counted), 'no plane is large enough'
    for _ in range(_FITS):
        inliers = cells[(np.abs(cells @ planes[:, :3].T + planes[:, 3]) <= _THICKNESS).any(axis=1)]
        if len(inliers) < 3 or not allowed(planes).any():
            return None, fault
        middle = inliers.mean(axis=0)
        normal = np.linalg.eigh(np.cov((inliers - middle).T))[1][:, 0]
        normal *= 1 if normal @ up >= 0 else -1
        planes = np.append(normal, -normal @ middle).astype(np.float32)[None]
    on, below = (int(count[0]) for count in counted(planes))
    if not allowed(planes).any() or on * _CELL ** 2 < _LEAST_AREA:
        return None, fault
    if below > _MOST_BELOW * (on + below):
        return None, 'points lie below the largest plane'
    floor = _described(planes[0].astype(np.float64), inliers, len(cells))
    return (floor, '') if floor.tilt_sigma <= _MOST_TILT_SIGMA else (None, 'the floor that is seen is too narrow')


def _means_in_cells(points: np.ndarray) -> np.ndarray:
    if not len(points):
        return points
    low, *others = np.floor(points / _CELL).astype(np.int64).T
    keys = low
    for axis in others:
        keys = (keys << 20) + axis
    order = np.argsort(keys, kind='stable')
    starts = np.flatnonzero(np.diff(keys[order], prepend=keys[order[0]] - 1))
    return np.add.reduceat(points[order], starts) / np.diff(starts, append=len(order))[:, None]


def _best_plane(cells: np.ndarray, up: np.ndarray, allowed: Callable[[np.ndarray], np.ndarray],
                counted: Callable[[np.ndarray], Tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Return the allowed plane with the most cells on it and the fewest below it by RANSAC, (1, 4); (0, 4): none."""
    samples = np.random.RandomState(0).randint(len(cells), size=(_SAMPLES, 3))
    best, most = np.zeros((0, 4), np.float32), 0.0
    for begin in range(0, _SAMPLES, _STEP):
        first, second, third = cells[samples[begin:begin + _STEP].T]
        normals = np.cross(second - first, third - first)
        lengths = np.linalg.norm(normals, axis=1) * np.sign(normals @ up).astype(np.float32)
        first, normals = first[lengths != 0], normals[lengths != 0] / lengths[lengths != 0, None]
        planes = np.column_stack([normals, -(normals * first).sum(axis=1)])
        planes = planes[allowed(planes)]
        if len(planes):
            on, below = counted(planes)
            scores = on - _WEIGHT_BELOW * below
            if scores.max() > most:
                best, most = planes[[scores.argmax()]], float(scores.max())
        if (1 - (most / len(cells)) ** 3) ** (begin + _STEP) < 1 - _PROBABILITY:
            break
    return best


def _described(plane: np.ndarray, inliers: np.ndarray, number: int) -> Floor:
    """Return the floor of a plane, the points on it, and the number of all points.

    A plane z = q x + r y + s in axes of the floor below the camera has the covariance sigma^2 (A^T A)^-1, where the
    rows of A are (x, y, 1) of points with independent errors.
    """
    normal = plane[:3]
    rows = np.column_stack([inliers @ np.linalg.svd(normal[None])[2][1:].T, np.ones(len(inliers))])
    area = len(inliers) * _CELL ** 2
    squares = float(((inliers @ normal + plane[3]) ** 2).sum())
    covariance = squares / max(area / _ALIKE, 1.0) * np.linalg.inv(rows.T @ rows)
    return Floor(normal, float(plane[3]), len(inliers) / number, area, float(np.sqrt(covariance[2, 2])),
                 float(np.sqrt(covariance[0, 0] + covariance[1, 1])))


class FloorTracker:
    """Decides over time which plane is the floor: smooths what agrees, and believes another plane only when it stays.

    A plane counts when a second one in a row agrees with it. One above the floor that was known, such as a table that
    fills the view, has to stay for longer than one that is as high or lower. Until then there is no floor.
    """

    def __init__(self) -> None:
        self._floor: Optional[Floor] = None
        self._contender: Optional[Floor] = None
        self._stamp = self._contender_since = 0.0

    def update(self, found: Optional[Floor], stamp: float) -> Optional[Floor]:
        """Take the plane of a frame with a stamp [s], if it shows one; return the floor, if it is known."""
        if not 0 <= stamp - self._stamp <= _MEMORY:
            self._floor = self._contender = None
        before, contender, self._contender = self._floor, self._contender, None
        if found is None:
            return None
        if before is not None and before.agrees(found):
            share = 1 - np.exp(-(stamp - self._stamp) / _SMOOTHING)
            normal = before.normal + share * (found.normal - before.normal)
            found = found._replace(normal=normal / np.linalg.norm(normal),
                                   height=before.height + share * (found.height - before.height))
        else:
            stays = contender is not None and contender.agrees(found)
            if not stays:
                self._contender_since = stamp
            rises = before is not None and found.height < before.height - _SAME_HEIGHT
            if not stays or (rises and stamp - self._contender_since < _RISE_TIME):
                self._contender = found
                if before is None:
                    self._stamp = stamp
                return None
        self._floor, self._stamp = found, stamp
        return found

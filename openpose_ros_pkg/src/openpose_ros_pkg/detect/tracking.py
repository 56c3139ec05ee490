"""Track people from frame to frame: ids from the positions of their keypoints in the image."""
import threading
from dataclasses import dataclass, replace
from typing import Any, Callable, Dict, Generic, Hashable, List, Optional, Tuple, TypeVar

import numpy as np

from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import FIRST_ID, People2D

Value = TypeVar('Value')


@dataclass(frozen=True)
class TrackingConstants:
    """How people are expected to move in the image."""

    velocity_gain: float = constant(0.5, "Share of a new measurement in a person's velocity.")
    extrapolation: float = constant(0.5, 'A person out of sight is expected to walk on for this long, then to stand.',
                                    unit='s')
    fragment_cost: float = constant(
        0.15, 'Cost of a person without any joint of a track, in units of person sizes: the track prefers a whole '
              'person to a fragment beside it.')
    reset_backstep: float = constant(
        0.5, 'Stamps that go back by more start a new recording (bag loop), by less are a late frame.', unit='s')
    least_elapsed: float = constant(
        0.01, 'Least time between frames for a velocity: an uneven stamp shall not make a person fast.', unit='s')
    size_decay: float = constant(
        0.05, 'A remembered size shrinks by this share per frame: a bounding box of few joints (a face) says little.')
    least_size: float = constant(10.0, 'Least size of a person, also of a single joint.', unit='px')
    most_cameras: int = constant(
        32, 'Cameras whose people are remembered; of more, the one that sent nothing for longest is forgotten, as '
             'each run of a program that calls the detection service may be a camera of its own.')
    same_aspect: float = constant(
        0.01, 'Images of a camera at two resolutions show the same view where the ratios of their sides differ by no '
              'more than this share.')
    most_tracks: int = constant(
        1000, 'People who are remembered of a camera; with stamps that stand still nobody is ever gone for long.')


TRACKING = TrackingConstants()


@dataclass(frozen=True)
class TrackingParams(Parameters):
    """How long and how far a person is tracked in the image."""

    track_timeout: float = parameter(
        2.0, 'A person who is not seen for longer gets a new person_ID on return. A longer time bridges longer '
             'occlusions, but a newcomer may inherit the id of a person who left at the same place.',
        unit='s', minimum=0.0, maximum=60.0)
    track_gate: float = parameter(
        0.7, 'Largest mean distance between measured and predicted joints of the same person, as a share of the size '
             'of the person (half the diagonal of the bounding box of the joints).',
        minimum=0.01, maximum=10.0)


@dataclass(frozen=True)
class _Track:
    """One tracked person.

    Attributes:
        id: never used again.
        xy: (K, 2) float64 [px], where each joint was, or would have moved to if it is occluded since; NaN: never seen.
        velocity: (2,) [px/s] of the person as a whole.
        size: [px].
        stamp: of the last detection [s].
    """

    id: int
    xy: np.ndarray
    velocity: np.ndarray
    size: float
    stamp: float

    def way(self, stamp: float) -> np.ndarray:
        """Return the predicted motion of the person since the last detection, (2,) [px]."""
        return self.velocity * np.clip(stamp - self.stamp, 0.0, TRACKING.extrapolation)


class PersonIds:
    """Gives ids, each of them once; not thread-safe.

    Attributes:
        next: the id that comes next.
    """

    def __init__(self, first: int = FIRST_ID) -> None:
        self.next = first

    def give(self, count: int) -> np.ndarray:
        """Return new ids, (count,) int64."""
        self.next += count
        return np.arange(self.next - count, self.next, dtype=np.int64)


class KeypointTracker:
    """Gives people ids that stay the same while they are in view: one tracker per camera; not thread-safe.

    People are matched to tracks as a whole (Hungarian method) by the mean distance of their joints from a prediction
    with constant velocity, relative to their size. A person who matches no track starts a new one at once.
    """

    def __init__(self, params: TrackingParams) -> None:
        self._params = params
        self._tracks: List[_Track] = []
        self._ids = PersonIds()
        self._newest: Optional[float] = None

    @property
    def timeout(self) -> float:
        """How long a person who is not seen is remembered [s]."""
        return self._params.track_timeout

    def reconfigure(self, params: TrackingParams) -> None:
        """Use other limits from the next frame on; ids stay."""
        self._params = params

    def shows(self, stamp: float) -> bool:
        """Return whether people may be remembered at a time [s]: frames came shortly before."""
        return self._newest is not None and (
            -TRACKING.reset_backstep <= stamp - self._newest <= self._params.track_timeout)

    def take_over(self, other: 'KeypointTracker', scale: np.ndarray) -> None:
        """Go on with the tracks of another tracker of the same view, in images of another resolution.

        Args:
            scale: pixels of the images of this one per pixel of the other's, along x and y, (2,).
        """
        self._newest = other._newest
        self._tracks = [replace(track, xy=(track.xy + 0.5) * scale - 0.5, velocity=track.velocity * scale,
                                size=track.size * float(scale.mean())) for track in other._tracks]

    def update(self, people: People2D, stamp: float, ids: Optional[PersonIds] = None) -> People2D:
        """Return the people of a frame with their ids.

        A frame that is delivered twice, or a little late, gets the ids of the people that it shows. Stamps that jump
        back end all tracks.

        Args:
            stamp: of the frame [s].
            ids: of those who are new; None: the tracker's own.
        """
        if self._newest is not None and stamp < self._newest - TRACKING.reset_backstep:
            self._tracks = []
            self._newest = None
        self._newest = stamp if self._newest is None else max(stamp, self._newest)
        self._tracks = [track for track in self._tracks if stamp - track.stamp <= self._params.track_timeout]
        sizes = person_sizes(people.xy)
        given = np.full(len(people), -1, np.int64)
        for t, p in self._match(people, sizes, stamp):
            self._tracks[t] = _continued(self._tracks[t], people.xy[p].astype(np.float64), sizes[p], stamp)
            given[p] = self._tracks[t].id
        new = np.flatnonzero(given < 0)
        given[new] = (ids or self._ids).give(len(new))
        for p in new:
            self._tracks.append(
                _Track(int(given[p]), people.xy[p].astype(np.float64), np.zeros(2), float(sizes[p]), stamp))
        self._tracks = self._tracks[-TRACKING.most_tracks:]
        return replace(people, ids=given)

    def expected(self, stamp: float) -> Tuple[List[int], List[np.ndarray]]:
        """Return the ids of the tracks, and where their joints are expected, (K, 2) float64 [px] each.

        Joints that were never seen are NaN. Where stamps jump back, nobody is expected.
        """
        jump = self._newest is not None and stamp < self._newest - TRACKING.reset_backstep
        tracks = [] if jump else [one for one in self._tracks if stamp - one.stamp <= self._params.track_timeout]
        return [track.id for track in tracks], [track.xy + track.way(stamp) for track in tracks]

    def _match(self, people: People2D, sizes: np.ndarray, stamp: float) -> List[Tuple[int, int]]:
        """Return (track, person) index pairs."""
        if not self._tracks or not len(people):
            return []
        expected = np.stack([track.xy + track.way(stamp) for track in self._tracks])
        scale = np.maximum(np.array([track.size for track in self._tracks])[:, None], sizes)
        distances = joint_distances(expected, people.xy) / scale
        costs = distances + TRACKING.fragment_cost * (1 - shared_joints(expected, people.xy))
        return match(costs, distances <= self._params.track_gate)


class PerCamera(Generic[Value]):
    """Something for each camera, made when the camera is first seen; any thread may call it.

    Of more than `TRACKING.most_cameras`, the one that was not asked for longest is forgotten.

    Args:
        create: makes it for a new camera.
        forgotten: called with what is forgotten.
    """

    def __init__(self, create: Callable[[], Value], forgotten: Callable[[Value], None] = lambda value: None) -> None:
        self._create, self._forgotten = create, forgotten
        self._values: Dict[Hashable, Value] = {}  # the longest unused first
        self._lock = threading.Lock()

    def of(self, camera: Hashable) -> Value:
        """Return what belongs to a camera; `camera` is whatever tells the cameras apart."""
        with self._lock:
            value = self._values.pop(camera) if camera in self._values else self._create()
            self._values[camera] = value
            if len(self._values) > TRACKING.most_cameras:
                self._forgotten(self._values.pop(next(iter(self._values))))
            return value

    def all(self) -> List[Value]:
        """Return what there is of all cameras."""
        with self._lock:
            return list(self._values.values())

    def items(self) -> List[Tuple[Any, Value]]:
        """Return all cameras, with what there is of each."""
        with self._lock:
            return list(self._values.items())


def joint_distances(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the mean distance of the joints that both persons have, for each pair of persons.

    Where they share no joint, the distance between the middles of both.

    Args:
        first: (T, K, 2) [px], NaN where missing.
        second: (P, K, 2) [px], NaN where missing.

    Returns:
        (T, P) float64 [px]; infinite for a person without any joint.
    """
    distances = np.linalg.norm(first[:, None].astype(np.float64) - second[None], axis=-1)
    shared = np.isfinite(distances)
    count = shared.sum(axis=2)
    mean = np.where(shared, distances, 0.0).sum(axis=2) / np.maximum(count, 1)
    middles = np.linalg.norm(_middles(first)[:, None] - _middles(second)[None], axis=-1)
    return np.where(count > 0, mean, np.where(np.isfinite(middles), middles, np.inf))


def shared_joints(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return which share of the joints of (T, K, 2) persons (P, K, 2) persons have as well, (T, P) float64."""
    of_first, of_second = np.isfinite(first).all(axis=2), np.isfinite(second).all(axis=2)
    both = of_first.astype(np.float64) @ of_second.T.astype(np.float64)
    return both / np.maximum(of_first.sum(axis=1), 1)[:, None]


def person_sizes(xy: np.ndarray) -> np.ndarray:
    """Return half the diagonal of the box around the joints of (P, K, 2) people, (P,) float64 [px], at least 10."""
    known = np.isfinite(xy)
    high = np.where(known, xy, -np.inf).max(axis=1, initial=-np.inf)
    low = np.where(known, xy, np.inf).min(axis=1, initial=np.inf)
    return np.maximum(np.linalg.norm(np.maximum(high - low, 0.0).astype(np.float64), axis=1) / 2, TRACKING.least_size)


def _middles(xy: np.ndarray) -> np.ndarray:
    """Return the mean of the known joints of (N, K, 2) people, (N, 2); NaN without any."""
    known = np.isfinite(xy).all(axis=2)
    count = known.sum(axis=1)[:, None]
    total = np.where(known[..., None], xy, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _continued(track: _Track, xy: np.ndarray, size: float, stamp: float) -> _Track:
    """Return the track after a detection of the person at (K, 2) positions."""
    if stamp < track.stamp:
        return track
    elapsed = max(stamp - track.stamp, TRACKING.least_elapsed)
    shared = np.isfinite(xy - track.xy).all(axis=1)
    velocity, shift = track.velocity, track.way(stamp)
    if stamp > track.stamp and shared.any():
        # the median: a joint that was found elsewhere does not carry the person away
        shift = np.median((xy - track.xy)[shared], axis=0)
        velocity = velocity + TRACKING.velocity_gain * (shift / elapsed - velocity)
    known = np.isfinite(xy).all(axis=1)
    return _Track(track.id, np.where(known[:, None], xy, track.xy + shift), velocity,
                  max(float(size), track.size * (1 - TRACKING.size_decay)), stamp)

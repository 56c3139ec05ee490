"""Track people from frame to frame: ids from the positions of their keypoints in the image."""
import threading
from dataclasses import dataclass, replace
from typing import Any, Callable, Collection, Dict, Generic, Hashable, List, Optional, Sequence, Tuple, TypeVar

import numpy as np

from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import FIRST_ID, People2D

Value = TypeVar('Value')


@dataclass(frozen=True)
class TrackingConstants:
    """How people are expected to move in the image."""

    gain: float = constant(
        0.5, "Share of a new measurement in a person's velocity and, where it is less, size: a box of few joints (a "
             'face) says little.')
    extrapolation: float = constant(0.5, 'A person out of sight is expected to walk on for this long, then to stand.',
                                    unit='s')
    reset_backstep: float = constant(
        0.5, 'Stamps that go back by more start a new recording (bag loop), by less are a late frame.', unit='s')
    least_elapsed: float = constant(
        0.01, 'Least time between frames for a velocity: an uneven stamp shall not make a person fast.', unit='s')
    least_size: float = constant(10.0, 'Least size of a person, also of a single joint.', unit='px')
    most_cameras: int = constant(
        32, 'Cameras that are remembered; of more, the least recently used one is forgotten, as each run of a client '
            'may be a camera of its own.')
    same_aspect: float = constant(
        0.01, 'Images of a camera at two resolutions show the same view where the ratios of their sides differ by no '
              'more than this share.')
    most_tracks: int = constant(
        1000, 'Tracks that are kept of a camera: with stamps that stand still no track ever times out.')


TRACKING = TrackingConstants()


@dataclass(frozen=True)
class TrackingParams(Parameters):
    """How long and how far a person is tracked in the image."""

    track_timeout: float = parameter(
        2.0, 'A person who is not seen for longer gets a new person_ID on return. A longer time bridges longer '
             'occlusions, but a newcomer may inherit the id of a person who left at the same place.',
        unit='s', minimum=0.0, maximum=60.0)
    image_track_gate: float = parameter(
        0.7, 'Largest mean distance between measured and predicted joints of the same person, as a share of the size '
             'of the person (half the diagonal of the bounding box of the joints).',
        minimum=0.01, maximum=10.0)


@dataclass(frozen=True)
class _Track:
    """A tracked person."""

    id: int  # never used again
    xy: np.ndarray  # (K, 2) float64 [px], the last known or predicted place of each joint; NaN: never detected
    velocity: np.ndarray  # (2,) [px/s] of the person as a whole
    size: float  # [px]
    stamp: float  # of the last detection [s]

    def shift(self, stamp: float, constants: TrackingConstants) -> np.ndarray:
        """Return the predicted motion of the person since the last detection, (2,) [px]."""
        return self.velocity * min(max(stamp - self.stamp, 0.0), constants.extrapolation)

    def updated(self, xy: np.ndarray, size: float, stamp: float, constants: TrackingConstants) -> '_Track':
        """Return the track after a detection of the person at (K, 2) positions."""
        if stamp < self.stamp:
            return self
        elapsed = max(stamp - self.stamp, constants.least_elapsed)
        shared = np.isfinite(xy - self.xy).all(axis=1)
        velocity, shift = self.velocity, self.shift(stamp, constants)
        if stamp > self.stamp and shared.any():
            # the median: one misplaced joint does not move the person
            shift = np.median((xy - self.xy)[shared], axis=0)
            velocity = velocity + constants.gain * (shift / elapsed - velocity)
        known = np.isfinite(xy).all(axis=1)
        return _Track(self.id, np.where(known[:, None], xy, self.xy + shift), velocity,
                      max(float(size), self.size + constants.gain * (float(size) - self.size)), stamp)


class PersonIds:
    """Gives ids, each of them once; not thread-safe. `next` comes next."""

    def __init__(self, first: int = FIRST_ID) -> None:
        self.next = first

    def give(self, count: int) -> np.ndarray:
        """Return new ids, (count,) int64."""
        self.next += count
        return np.arange(self.next - count, self.next, dtype=np.int64)


@dataclass(frozen=True)
class ImageTracks:
    """The tracks in the images of a camera; `updated` returns those after the next frame.

    People are matched to tracks as a whole (Hungarian method) by the mean distance of their joints from a prediction
    with constant velocity, relative to their size. A person who matches no track starts a new one at once.
    """

    params: TrackingParams
    constants: TrackingConstants = TRACKING
    _tracks: Tuple[_Track, ...] = ()
    _newest: Optional[float] = None

    @property
    def timeout(self) -> float:
        """How long a person who is not detected is remembered [s]."""
        return self.params.track_timeout

    def covers(self, stamp: float) -> bool:
        """Return whether tracks may live at a time [s]: frames came shortly before."""
        return self._newest is not None and (
            -self.constants.reset_backstep <= stamp - self._newest <= self.params.track_timeout)

    def scaled(self, scale: np.ndarray) -> 'ImageTracks':
        """Return the tracks in images with (2,) scale times as many pixels along x and y."""
        return replace(self, _tracks=tuple(
            replace(track, xy=(track.xy + 0.5) * scale - 0.5, velocity=track.velocity * scale,
                    size=track.size * float(scale.mean())) for track in self._tracks))

    def updated(self, people: People2D, stamp: float, ids: PersonIds, given: Collection[int] = ()
                ) -> Tuple['ImageTracks', People2D]:
        """Return the tracks after a frame at a stamp [s], and its people with their ids; `ids` are for new tracks.

        Args:
            given: ids of tracks that other people of the frame have.

        A frame that is delivered twice, or a little late, gets the ids of the people that it shows. Stamps that jump
        back end all tracks.
        """
        newest = stamp if self._newest is None or self._jumps(stamp) else max(stamp, self._newest)
        alive = self._alive(stamp)
        others = [track for track in alive if track.id in given]
        tracks = [track for track in alive if track.id not in given]
        sizes = person_sizes(people.xy, self.constants)
        named = np.full(len(people), -1, np.int64)
        for t, p in self._match(tracks, people, sizes, stamp):
            tracks[t] = tracks[t].updated(people.xy[p].astype(np.float64), sizes[p], stamp, self.constants)
            named[p] = tracks[t].id
        new = np.flatnonzero(named < 0)
        named[new] = ids.give(len(new))
        tracks += [_Track(int(named[p]), people.xy[p].astype(np.float64), np.zeros(2), float(sizes[p]), stamp)
                   for p in new]
        kept = tuple((others + tracks)[-self.constants.most_tracks:])
        return replace(self, _tracks=kept, _newest=newest), replace(people, ids=named)

    def expected(self, stamp: float) -> Tuple[List[int], List[np.ndarray]]:
        """Return the ids of the tracks, and where their joints are expected, (K, 2) float64 [px] each.

        Joints that were never detected are NaN. Where stamps jump back, there are none.
        """
        tracks = self._alive(stamp)
        return [track.id for track in tracks], [track.xy + track.shift(stamp, self.constants) for track in tracks]

    def _jumps(self, stamp: float) -> bool:
        return self._newest is not None and stamp < self._newest - self.constants.reset_backstep

    def _alive(self, stamp: float) -> List[_Track]:
        return [] if self._jumps(stamp) else [
            track for track in self._tracks if stamp - track.stamp <= self.params.track_timeout]

    def _match(self, tracks: Sequence[_Track], people: People2D, sizes: np.ndarray, stamp: float
               ) -> List[Tuple[int, int]]:
        """Return pairs of the indices of track and person."""
        if not tracks or not len(people):
            return []
        expected = np.stack([track.xy + track.shift(stamp, self.constants) for track in tracks])
        scale = np.maximum(np.array([track.size for track in tracks])[:, None], sizes)
        distances = joint_distances(expected, people.xy) / scale
        return match(distances, distances <= self.params.image_track_gate)


class KeypointTracker:
    """Gives the people in the images of one camera ids that stay the same while they are in view; not thread-safe."""

    def __init__(self, params: TrackingParams) -> None:
        self._tracks, self._ids = ImageTracks(params), PersonIds()

    def update(self, people: People2D, stamp: float) -> People2D:
        """Return the people of a frame with their ids; see `ImageTracks.updated`."""
        self._tracks, named = self._tracks.updated(people, stamp, self._ids)
        return named


class PerCamera(Generic[Value]):
    """A value for each camera, made when the camera is first used; any thread may call it.

    Of more than `most` cameras, the least recently used one is forgotten: `forgotten` is called with its value.
    """

    def __init__(self, create: Callable[[], Value], forgotten: Callable[[Value], None] = lambda value: None,
                 most: int = TRACKING.most_cameras) -> None:
        self._create, self._forgotten, self._most = create, forgotten, most
        self._values: Dict[Hashable, Value] = {}  # the longest unused first
        self._lock = threading.Lock()

    def of(self, camera: Hashable) -> Value:
        with self._lock:
            value = self._values.pop(camera) if camera in self._values else self._create()
            self._keep(camera, value)
            return value

    def put(self, camera: Hashable, value: Value) -> None:
        """Replace the value of a camera."""
        with self._lock:
            self._values.pop(camera, None)
            self._keep(camera, value)

    def _keep(self, camera: Hashable, value: Value) -> None:
        self._values[camera] = value
        if len(self._values) > self._most:
            self._forgotten(self._values.pop(next(iter(self._values))))

    def all(self) -> List[Value]:
        with self._lock:
            return list(self._values.values())

    def items(self) -> List[Tuple[Any, Value]]:
        """Return all cameras and their values, the least recently used first."""
        with self._lock:
            return list(self._values.items())


def joint_distances(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the mean distance of the joints that two people share, for each pair; without any, of their middles.

    Args:
        first, second: (T, K, 2) and (P, K, 2) [px], NaN where missing.

    Returns:
        (T, P) float64 [px]; infinite for a person without any joint.
    """
    distances = np.linalg.norm(first[:, None].astype(np.float64) - second[None], axis=-1)
    shared = np.isfinite(distances)
    count = shared.sum(axis=2)
    mean = np.where(shared, distances, 0.0).sum(axis=2) / np.maximum(count, 1)
    middles = np.linalg.norm(_middles(first)[:, None] - _middles(second)[None], axis=-1)
    return np.where(count > 0, mean, np.where(np.isfinite(middles), middles, np.inf))


def person_sizes(xy: np.ndarray, constants: TrackingConstants = TRACKING) -> np.ndarray:
    """Return half the diagonal of the box around the joints of people, (..., K, 2) [px], bounded below.

    Returns:
        (...,) float64 [px].
    """
    sides = (np.fmax.reduce(xy, axis=-2) - np.fmin.reduce(xy, axis=-2)).astype(np.float64)
    return np.fmax(np.hypot(sides[..., 0], sides[..., 1]) / 2, constants.least_size)


def _middles(xy: np.ndarray) -> np.ndarray:
    """Return the mean of the known joints of (N, K, 2) people, (N, 2); NaN without any."""
    known = np.isfinite(xy).all(axis=2)
    count = known.sum(axis=1)[:, None]
    total = np.where(known[..., None], xy, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)

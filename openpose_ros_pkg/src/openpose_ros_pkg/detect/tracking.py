"""Track people from frame to frame: ids from the positions of their keypoints in the image."""
import itertools
from dataclasses import dataclass, replace
from typing import Callable, Dict, Generic, Hashable, Iterator, List, Optional, Sequence, Tuple, TypeVar

import numpy as np

from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.detect.detection import Looks
from openpose_ros_pkg.detect.existence import EXISTENCE, decayed, of_detection, of_miss, with_evidence
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import FIRST_ID, ExpectedPeople, People2D, keypoints_in
from openpose_ros_pkg.skeletons import COCO_18, SkeletonModel

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
    spread_growth: float = constant(
        0.5, 'Growth of the standard deviation of the place of a person, as a share of its size.', unit='1/s')
    open_view: float = constant(
        0.95, 'Visibility of people in the image, where no depth tells whether something is in front of them.')
    most_tracks: int = constant(
        1000, 'Tracks that are kept of a camera: with stamps that stand still no track ever times out.')
    gate: float = constant(
        0.7, 'Largest mean distance between measured and predicted joints of the same person.',
        unit="half the diagonal of the box of the person's joints")
    turned_images: int = constant(10, 'Images of a person from which on it tells how the camera is turned.')
    turned_share: float = constant(
        0.8, 'A camera is turned where this share of the people have, in this share of images, the head to one side.')
    turned_people: int = constant(2, 'Least number of people with the heads to the left or right, as one may lie.')


TRACKING = TrackingConstants()
TURNED_CAMERA = 'the camera seems to be turned'
"""What nodes warn of where `Mounting` finds a fault."""
_TRUNK = ('left_shoulder', 'right_shoulder', 'left_hip', 'right_hip')


@dataclass(frozen=True)
class TrackingParams(Parameters):
    """How long and how far a person is tracked in the image."""

    retired = ('image_track_gate',)

    track_timeout: float = parameter(
        2.0, 'A person who is not seen for longer gets a new person_ID on return. A longer time bridges longer '
             'occlusions, but a newcomer may inherit the id of a person who left at the same place.',
        unit='s', minimum=0.0, maximum=60.0)


@dataclass(frozen=True)
class _Track:
    """A tracked person."""

    id: int  # never used again
    keypoints: np.ndarray  # (K, 3) float64 x, y [px], score: the last known place of each joint; NaN, NaN, 0: none
    velocity: np.ndarray  # (2,) [px/s] of the person as a whole
    size: float  # [px]
    stamp: float  # of the last detection [s]
    existence: float  # probability that the person is there, at `looked`
    looked: float  # stamp of the last look [s]

    def shift(self, stamp: float, constants: TrackingConstants) -> np.ndarray:
        """Return the predicted motion of the person since the last detection, (2,) [px]."""
        return self.velocity * min(max(stamp - self.stamp, 0.0), constants.extrapolation)

    def at(self, stamp: float, constants: TrackingConstants) -> np.ndarray:
        """Return the predicted keypoints, (K, 3)."""
        return self.keypoints + np.append(self.shift(stamp, constants), 0.0)

    def updated(self, keypoints: np.ndarray, size: float, stamp: float, constants: TrackingConstants) -> '_Track':
        """Return the track after a detection of the person with (K, 3) keypoints."""
        if stamp < self.stamp:
            return self
        elapsed = max(stamp - self.stamp, constants.least_elapsed)
        apart = (keypoints - self.keypoints)[:, :2]
        shared = np.isfinite(apart).all(axis=1)
        velocity, shift = self.velocity, self.shift(stamp, constants)
        if stamp > self.stamp and shared.any():
            # the median: one misplaced joint does not move the person
            shift = np.median(apart[shared], axis=0)
            velocity = velocity + constants.gain * (shift / elapsed - velocity)
        known = np.isfinite(keypoints[:, :1])
        return replace(self, keypoints=np.where(known, keypoints, self.keypoints + np.append(shift, 0.0)),
                       velocity=velocity, stamp=stamp,
                       size=max(float(size), self.size + constants.gain * (float(size) - self.size)))


class ImageTracker:
    """Gives the people in the images of one camera ids that stay the same while they are in view; not thread-safe.

    People are matched to tracks as a whole (Hungarian method) by the mean distance of their joints from a prediction
    with constant velocity, relative to their size. A person who matches no track starts a new one at once.

    Args:
        ids: of new tracks; None: 1, 2, 3, ...
    """

    def __init__(self, params: TrackingParams, ids: Optional[Iterator[int]] = None,
                 constants: TrackingConstants = TRACKING) -> None:
        self.params = params
        self._ids, self._constants = itertools.count(FIRST_ID) if ids is None else ids, constants
        self._tracks: Tuple[_Track, ...] = ()
        self._newest: Optional[float] = None
        self._size: Tuple[int, int] = (0, 0)

    def expected(self, stamp: float, size: Tuple[int, int], skeleton: SkeletonModel) -> ExpectedPeople:
        """Return the people expected in an image of (width, height) [px] at a stamp [s]."""
        tracks = [track for track in self._alive(stamp, size)
                  if self._existence(track, stamp, size) >= EXISTENCE.ended]
        if not tracks:
            return ExpectedPeople.none(skeleton)
        keypoints = np.stack([track.at(stamp, self._constants) for track in tracks])
        return ExpectedPeople(
            skeleton, keypoints.astype(np.float32), np.array([track.id for track in tracks]),
            np.array([self._existence(track, stamp, size) for track in tracks]),
            np.array([self._visibility(track, stamp, size) for track in tracks]),
            np.array([self._constants.spread_growth * max(stamp - track.stamp, 0.0) for track in tracks]))

    def update(self, looks: Looks, stamp: float, size: Tuple[int, int]) -> People2D:
        """Return the people of an image with their ids: the detections, and then people whose look was not due.

        An image that is delivered twice, or a little late, gets the ids of the people that it shows. Stamps that jump
        back end all tracks.
        """
        people = looks.people
        if stamp <= 0:
            return replace(people, ids=self._given(len(people)))
        newest = stamp if self._newest is None or self._jumps(stamp) else max(stamp, self._newest)
        tracks, sizes = self._alive(stamp, size), person_sizes(people.xy, self._constants)
        matched = dict(self._match(tracks, people, sizes, stamp))
        looked = {*looks.missed.tolist(), *people.ids.tolist()}
        evidence = of_detection(people.scores)
        ids, existence = np.full(len(people), -1, np.int64), with_evidence(EXISTENCE.unseen, evidence)
        after: List[_Track] = []
        waiting: List[_Track] = []
        for row, track in enumerate(tracks):
            there = self._existence(track, stamp, size)
            if row in matched:
                person = matched[row]
                ids[person], existence[person] = track.id, with_evidence(there, evidence[person])
                track = replace(track.updated(people.keypoints[person].astype(np.float64), sizes[person], stamp,
                                              self._constants),
                                existence=float(existence[person]), looked=max(stamp, track.looked))
            elif track.id in looked:
                miss = of_miss(self._visibility(track, stamp, size), stamp - track.looked)
                track = replace(track, existence=float(with_evidence(there, miss)), looked=stamp)
            elif track.looked == track.stamp < stamp and there >= EXISTENCE.reported:
                waiting.append(track)
            after.append(track)
        new = np.flatnonzero(ids < 0)
        ids[new], existence[new] = self._given(len(new)), np.minimum(existence[new], EXISTENCE.born)
        after += [_Track(int(ids[p]), people.keypoints[p].astype(np.float64), np.zeros(2), float(sizes[p]), stamp,
                         float(existence[p]), stamp) for p in new]
        self._tracks, self._newest, self._size = tuple(after[-self._constants.most_tracks:]), newest, size
        named = replace(people, ids=ids, existence=existence)
        return named.joined(self._predicted(waiting, people.skeleton, stamp, size)) if waiting else named

    def _given(self, count: int) -> np.ndarray:
        return np.array(list(itertools.islice(self._ids, count)), np.int64)

    def _predicted(self, tracks: Sequence[_Track], skeleton: SkeletonModel, stamp: float, size: Tuple[int, int]
                   ) -> People2D:
        """Return people at the places that their tracks predict."""
        keypoints = np.stack([track.at(stamp, self._constants) for track in tracks]).astype(np.float32)
        outside = ~((keypoints[..., :2] >= 0) & (keypoints[..., :2] <= np.subtract(size, 1))).all(axis=2)
        keypoints[outside] = np.nan, np.nan, 0
        return People2D(skeleton, keypoints, keypoints[..., 2].mean(axis=1), np.array([track.id for track in tracks]),
                        np.zeros(len(tracks), bool),
                        existence=np.array([self._existence(track, stamp, size) for track in tracks]))

    def _existence(self, track: _Track, stamp: float, size: Tuple[int, int]) -> float:
        """Return the probability that a person is there at a stamp [s], before a look at it."""
        inside = _inside(track.at(stamp, self._constants), size)
        lasting = max(self.params.track_timeout if inside > 0.5 else EXISTENCE.leaving, 1e-3)
        return float(decayed(track.existence, stamp - track.looked, lasting))

    def _visibility(self, track: _Track, stamp: float, size: Tuple[int, int]) -> float:
        return self._constants.open_view * _inside(track.at(stamp, self._constants), size)

    def _jumps(self, stamp: float) -> bool:
        return self._newest is not None and stamp < self._newest - self._constants.reset_backstep

    def _alive(self, stamp: float, size: Tuple[int, int]) -> List[_Track]:
        """Return the tracks at a stamp [s], in images of (width, height) [px]."""
        scale = np.divide(size, np.maximum(self._size, 1))
        if self._jumps(stamp) or abs(scale[0] / scale[1] - 1) > self._constants.same_aspect:
            return []
        tracks = [track for track in self._tracks if stamp - track.stamp <= self.params.track_timeout]
        if size == self._size:
            return tracks
        # of x, y, score; an integer is the centre of a pixel
        scales, middle = np.append(scale, 1.0), np.array([0.5, 0.5, 0.0])
        return [replace(track, keypoints=(track.keypoints + middle) * scales - middle,
                        velocity=track.velocity * scale, size=track.size * float(scale.mean())) for track in tracks]

    def _match(self, tracks: Sequence[_Track], people: People2D, sizes: np.ndarray, stamp: float
               ) -> List[Tuple[int, int]]:
        """Return pairs of the indices of track and person."""
        if not tracks or not len(people):
            return []
        expected = np.stack([track.at(stamp, self._constants)[:, :2] for track in tracks])
        scale = np.maximum(np.array([track.size for track in tracks])[:, None], sizes)
        distances = joint_distances(expected, people.xy) / scale
        return match(distances, distances <= self._constants.gate)


class Mounting:
    """Tells how a camera is turned, by the side of its images to which the heads of tracked people are."""

    def __init__(self, constants: TrackingConstants = TRACKING) -> None:
        self._constants = constants
        self._sides: Dict[int, np.ndarray] = {}  # by id, the newest last: images with the head up, right, down, left

    def fault(self, people: People2D) -> str:
        """Return in words how the camera seems to be turned, after the people of one more image; empty: it is level."""
        constants, xy = self._constants, keypoints_in(people.keypoints, people.skeleton, COCO_18)[..., :2]
        left, right, *hips = (xy[:, COCO_18.index[joint]].astype(np.float64) for joint in _TRUNK)
        trunks, shoulders = (left + right - sum(hips)) / 2, left - right
        with np.errstate(invalid='ignore'):  # a shorter trunk is seen from its end, as of a person who lies
            seen = np.linalg.norm(trunks, axis=1) > np.linalg.norm(shoulders, axis=1)
        for person in np.flatnonzero(seen & (people.ids >= 0)):
            side = int(np.rint(np.arctan2(trunks[person, 0], -trunks[person, 1]) / (np.pi / 2))) % 4
            number = int(people.ids[person])
            self._sides[number] = self._sides.pop(number, np.zeros(4, int)) + np.eye(4, dtype=int)[side]
        for number in [*self._sides][:-constants.most_tracks]:
            del self._sides[number]
        counted = [self._sides[number] for number in people.ids.tolist() if number in self._sides
                and self._sides[number].sum() >= constants.turned_images]
        count = sum((sides >= constants.turned_share * sides.sum() for sides in counted), np.zeros(4, int))
        side = int(np.argmax(count))
        least = max(constants.turned_share * len(counted), 1 if side == 2 else constants.turned_people)
        if side == 0 or count[side] < least:
            return ''
        how = 'their hips above their necks' if side == 2 else 'their heads to one side'
        return (f'{count[side]} of {len(counted)} people have {how}: if they stand, set the parameter rotate_image: '
                f'{360 - 90 * side}')


class PerCamera(Generic[Value]):
    """A value for each camera, made when the camera is first used; of too many the longest unused one is forgotten."""

    def __init__(self, create: Callable[[], Value]) -> None:
        self._create = create
        self._values: Dict[Hashable, Value] = {}  # the longest unused first

    def of(self, camera: Hashable) -> Value:
        """Return the value of a camera."""
        value = self._values.pop(camera) if camera in self._values else self._create()
        self.put(camera, value)
        return value

    def put(self, camera: Hashable, value: Value) -> None:
        """Replace the value of a camera."""
        self._values.pop(camera, None)
        self._values[camera] = value
        if len(self._values) > TRACKING.most_cameras:
            self._values.pop(next(iter(self._values)))

    def all(self) -> List[Value]:
        """Return the values of all cameras."""
        return list(self._values.values())


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


def _inside(keypoints: np.ndarray, size: Tuple[int, int]) -> float:
    """Return the share of the known joints of a person, (K, 3), that lie in an image of (width, height) [px]."""
    xy = keypoints[:, :2]
    known = np.isfinite(xy).all(axis=1)
    with np.errstate(invalid='ignore'):
        return float(((xy >= 0) & (xy <= np.subtract(size, 1))).all(axis=1).sum() / max(known.sum(), 1))

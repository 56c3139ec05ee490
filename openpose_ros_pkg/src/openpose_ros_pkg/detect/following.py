"""Following: where tracked people are expected in the next image, and which opinions on them count."""
import math
from dataclasses import dataclass, field, replace
from typing import Collection, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.detect.occlusion_masks import COVER
from openpose_ros_pkg.detect.recipes import DetectorParams, Recipe
from openpose_ros_pkg.detect.tracking import ImageTracks, PersonIds, person_sizes
from openpose_ros_pkg.ensemble import (
    ENSEMBLE,
    EnsembleConstants,
    extent,
    mean_scores,
    medians,
    person_scores,
    similarity,
    stacked,
    vote_with_crops,
)
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import People2D, Poses, joined_points, no_points


@dataclass(frozen=True)
class FollowingParams(Parameters):
    """Whether people are followed in the images of a stream, instead of being searched for in every image."""

    following: str = parameter(
        'auto', 'Look for people where they are expected, and search the rest of the image little by little; auto: '
                'where target_rate is set and mode is not accurate; never: search every image in full.',
        choices=('auto', 'always', 'never'))
    search_period: int = parameter(
        5, 'Without a target_rate, every image of this number is searched in full.', minimum=1, maximum=1000)
    follow_requests: bool = parameter(
        True, 'Follow people also in images that clients send one by one, by the frame_id and stamp of their headers; '
              'false: search each of these in full.')

    def wanted(self, detector: DetectorParams) -> bool:
        """Return whether people are followed with a detector of these parameters."""
        if self.following == 'auto':
            return detector.target_rate > 0 and detector.mode != 'accurate'
        return self.following == 'always'


NEVER_FOLLOWED = FollowingParams(following='never')


@dataclass(frozen=True)
class FollowingConstants:
    """How people are followed on crops of the image."""

    agreement: float = constant(
        0.35, 'Greatest median distance of the joints from where they are expected, as a share of the size of the '
              'person (half the diagonal of the box of the joints).')
    agreement_growth: float = constant(1.0, 'Growth of that distance while a person is not detected.', unit='1/s')
    base_error: float = constant(
        0.05, 'Added to the last such distance in the order of crops, so that a person who moved as expected gets one '
              'too.')
    unlooked_time: float = constant(0.15, 'Maximum time a track is extrapolated without a crop.', unit='s')
    lost_time: float = constant(
        0.6, 'A person who is not detected is looked for on crops for this long. After a longer gap between stamps '
             'no person is expected anywhere, so the image is searched in full.', unit='s')
    same_in_space: float = constant(
        0.5, 'Greatest such distance between the predictions of a track in the image and of its track in space; it '
             'grows in the same way.')
    fading: float = constant(0.25, 'Time in which the weight of an opinion fades to 1/e.', unit='s')
    least_weight: float = constant(0.1, 'Opinions whose weight faded to less are forgotten: joints that a full search '
                                        'alone knows end.')
    least_score: float = constant(1e-3, 'Score of an expected joint that was not detected lately.')


FOLLOWING = FollowingConstants()


class Opinion(NamedTuple):
    """A pose that a source gave for a person."""

    pose: Optional[np.ndarray]  # (K, 3) float32; None: the source did not find the person
    reference: np.ndarray  # (K, 2) [px], the places of the person's joints then
    stamp: float  # [s]

    def share(self, stamp: float, constants: FollowingConstants) -> float:
        """Return the share of its weight that counts at a time [s]; that the person was not found does not fade."""
        if self.pose is None:
            return 1.0
        share = math.exp((self.stamp - stamp) / constants.fading)
        return share if share >= constants.least_weight else 0.0


@dataclass(frozen=True, eq=False)
class PersonMemory:
    """What is remembered of a tracked person."""

    scores: np.ndarray  # (K,) of the joints at the last detection
    detected: float  # stamp of that frame [s]
    error: float  # distance from the expected place in the last crop, see `disagreement`; 0: not found in it
    opinions: Mapping[int, Opinion]  # the last one of each source, by its number
    looked: float  # stamp of the last crop, in which the person may not have been found [s]

    def told(self, person: 'FollowedPerson', stamp: float) -> 'PersonMemory':
        """Return the memory with the opinions on the person of a frame."""
        return replace(self, opinions={**self.opinions, **person.opinions_at(stamp)})


@dataclass(frozen=True, eq=False)
class FollowedPerson:
    """A person in a frame: tracked, or new."""

    expected: np.ndarray  # (K, 3) x, y [px], score, predicted by the track; of a new person, where the search found it
    number: int = -1  # id of the track; -1: new
    memory: Optional[PersonMemory] = None  # of the track; None: new
    unseen: float = 0.0  # time since the last detection [s]
    unlooked: float = 0.0  # time since the last crop [s]
    crop: Optional[np.ndarray] = None  # (K, 3) pose on a crop; None: none
    points: Optional[np.ndarray] = None  # (133, 3) all points on a crop, see `Poses`; None: none
    error: float = 0.0  # distance of that pose from the expected one, see `disagreement`; 0 without a crop
    # of this frame, by the number of the source; None: the source did not find the person
    opinions: Mapping[int, Optional[np.ndarray]] = field(default_factory=dict)
    constants: FollowingConstants = FOLLOWING

    @property
    def box(self) -> np.ndarray:
        """Least, and greatest x and y of the detected or expected joints, (2, 2) [px]."""
        pose = self.expected if self.crop is None else self.crop
        sure = pose[pose[:, 2] >= COVER.sure_joint]
        return np.stack(extent(sure if len(sure) > 1 else pose))

    @property
    def found(self) -> bool:
        """Whether a source found the person in this frame."""
        return any(pose is not None for pose in self.opinions.values())

    @property
    def recent(self) -> bool:
        """Whether the person was detected a moment ago."""
        return self.unseen <= self.constants.unlooked_time

    @property
    def lost(self) -> bool:
        """Whether no crop shows the person, though one was computed."""
        return bool(self.opinions) and self.crop is None

    @property
    def reported(self) -> bool:
        """Whether the person is part of the result: found, or extrapolated for a short time."""
        return self.found or (not self.opinions and self.recent)

    @property
    def urgency(self) -> float:
        """Rank among the people who wait for a crop."""
        return 0.0 if self.memory is None else self.unlooked * (self.constants.base_error + self.memory.error)

    @property
    def reference(self) -> np.ndarray:
        """Places of the joints, (K, 2) [px]: on the crop, else expected."""
        expected = self.expected[:, :2]
        return expected if self.crop is None else np.where(np.isfinite(self.crop[:, :2]), self.crop[:, :2], expected)

    @property
    def pose(self) -> np.ndarray:
        """(K, 3) places of the joints with the expected scores."""
        return np.concatenate([self.reference, self.expected[:, 2:]], axis=1)

    @property
    def agreed(self) -> float:
        """Greatest disagreement with the expected place of a pose on a crop that is the person."""
        return self.constants.agreement + self.constants.agreement_growth * self.unseen

    def without_crop(self, recipe: Recipe) -> 'FollowedPerson':
        """Return the person where the crops show another one."""
        missed = dict.fromkeys(range(recipe.pass_opinions, len(recipe.weights)))
        return replace(self, crop=None, points=None, error=0.0, opinions={**self.opinions, **missed})

    def remembered(self, keypoints: np.ndarray, stamp: float) -> PersonMemory:
        """Return the memory after the person was reported with (K, 3) keypoints."""
        if self.memory is not None and not self.found:
            return self.memory.told(self, stamp)
        if self.memory is None:  # how the person moves is not known yet
            return PersonMemory(keypoints[:, 2], stamp, self.constants.agreement, self.opinions_at(stamp), stamp)
        return PersonMemory(keypoints[:, 2], stamp, self.error, self.memory.opinions, stamp).told(self, stamp)

    def opinions_at(self, stamp: float) -> Dict[int, Opinion]:
        """Return what is to be remembered of the opinions of this frame."""
        reference = self.reference
        return {number: Opinion(pose, reference, stamp) for number, pose in self.opinions.items()}


@dataclass(frozen=True, eq=False)
class Following:
    """The tracked people of a camera."""

    tracks: ImageTracks  # of the images
    memories: Mapping[int, PersonMemory] = field(default_factory=dict)  # of the tracks, by their ids
    constants: FollowingConstants = FOLLOWING

    @property
    def lost_time(self) -> float:
        """How long a person who is not detected is expected [s]."""
        return min(self.constants.lost_time, self.tracks.timeout)

    def expected(self, stamp: float, in_space: Optional[np.ndarray], waited: float) -> List[FollowedPerson]:
        """Return the people expected in an image.

        Args:
            stamp: [s].
            in_space: (P, K, 3) people expected by tracks in space; None: no such tracks.
            waited: time since the last frame without a free network [s]; it makes no person lost.
        """
        people = []
        for number, xy in zip(*self.tracks.expected(stamp)):
            memory = self.memories.get(number)
            if memory is not None and stamp - memory.detected <= self.constants.lost_time + waited:
                there = np.isfinite(xy).all(axis=1)
                scores = np.where(there, np.maximum(memory.scores, self.constants.least_score), 0.0)
                pose = np.concatenate([xy, scores[:, None]], axis=1).astype(np.float32)
                people.append(FollowedPerson(pose, number, memory, max(stamp - memory.detected, 0.0),
                                             max(stamp - memory.looked, 0.0), constants=self.constants))
        return people if in_space is None else _expected_in_space(people, in_space, self.constants)

    def looked_for(self, persons: Sequence[FollowedPerson], stamp: float) -> 'Following':
        """Return this after crops of people, whether they were found or not."""
        return replace(self, memories={**self.memories, **{
            person.number: replace(self.memories[person.number], looked=stamp, error=0.0) for person in persons}})

    def updated(self, people: People2D, persons: Sequence[FollowedPerson], stamp: float, ids: PersonIds,
                given: Collection[int] = ()) -> Tuple['Following', People2D]:
        """Return this after a frame, and its people with their ids.

        Args:
            persons: one for each of the people.
            ids: of new tracks.
            given: ids of other people of the frame.
        """
        tracks, people = self.tracks.updated(people, stamp, ids, given)
        memories = {**self.memories, **{int(people.ids[i]): person.remembered(people.keypoints[i], stamp)
                                        for i, person in enumerate(persons)}}
        alive = set(tracks.expected(stamp)[0])
        return replace(self, tracks=tracks, memories={
            number: memory for number, memory in memories.items()
            if stamp - memory.detected <= self.constants.lost_time and number in alive}), people

    def told(self, persons: Mapping[int, FollowedPerson], stamp: float) -> 'Following':
        """Return this with more opinions on people of the newest frame, by their ids."""
        return replace(self, memories={number: memory.told(persons[number], stamp) if number in persons else memory
                                       for number, memory in self.memories.items()})


def voted(people: Sequence[FollowedPerson], recipe: Recipe, stamp: float) -> Poses:
    """Return people by all opinions on them; earlier ones move with the person and fade.

    Sources that did not find a person count until they look again, those that never looked do not.
    """
    sources = recipe.sources
    poses = stacked([person.opinions for person in people], len(sources.weights), len(sources.sigmas))
    shares, moving = np.ones(poses.shape[:2]), []
    for i, person in enumerate(people):
        for number in set(range(len(sources.weights))) - person.opinions.keys():
            earlier = None if person.memory is None else person.memory.opinions.get(number)
            shares[i, number] = 0.0 if earlier is None else earlier.share(stamp, person.constants)
            if earlier is not None and earlier.pose is not None and shares[i, number] > 0:
                moving.append((i, number, earlier.pose, person.reference - earlier.reference))
    if moving:
        rows, numbers, earlier_poses, shifts = zip(*moving)
        poses[rows, numbers] = _moved(np.stack(earlier_poses), np.stack(shifts))
    keypoints = vote_with_crops(poses, replace(sources, weights=sources.weights * shares,
                                               place_weights=sources.place_weights * shares))
    return Poses(keypoints, person_scores(keypoints, (shares > 0) @ sources.known),
                 _points(people) if recipe.whole_body else None)


def _points(people: Sequence[FollowedPerson]) -> np.ndarray:
    """Return all points of people on crops of this frame, (P, 133, 3)."""
    points = no_points(len(people))
    for of_person, person in zip(points, people):
        if person.points is not None:
            of_person[:] = person.points
    return points


def _moved(poses: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """Return poses, (N, K, 3), moved by the shifts of their joints, (N, K, 2) [px]; unknown ones by the median."""
    known = np.isfinite(shifts).all(axis=2)
    median = medians(shifts.swapaxes(1, 2), known[:, None])
    median = np.where(np.isfinite(median), median, median.dtype.type(0))
    places = poses[..., :2] + np.where(known[..., None], shifts, median[:, None])
    return np.concatenate([places, poses[..., 2:]], axis=2)


def with_crops(people: Sequence[FollowedPerson], number: int, found: Sequence[Poses], known: np.ndarray
               ) -> List[FollowedPerson]:
    """Return people after a source saw a crop of each, with the first of the poses there that is the person.

    Args:
        known: (K,) bool, the joints that the source can tell of.
    """
    poses = np.concatenate([of_person.keypoints for of_person in found]) if found else np.zeros((0, 0, 3))
    if not len(poses):
        return [replace(person, opinions={**person.opinions, number: None}) for person in people]
    owners = np.repeat(np.arange(len(people)), [len(of_person.keypoints) for of_person in found])
    points = joined_points(*((of_person.points, len(of_person.keypoints)) for of_person in found))
    apart = disagreement(poses, np.stack([person.expected for person in people])[owners])
    new = np.array([person.memory is None for person in people])[owners]
    sure = (mean_scores(poses, known) >= COVER.sure_joint) & (
        apart <= np.array([person.agreed for person in people])[owners])
    first = {owners[i]: i for i in np.flatnonzero(new | sure)[::-1].tolist()}
    result = []
    for i, person in enumerate(people):
        pose = poses[first[i]] if i in first else None
        if pose is not None and person.crop is None:
            person = replace(person, crop=pose, error=float(apart[first[i]]))
        if pose is not None and points is not None:
            person = replace(person, points=points[first[i]])
        result.append(replace(person, opinions={**person.opinions, number: pose}))
    return result


def _expected_in_space(people: Sequence[FollowedPerson], in_space: np.ndarray, constants: FollowingConstants
                       ) -> List[FollowedPerson]:
    """Return the people at the place of the nearest of (P, K, 3) people in space, unless another one is nearer to it.

    Tracks in space know how each joint moves, and where a hidden person walks on to.
    """
    if not people or not len(in_space):
        return list(people)
    apart = disagreement(in_space, np.stack([person.expected for person in people])[:, None])
    result = []
    for person, distances, nearest in zip(people, apart, apart.argmin(axis=1)):
        allowed = constants.same_in_space + constants.agreement_growth * person.unseen
        if distances[nearest] <= min(apart[:, nearest].min(), allowed):
            there = np.isfinite(in_space[nearest, :, 0])
            expected = person.expected.copy()
            expected[there, :2] = in_space[nearest, there, :2]
            expected[there, 2] = np.maximum(expected[there, 2], constants.least_score)
            person = replace(person, expected=expected)
        result.append(person)
    return result


def disagreement(poses: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return the median distances of the joints that poses and expected poses share, as shares of the people's sizes.

    Args:
        poses, expected: (..., K, 3) [px]; their leading axes are broadcast against each other.

    Returns:
        (...,) float64; infinite without such joints.
    """
    distances = np.linalg.norm(poses[..., :2] - expected[..., :2], axis=-1)
    return medians(distances, np.isfinite(distances)) / person_sizes(expected[..., :2])


def without_shared_crops(people: Sequence[FollowedPerson], recipe: Recipe,
                         constants: EnsembleConstants = ENSEMBLE) -> List[FollowedPerson]:
    """Return the people; of two whose crops show one person, the one farther from its expected place has no crop."""
    result, missing = list(people), np.full((len(recipe.skeleton.joints), 3), np.nan, np.float32)
    crops = np.array([missing if person.crop is None else person.crop for person in people]).reshape(-1, *missing.shape)
    alike = similarity(crops[:, None], crops, recipe.sources.sigmas) >= constants.duplicate
    for i, j in np.argwhere(np.tril(alike, -1)):
        if result[i].crop is not None and result[j].crop is not None:
            loser = max((i, j), key=lambda one: (result[one].memory is None, result[one].error))
            result[loser] = result[loser].without_crop(recipe)
    return result

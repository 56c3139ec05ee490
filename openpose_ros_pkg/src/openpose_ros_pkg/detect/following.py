"""A person in an image: where it is expected, what the networks say of it, and the vote on that."""
import math
from dataclasses import dataclass, field, replace
from typing import List, Mapping, NamedTuple, Optional, Sequence

import numpy as np

from openpose_ros_pkg.detect.occlusion_masks import COVER, Foreground, doubted, without_twins
from openpose_ros_pkg.detect.recipes import DetectorParams, Recipe
from openpose_ros_pkg.detect.tracking import person_sizes
from openpose_ros_pkg.ensemble import (
    ENSEMBLE,
    EnsembleConstants,
    extent,
    mean_scores,
    medians,
    most_alike,
    person_scores,
    similarity,
    stacked,
    vote_with_crops,
)
from openpose_ros_pkg.landmarks.feet import SeenFeet
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import Poses, no_points


@dataclass(frozen=True)
class FollowingParams(Parameters):
    """When a frame is published: before the whole image is searched, or after it."""

    following: str = parameter(
        'auto', 'Publish a frame once the expected people were looked at, and search the rest of the image after it, '
                'as far as the time goes; auto: where target_rate is set and mode is not accurate; never: search every '
                'image in full first.', choices=('auto', 'always', 'never'))
    follow_requests: bool = parameter(
        True, 'Do so also in images that clients send one by one, by the frame_id and stamp of their headers; false: '
              'search each of these in full first.')

    def wanted(self, detector: DetectorParams) -> bool:
        """Return whether frames are published before the search, with a detector of these parameters."""
        if self.following == 'auto':
            return detector.target_rate > 0 and detector.mode != 'accurate'
        return self.following == 'always'


NEVER_FOLLOWED = FollowingParams(following='never')


@dataclass(frozen=True)
class FollowingConstants:
    """How people are found on crops, and how long opinions count."""

    agreement: float = constant(
        0.35, 'Greatest median distance of the joints from where they are expected, as a share of the size of the '
              'person (half the diagonal of the box of the joints).')
    spreads: float = constant(2.0, 'It is greater by this times the standard deviation of the expected place.')
    elsewhere_score: float = constant(
        0.4, 'Mean score of a pose on a crop, farther away than that, which is a person too: the tracker decides who.')
    fading: float = constant(0.25, 'Time in which the weight of an opinion fades to 1/e.', unit='s')
    least_weight: float = constant(0.1, 'Opinions whose weight faded to less are forgotten: joints that a search '
                                        'alone knows end.')


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
    """What is remembered of a person between images."""

    scores: np.ndarray  # (K,) of the joints at the last detection
    opinions: Mapping[int, Opinion]  # the last one of each source, by its number
    looked: float  # stamp of the last crop, in which the person may not have been found [s]
    feet: Optional[SeenFeet] = None  # when a network looked at them last; None: never


@dataclass(frozen=True, eq=False)
class Person:
    """A person in an image: expected, or new."""

    expected: np.ndarray  # (K, 3) x, y [px], score: where it is expected, or where the search found it
    number: int = -1  # id of the track that expects it; -1: new
    memory: Optional[PersonMemory] = None  # None: never seen before
    spread: float = 0.0  # standard deviation of its place, see `ExpectedPeople`
    existence: float = 1.0  # probability that it is there
    visibility: float = 1.0  # share of the body that the camera would see
    crop: Optional[np.ndarray] = None  # (K, 3) pose on a crop; None: none
    points: Optional[np.ndarray] = None  # (133, 3) all points on a crop, see `Poses`; None: none
    error: float = 0.0  # distance of that pose from the expected one, see `disagreement`; 0 without a crop
    front: Optional[Foreground] = None  # people before it; None: no person, or not known
    # of this image, by the number of the source; None: the source did not find the person
    opinions: Mapping[int, Optional[np.ndarray]] = field(default_factory=dict)
    looked: bool = False  # whether it got a crop in this image
    elsewhere: bool = False  # whether the crop shows a person farther from the expected place than it may be
    feet: Optional[SeenFeet] = None  # as a network saw them last, in this image or before; None: never
    by_depth: float = 0.0  # score of a person who was found by its head in the depth, and takes no vote; 0: others
    constants: FollowingConstants = FOLLOWING

    @property
    def box(self) -> np.ndarray:
        """Least, and greatest x and y of the detected or expected joints, (2, 2) [px]."""
        pose = self.expected if self.crop is None else self.crop
        sure = pose[pose[:, 2] >= COVER.sure_joint]
        return np.stack(extent(sure if len(sure) > 1 else pose))

    @property
    def found(self) -> bool:
        """Whether a source found the person in this image."""
        return any(pose is not None for pose in self.opinions.values())

    @property
    def scores(self) -> np.ndarray:
        """(K,) scores of the joints at the last detection; as expected of people who were never seen before."""
        return self.expected[:, 2] if self.memory is None else self.memory.scores

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
        constants = self.constants
        return constants.agreement + constants.spreads * self.spread

    def since_look(self, stamp: float) -> float:
        """Return the time since the last crop [s]; infinite before the first one."""
        return np.inf if self.memory is None else max(stamp - self.memory.looked, 0.0)

    def without_crop(self, recipe: Recipe) -> 'Person':
        """Return the person where the crops show another one."""
        missed = dict.fromkeys(range(recipe.pass_opinions, len(recipe.weights)))
        return replace(self, crop=None, points=None, error=0.0, elsewhere=False, opinions={**self.opinions, **missed})

    def remembered(self, scores: np.ndarray, stamp: float) -> PersonMemory:
        """Return the memory after an image in which the joints got (K,) scores, or in which it was only looked at."""
        opinions = {number: Opinion(pose, self.reference, stamp) for number, pose in self.opinions.items()}
        if self.memory is None:  # how the person moves is not known yet
            return PersonMemory(scores, opinions, stamp, self.feet)
        opinions = {**self.memory.opinions, **opinions}
        return PersonMemory(scores, opinions, stamp if self.looked else self.memory.looked,
                            self.feet or self.memory.feet)


def voted(people: Sequence[Person], recipe: Recipe, stamp: float) -> Poses:
    """Return people by all opinions on them; earlier ones move with the person and fade.

    Sources that did not find a person count until they look again, those that never looked do not. Joints that a search
    places on a nearer person are doubted, unless no crop shows the person: then there is no other source.
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
    behind = [(i, person.front) for i, person in enumerate(people) if person.front is not None]
    for i, front in behind:
        if people[i].crop is not None:
            poses[i, :recipe.pass_opinions] = doubted(poses[i, :recipe.pass_opinions], front)
    keypoints = vote_with_crops(poses, replace(sources, weights=sources.weights * shares,
                                               place_weights=sources.place_weights * shares))
    for i, _ in behind:
        keypoints[i] = without_twins(keypoints[i], recipe.skeleton)
    scores = person_scores(keypoints, (shares > 0) @ sources.known)
    for i, person in enumerate(people):
        if person.by_depth > 0:
            keypoints[i], scores[i] = person.crop, person.by_depth
    return Poses(keypoints, scores, _points(people) if recipe.whole_body else None)


def _points(people: Sequence[Person]) -> np.ndarray:
    """Return all points of people on crops of this image, (P, 133, 3)."""
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


def with_crop(person: Person, number: int, found: Poses, known: np.ndarray, others: np.ndarray, recipe: Recipe
              ) -> Person:
    """Return a person after a source saw a crop of it, with the pose there that is the person.

    A person who was seen before has to be near where it is expected, or surely to be seen elsewhere and to be none of
    the others; a new one has to be where the search found it.

    Args:
        found: the people on the crop.
        known: (K,) bool, the joints that the source can tell of.
        others: (P, K, 3) where people are expected.
    """
    poses, joint_sigmas, constants = found.keypoints, recipe.sources.sigmas, person.constants
    if person.memory is None:
        pose = most_alike(poses, person.expected, others, joint_sigmas)
        return _with_pose(person, number, pose, found, 0.0, False)
    apart, sure = disagreement(poses, person.expected), mean_scores(poses, known)
    near = (sure >= COVER.sure_joint) & (apart <= person.agreed)
    pose = most_alike(poses[near], person.expected, others, joint_sigmas, least=0.0)
    if pose is not None:
        return _with_pose(person, number, pose, found, float(disagreement(pose, person.expected)), person.elsewhere)
    away = np.flatnonzero((sure >= constants.elsewhere_score) & (apart > person.agreed))
    alone = [i for i in away if (similarity(poses[i], others, joint_sigmas) < ENSEMBLE.same_person).all()]
    if not alone:
        return _with_pose(person, number, None, found, 0.0, person.elsewhere)
    pose = poses[alone[0]]
    return _with_pose(replace(person, expected=pose), number, pose, found, float(apart[alone[0]]), True)


def _with_pose(person: Person, number: int, pose: Optional[np.ndarray], found: Poses, error: float, elsewhere: bool
               ) -> Person:
    """Return a person with the pose of a source on a crop; None: the source did not find it."""
    person = replace(person, opinions={**person.opinions, number: pose}, looked=True, elsewhere=elsewhere)
    if pose is None:
        return person
    person = person if person.crop is not None else replace(person, crop=pose, error=error)
    return person if found.points is None else replace(person, points=found.points[0])  # such a network sees one person


def disagreement(poses: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return the median distances of the joints that poses and expected poses share, as shares of the people's sizes.

    Args:
        poses, expected: (..., K, 3) [px]; their leading axes are broadcast against each other.

    Returns:
        (...,) float64; infinite without such joints.
    """
    distances = np.linalg.norm(poses[..., :2] - expected[..., :2], axis=-1)
    return medians(distances, np.isfinite(distances)) / person_sizes(expected[..., :2])


def without_shared_crops(people: Sequence[Person], recipe: Recipe, constants: EnsembleConstants = ENSEMBLE
                         ) -> List[Person]:
    """Return the people; of two whose crops show one person, the one farther from its expected place has no crop."""
    result, missing = list(people), np.full((len(recipe.skeleton.joints), 3), np.nan, np.float32)
    crops = np.array([missing if person.crop is None else person.crop for person in people]).reshape(-1, *missing.shape)
    alike = similarity(crops[:, None], crops, recipe.sources.sigmas) >= constants.duplicate
    for i, j in np.argwhere(np.tril(alike, -1)):
        if result[i].crop is not None and result[j].crop is not None:
            loser = max((i, j), key=lambda one: (result[one].number < 0, result[one].error))
            result[loser] = result[loser].without_crop(recipe)
    return result

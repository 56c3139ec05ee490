"""Follow people instead of searching for them: what is known of them, and what of new opinions on them is believed."""
from dataclasses import dataclass, field, replace
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.detect.ensemble import ENSEMBLE, vote_with_crops
from openpose_ros_pkg.detect.occlusion_masks import Foreground
from openpose_ros_pkg.detect.recipes import DetectorParams, Recipe
from openpose_ros_pkg.detect.tracking import KeypointTracker, PersonIds, TrackingParams, person_sizes
from openpose_ros_pkg.oks import extent, sigmas, similarity
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import SkeletonModel


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


# What does not follow anybody.
NOBODY = FollowingParams(following='never')


@dataclass(frozen=True)
class FollowingConstants:
    """How people are followed on crops of the image."""

    crop_score: float = constant(0.2, 'Mean score of its joints that somebody needs on a crop.')
    agreement: float = constant(
        0.35, 'Greatest median distance of the joints from where they are expected, as a share of the size of the '
              'person (half the diagonal of the box of the joints).')
    agreement_growth: float = constant(1.0, 'That grows by this, while somebody is not seen.', unit='1/s')
    base_error: float = constant(
        0.05, 'Added to that distance where people wait for a crop: who moves unforeseen is looked at sooner.')
    unlooked_time: float = constant(
        0.15, 'Somebody who has to wait for a crop is reported where expected for this long.', unit='s')
    lost_time: float = constant(
        0.6, 'A person who is not seen is looked for on crops for this long. After a longer gap between stamps no '
             'person is expected anywhere, so the image is searched in full.', unit='s')
    same_in_space: float = constant(
        0.5, 'Greatest such distance between where somebody is expected in the image and by a track in space; it grows '
             'in the same way.')
    lost_margin: float = constant(1.3, 'The side of these crops is greater by this factor.')
    sure_joint: float = constant(0.2, 'Joints with a lower score do not count for the box of a person.')
    fading: float = constant(0.25, 'Time in which the weight of an opinion fades to 1/e.', unit='s')
    least_weight: float = constant(0.1, 'Opinions whose weight faded to less are forgotten.')


FOLLOWING = FollowingConstants()
# A joint that was seen at some time, but not lately: there is a place for it.
_LEAST_SCORE = 1e-3


class Opinion(NamedTuple):
    """What a source thought of a person.

    Attributes:
        pose: (K, 3) float32; None: it looked, and did not find the person.
        reference: (K, 2) [px] where the person was taken to be then.
        stamp: [s].
    """

    pose: Optional[np.ndarray]
    reference: np.ndarray
    stamp: float

    def moved(self, reference: np.ndarray) -> Optional[np.ndarray]:
        """Return the pose, each joint moved as the reference moved, (K, 2); None: the source found nobody."""
        if self.pose is None:
            return None
        shift = reference - self.reference
        known = np.isfinite(shift).all(axis=1)
        median = np.median(shift[known], axis=0) if known.any() else np.zeros(2)
        pose = self.pose.copy()
        pose[:, :2] += np.where(known[:, None], shift, median)
        return pose


@dataclass
class Known:
    """What is remembered of somebody.

    Attributes:
        scores: (K,) of the joints when they were seen last.
        seen: stamp [s] of the frame in which they were seen.
        error: how far they were from where they were expected then, see `disagreement`.
        opinions: by the number of the source.
    """

    scores: np.ndarray
    seen: float
    error: float
    opinions: Dict[int, Opinion]


@dataclass(eq=False)
class Followed:
    """A person in a frame: followed, or new.

    Attributes:
        expected: (K, 3) where the person is expected: x, y [px], score; of a new one, where the search found it.
        known: what is remembered; None: new.
        unseen: time since the person was seen [s].
        crop: (K, 3) what a crop shows of the person; None: nothing, or nobody looked.
        opinions: of this frame, by the number of the source; None: it looked, and did not find the person.
        foreground: what is in front of the person; None: nobody, or it is not known.
    """

    expected: np.ndarray
    known: Optional[Known] = None
    unseen: float = 0.0
    crop: Optional[np.ndarray] = None
    opinions: Dict[int, Optional[np.ndarray]] = field(default_factory=dict)
    foreground: Optional[Foreground] = None

    @property
    def box(self) -> np.ndarray:
        """Least, and greatest x and y of the joints where they were seen, or are expected, (2, 2) [px]."""
        pose = self.expected if self.crop is None else self.crop
        sure = pose[pose[:, 2] >= FOLLOWING.sure_joint]
        return np.stack(extent(sure if len(sure) > 1 else pose))

    @property
    def found(self) -> bool:
        """Whether anything was seen of the person in this frame."""
        return any(pose is not None for pose in self.opinions.values())

    @property
    def reported(self) -> bool:
        """Whether the person is one of those of the frame: found, or not looked at for a short time."""
        return self.found or (not self.opinions and self.unseen <= FOLLOWING.unlooked_time)

    @property
    def urgency(self) -> float:
        """How urgently a crop is to be looked at; those who were lost come last."""
        if self.known is None or self.unseen > FOLLOWING.unlooked_time:
            return 0.0
        return self.unseen * (FOLLOWING.base_error + self.known.error)

    @property
    def reference(self) -> np.ndarray:
        """Where the joints are taken to be, (K, 2) [px]: on the crop, or where they are expected."""
        expected = self.expected[:, :2]
        return expected if self.crop is None else np.where(np.isfinite(self.crop[:, :2]), self.crop[:, :2], expected)

    @property
    def shown(self) -> np.ndarray:
        """(K, 3) where the joints are taken to be."""
        return np.concatenate([self.reference, self.expected[:, 2:]], axis=1)

    @property
    def error(self) -> float:
        """How far from where it was expected a crop shows the person, see `disagreement`; 0 without a crop."""
        return 0.0 if self.crop is None else disagreement(self.crop, self.expected)

    def believes(self, pose: np.ndarray) -> bool:
        """Return whether what a crop shows, (K, 3), is the person."""
        if self.known is None:
            return True
        allowed = FOLLOWING.agreement + FOLLOWING.agreement_growth * self.unseen
        return bool(pose[:, 2].mean() >= FOLLOWING.crop_score and disagreement(pose, self.expected) <= allowed)

    def voted(self, recipe: Recipe, stamp: float) -> np.ndarray:
        """Return the (K, 3) keypoints by all opinions, earlier ones moved along with the person and fading.

        Sources that looked and did not find the person count until they look again, those that never looked do not. For
        somebody new all count, as in a full search: who is found by one of them alone has to outvote the others.
        """
        weights, places = list(recipe.weights), list(recipe.place_weights)
        poses: Dict[int, np.ndarray] = {}
        for number in range(len(weights)):
            pose, share = self._told(number, stamp)
            weights[number] *= share
            places[number] *= share
            if pose is not None:
                poses[number] = pose
        return vote_with_crops(poses, recipe, weights, places)

    def _told(self, number: int, stamp: float) -> Tuple[Optional[np.ndarray], float]:
        """Return what a source shows of the person now or showed before, (K, 3), and how much of its weight counts."""
        if number in self.opinions or self.known is None:
            return self.opinions.get(number), 1.0
        earlier = self.known.opinions.get(number)
        if earlier is None:
            return None, 0.0
        if earlier.pose is None:
            return None, 1.0  # who was not found there is no surer before the source looks again
        share = float(np.exp((earlier.stamp - stamp) / FOLLOWING.fading))
        return (earlier.moved(self.reference), share) if share >= FOLLOWING.least_weight else (None, 0.0)

    def remembered(self, keypoints: np.ndarray, stamp: float) -> Known:
        """Return what is to be remembered when the person was reported with (K, 3) keypoints."""
        opinions = {} if self.known is None else dict(self.known.opinions)
        opinions.update({number: Opinion(pose, self.reference, stamp) for number, pose in self.opinions.items()})
        if self.known is not None and not self.found:
            return replace(self.known, opinions=opinions)
        return Known(keypoints[:, 2], stamp, self.error, opinions)


class Follower:
    """Who is followed in the images of a camera; not thread-safe."""

    def __init__(self, tracking: TrackingParams, skeleton: SkeletonModel) -> None:
        self._skeleton = skeleton
        self.tracker = KeypointTracker(tracking)
        self._known: Dict[int, Known] = {}

    @property
    def memory(self) -> float:
        """How long a person who is not seen is expected somewhere [s]."""
        return min(FOLLOWING.lost_time, self.tracker.timeout)

    def forget(self) -> None:
        """Forget what is known of people; their tracks, and so their ids, stay."""
        self._known = {}

    def expected(self, stamp: float, in_space: Optional[People2D], waited: float = 0.0) -> List[Followed]:
        """Return the people who are looked for, where tracks in space tell, if they do.

        Args:
            stamp: [s].
            in_space: who is expected in the image by tracks in space; None: there are none.
            waited: time since the frame before in which no image could be looked at; it makes no person lost [s].
        """
        people = []
        for number, xy in zip(*self.tracker.expected(stamp)):
            known = self._known.get(number)
            if known is not None and stamp - known.seen <= FOLLOWING.lost_time + waited:
                there = np.isfinite(xy).all(axis=1)
                scores = np.where(there, np.maximum(known.scores, _LEAST_SCORE), 0.0)
                pose = np.concatenate([xy, scores[:, None]], axis=1).astype(np.float32)
                people.append(Followed(pose, known, max(stamp - known.seen, 0.0)))
        if in_space is not None:
            _expect_in_space(people, keypoints_in(in_space.keypoints, in_space.skeleton, self._skeleton))
        return people

    def update(self, people: People2D, persons: Sequence[Followed], stamp: float, ids: PersonIds) -> People2D:
        """Return the people of a frame with their ids, and remember what is known of them.

        Args:
            persons: one for each of the people.
            ids: of those who are new.
        """
        people = self.tracker.update(people, stamp, ids)
        for i, person in enumerate(persons):
            self._known[int(people.ids[i])] = person.remembered(people.keypoints[i], stamp)
        followed = set(self.tracker.expected(stamp)[0])
        self._known = {number: known for number, known in self._known.items()
                       if stamp - known.seen <= FOLLOWING.lost_time and number in followed}
        return people


def _expect_in_space(people: Sequence[Followed], in_space: np.ndarray) -> None:
    """Expect people where the nearest of (P, K, 3) people in space will be, unless that is someone else.

    Space knows how each joint moves, and where somebody hidden walks on to.
    """
    if not people or not len(in_space):
        return
    apart = np.array([[disagreement(pose, person.expected) for pose in in_space] for person in people])
    for person, distances, nearest in zip(people, apart, apart.argmin(axis=1)):
        allowed = FOLLOWING.same_in_space + FOLLOWING.agreement_growth * person.unseen
        if distances[nearest] <= min(apart[:, nearest].min(), allowed):
            there = np.isfinite(in_space[nearest, :, 0])
            person.expected[there, :2] = in_space[nearest, there, :2]
            person.expected[there, 2] = np.maximum(person.expected[there, 2], _LEAST_SCORE)


def disagreement(pose: np.ndarray, expected: np.ndarray) -> float:
    """Return the median distance of the joints that both have, (K, 3) each, as a share of the person's size."""
    distances = np.linalg.norm(pose[:, :2] - expected[:, :2], axis=1)
    both = np.isfinite(distances)
    return float(np.median(distances[both]) / person_sizes(expected[None, :, :2])[0]) if both.any() else float('inf')


def refuse_slides(people: Sequence[Followed], recipe: Recipe) -> None:
    """Where crops of two people show one person, the one who is farther from where it was expected loses the crop."""
    joint_sigmas = sigmas(recipe.skeleton)
    for i, one in enumerate(people):
        for other in people[:i]:
            if (one.crop is not None and other.crop is not None
                    and similarity(one.crop, other.crop, joint_sigmas) >= ENSEMBLE.duplicate):
                loser = max(one, other, key=lambda person: (person.known is None, person.error))
                loser.crop = None
                loser.opinions.update(dict.fromkeys(range(recipe.pass_opinions, len(recipe.weights))))

"""Joint assignment: the keypoints of people who touch are shared out among the people who are tracked there.

Networks make one skeleton of two people who touch: the head of one, the legs of the other. Where a track in space
expects a person that they do not report, that person competes with those reported for each of their keypoints.
"""
from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.detect.following import FOLLOWING, disagreement
from openpose_ros_pkg.detect.tracking import person_sizes
from openpose_ros_pkg.ensemble import Opinions
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import ExpectedPeople, keypoints_in
from openpose_ros_pkg.skeletons import SkeletonModel


@dataclass(frozen=True)
class JointAssignmentConstants:
    """Which keypoints change their person."""

    moved: float = constant(
        0.1, 'A keypoint this near to where its own person has the joint stays there, as a share of the size of the '
             'person (half the diagonal of the box of the joints).')


JOINT_ASSIGNMENT = JointAssignmentConstants()


class Tracked(NamedTuple):
    """The T tracked people who are expected in an image."""

    poses: np.ndarray  # (T, K, 3) float32: x, y [px], score
    depths: np.ndarray  # (T,) of their trunks [m]

    @classmethod
    def within(cls, expected: Optional[ExpectedPeople], skeleton: SkeletonModel, image_size: Tuple[int, int]
               ) -> 'Tracked':
        """Return the expected people with most of their joints in an image of (width, height) [px]."""
        if expected is None:
            return cls(np.zeros((0, len(skeleton.joints), 3), np.float32), np.zeros(0))
        poses = keypoints_in(expected.keypoints, expected.skeleton, skeleton)
        half = np.divide(image_size, 2)
        with np.errstate(invalid='ignore'):
            inside = (np.abs(poses[..., :2] + 0.5 - half) <= half).all(axis=2)
        most = 2 * inside.sum(axis=1) > np.isfinite(poses[..., 0]).sum(axis=1)
        return cls(poses[most], expected.depths[most])

    def without_candidate(self, candidates: Sequence[np.ndarray]) -> Tuple[np.ndarray, np.ndarray]:
        """Return the track of each of the candidates, (K, 3) each, -1: none, (P,), and the tracks without one, (M,)."""
        poses = np.array(candidates, np.float32).reshape(-1, *self.poses.shape[1:])
        apart = disagreement(poses[None], self.poses[:, None])
        tracks = np.full(len(candidates), -1, np.int64)
        for track, candidate in match(apart, apart <= FOLLOWING.same_in_space):
            tracks[candidate] = track
        return tracks, np.setdiff1d(np.arange(len(self.poses)), tracks)


class Competition(NamedTuple):
    """Tracked people who compete for keypoints.

    Attributes:
        expected: (T, K, 3) where they are expected.
        sizes: (T,) half the diagonals of the boxes of their joints [px].
        missing: (M,) which of them have no candidate.
    """

    expected: np.ndarray
    sizes: np.ndarray
    missing: np.ndarray

    def winners(self, pose: np.ndarray, own: int, constants: JointAssignmentConstants = JOINT_ASSIGNMENT
                ) -> np.ndarray:
        """Return which of the missing people gets each keypoint of a pose, (K, 3), of a track; -1: it stays, (K,)."""
        apart = np.linalg.norm(pose[None, :, :2] - self.expected[..., :2], axis=2) / self.sizes[:, None]
        apart = np.where(np.isfinite(apart), apart, np.inf)
        of_missing = apart[self.missing]
        lost = (of_missing.min(axis=0) < apart[own]) & (apart[own] > constants.moved)
        return np.where(lost, of_missing.argmin(axis=0), -1)


class Shared(NamedTuple):
    """People after their keypoints were shared out.

    Attributes:
        opinions, poses: of the people who were reported, then of the missing ones; poses (K, 3) are what crops show.
        missing: (M,) tracks of these.
    """

    opinions: List[Opinions]
    poses: List[np.ndarray]
    missing: np.ndarray


def share_out(opinions: Sequence[Opinions], poses: Sequence[np.ndarray], tracked: Tracked) -> Shared:
    """Share the keypoints of reported people out among them and the tracked people who are missing.

    A keypoint goes to a missing person who is expected nearer to it than its own person. A person who
    loses a keypoint gets the expected place of that joint; one who would lose all keeps them.

    Args:
        opinions, poses: of the people who are reported; poses (K, 3).
    """
    tracks, missing = tracked.without_candidate(poses)
    if not len(missing):
        return Shared(list(opinions), list(poses), missing)
    competition = Competition(tracked.poses, person_sizes(tracked.poses[..., :2]), missing)
    given: List[Opinions] = [{} for _ in missing]
    kept, places = list(opinions), list(poses)
    for i in np.flatnonzero(tracks >= 0):
        lost = competition.winners(poses[i], tracks[i]) >= 0
        places[i] = np.where(lost[:, None], tracked.poses[tracks[i]], poses[i])
        own: Opinions = {}
        for number, opinion in opinions[i].items():
            winners = competition.winners(opinion, tracks[i])
            own[number] = _only(opinion, winners < 0)
            for winner in np.unique(winners[winners >= 0]):
                won = winners == winner
                before = given[winner].get(number, _only(opinion, won))
                given[winner][number] = np.where(won[:, None], opinion, before)
        with_keypoints = {number: opinion for number, opinion in own.items() if np.isfinite(opinion[:, 0]).any()}
        kept[i] = with_keypoints or opinions[i]
    return Shared(kept + given, places + list(tracked.poses[missing]), missing)


def _only(pose: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return a pose, (K, 3), with the chosen keypoints alone."""
    return np.where(chosen[:, None], pose, np.array([np.nan, np.nan, 0], pose.dtype))

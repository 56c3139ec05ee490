"""The values that pass through lifting: observed people, what is expected of them, and lifted people."""
import dataclasses
from dataclasses import dataclass
from typing import NamedTuple, Tuple

import numpy as np

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18, WHOLE_BODY_133, SkeletonModel
from skeleton_extract_3d.body.body import BODY, BONES, JOINTS, BodyConstants
from skeleton_extract_3d.constants import METHOD, MethodConstants


@dataclass(frozen=True)
class ObservedPeople:
    """The P people of one frame, with the joints of COCO_18.

    Attributes:
        people_2d: the detections, with the joints of their network.
        image_size: width and height of the image [px].
        grid_xy: (P, K, 2) float64 keypoints of `people_2d` [px of the points' grid], NaN where there is none.
        uv: (P, 18, 2) float64 the same of the joints of COCO_18, where there is a line of sight.
        scores: (P, 18) float64 [0..1], 0 where there is no keypoint.
        known: (P, 18) bool, joints with a keypoint.
        rays: (P, 18, 3) float64 with z = 1; of joints without a keypoint, a guess near the rest of the person.
        samples: (P, 18, 25) float64 depths of the surfaces around the keypoints [m], NaN where missing.
        detached: (P, 18, 25) bool, samples on surfaces before the body, see `lift.detached`.
        adult_depth: (P,) float64 depth at which an adult would look as large as the person [m]; infinite where unknown.
        trunk_evidence: (P, depths) float64 log likelihood of the depths of the trunk by the samples alone.
        error: (P, 18) float64 standard deviation of the keypoints across the view, beyond that of a network's [m].
        unseen: (P, 18) bool, joints that are not measured, whatever surface is there.
        focal: focal length [px], mean of both axes.
    """

    people_2d: People2D
    image_size: Tuple[int, int]
    grid_xy: np.ndarray
    uv: np.ndarray
    scores: np.ndarray
    known: np.ndarray
    rays: np.ndarray
    samples: np.ndarray
    detached: np.ndarray
    adult_depth: np.ndarray
    trunk_evidence: np.ndarray
    error: np.ndarray
    unseen: np.ndarray
    focal: float

    def __len__(self) -> int:
        return len(self.uv)

    def has_measured(self, measured: np.ndarray, least: int) -> np.ndarray:
        """Return who has so many measured joints, of (P, 18) bool, (P,): joints without a surface do not count."""
        measurable = (self.known & np.isfinite(self.samples).any(axis=2)).sum(axis=1)
        return measured.sum(axis=1) >= np.minimum(least, measurable)

    def select(self, indices: np.ndarray) -> 'ObservedPeople':
        """Return some of the people, in the order of their indices (N,)."""
        arrays = {name: value[indices] for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return dataclasses.replace(self, people_2d=self.people_2d.select(indices), **arrays)

    def exchanged(self, people: np.ndarray) -> 'ObservedPeople':
        """Return the people with left and right of some of them, (P,) bool, exchanged."""
        row, of_people = np.arange(len(self))[:, None], _partners(self.people_2d.skeleton, people)
        people_2d = dataclasses.replace(self.people_2d, keypoints=self.people_2d.keypoints[row, of_people])
        if people_2d.points is not None:
            people_2d = dataclasses.replace(people_2d, points=people_2d.points[row, _partners(WHOLE_BODY_133, people)])
        own = _partners(COCO_18, people)
        by_joint = {name: getattr(self, name)[row, own]
                    for name in ('uv', 'scores', 'known', 'rays', 'samples', 'detached', 'error', 'unseen')}
        return dataclasses.replace(self, people_2d=people_2d, grid_xy=self.grid_xy[row, of_people], **by_joint)


def _partners(skeleton: SkeletonModel, people: np.ndarray) -> np.ndarray:
    """Return the joint that takes the place of each joint where left and right of people (P,) are exchanged, (P, K)."""
    return np.where(people[:, None], skeleton.swap, np.arange(len(skeleton.joints)))


class Expectation(NamedTuple):
    """What is known of P people before the frame.

    Attributes:
        root: (P,) depth of the trunk [m], NaN where unknown.
        depth: (P, 18) of the joints [m], NaN where unknown; depth_sigma: (P, 18) [m].
        left: (P, 3) to the left in the frame before, as long as its weight; NaN where unknown.
        stature: (P,) [m]; stature_spread: (P,) as a share.
        lengths: (P, 8) of the bones [m]; length_spread: (P, 8) as a share; in the order of `body.BONES`.
    """

    root: np.ndarray
    depth: np.ndarray
    depth_sigma: np.ndarray
    left: np.ndarray
    stature: np.ndarray
    stature_spread: np.ndarray
    lengths: np.ndarray
    length_spread: np.ndarray

    @classmethod
    def of_strangers(cls, people: int, body: BodyConstants = BODY) -> 'Expectation':
        """Return the expectation of P people without a track: the sizes of adults."""
        joints = len(JOINTS)
        return cls(np.full(people, np.nan), np.full((people, joints), np.nan), np.ones((people, joints)),
                   np.full((people, 3), np.nan), np.full(people, body.adult_stature),
                   np.full(people, body.stature_spread), np.repeat(body.bone_lengths[None], people, axis=0),
                   np.full((people, len(BONES)), body.proportion_spread))

    def with_sizes(self, observed: ObservedPeople, root: np.ndarray, sure: np.ndarray,
                   method: MethodConstants = METHOD) -> 'Expectation':
        """Return it with statures of people without a track by their size in the image, where depths [m] are sure."""
        body = method.body
        known = sure & (self.stature_spread >= body.stature_spread) & np.isfinite(observed.adult_depth)
        if not known.any():
            return self
        ratio = np.log(np.where(known, root / observed.adult_depth, 1.0))
        # mean of the stature of adults and that in the image, weighted by their precisions
        prior, precision = self.stature_spread ** -2, method.sizes.known ** -2
        stature = body.adult_stature * np.exp(ratio * precision / (prior + precision))
        least, most = body.stature_limits
        scale = np.where(known, np.minimum(np.maximum(stature, least), most) / self.stature, 1.0)
        return self._replace(stature=self.stature * scale, lengths=self.lengths * scale[:, None])


class Lifted(NamedTuple):
    """P people in space, by one frame.

    Attributes:
        xyz: (P, 18, 3) [m]; where there is no keypoint, a guess.
        measured: (P, 18) bool: seen, on the person's own surface.
        plausible: (P, 18) bool: the bones that end there have possible lengths.
        sigma: (P, 18) standard deviation along the ray [m].
        left: (P, 3) unit vectors.
        root: (P,) depth of the trunk [m].
        stature: (P,) by which the bones were scaled [m].
        distance_error: (P,) standard deviation of the distance of all joints together by the size of the person, of
            people without a measured joint [m].
        sized: (P,) bool: the floor tells the stature.
        candidates: (P, 13, 45) float32 min-marginals (-2 log likelihood) of the depths `root + CostConstants.deltas` of
            the thirteen places: `body.CHAINS`, and the middle of the ears.
    """

    xyz: np.ndarray
    measured: np.ndarray
    plausible: np.ndarray
    sigma: np.ndarray
    left: np.ndarray
    root: np.ndarray
    stature: np.ndarray
    distance_error: np.ndarray
    sized: np.ndarray
    candidates: np.ndarray

    def select(self, indices: np.ndarray) -> 'Lifted':
        """Return some of the people, in the order of their indices (N,)."""
        return Lifted(*(value[indices] for value in self))

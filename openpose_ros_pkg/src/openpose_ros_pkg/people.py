"""People in an image: the one type that passes between detector, tracker, painter and converters."""
import functools
from dataclasses import dataclass, replace
from typing import Any, List, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import SkeletonModel

# Ids of people count from here, as 0 is the scene where points are labelled with the person's id.
FIRST_ID = 1
# Points of COCO-WholeBody: body, feet, face and hands.
WHOLE_BODY_POINTS = 133

# Joints that are the middle of two others, where a network does not find them itself.
_MIDDLES = {'neck': ('left_shoulder', 'right_shoulder'), 'mid_hip': ('left_hip', 'right_hip')}


def keypoints_in(keypoints: np.ndarray, source: SkeletonModel, target: SkeletonModel) -> np.ndarray:
    """Return (P, K, 3) keypoints, x, y, score, of one joint set in another, (P, L, 3), by the joints' names.

    Joints that the source does not have are missing (NaN, NaN, 0), but for neck and mid_hip: the middle of shoulders or
    hips, with the lower of their scores.
    """
    if source == target:
        return keypoints.copy()
    result = values_in(keypoints, source, target, (np.nan, np.nan, 0))
    for i, ends in _common_joints(source, target)[1]:
        pair = keypoints[:, ends]
        result[:, i, :2] = pair[..., :2].mean(axis=1)
        result[:, i, 2] = pair[..., 2].min(axis=1)
    return result


@functools.lru_cache(maxsize=64)
def _common_joints(source: SkeletonModel, target: SkeletonModel
                   ) -> Tuple[Tuple[List[int], List[int]], List[Tuple[int, List[int]]]]:
    """Return the joints of a target that the source has, and where; and those between two joints of it, and these."""
    common = [(i, source.index[joint]) for i, joint in enumerate(target.joints) if joint in source.index]
    middles = [(i, [source.index[end] for end in _MIDDLES[joint]]) for i, joint in enumerate(target.joints)
               if joint not in source.index and joint in _MIDDLES and source.index.keys() >= {*_MIDDLES[joint]}]
    return ([i for i, _ in common], [i for _, i in common]), middles


def values_in(values: np.ndarray, source: SkeletonModel, target: SkeletonModel, missing: Any) -> np.ndarray:
    """Return values (P, K, ...) of the joints of one joint set in another, (P, L, ...); `missing` where it has none."""
    if source == target:
        return values
    result = np.full((len(values), len(target.joints), *values.shape[2:]), missing, values.dtype)
    (rows, columns), _ = _common_joints(source, target)
    result[:, rows] = values[:, columns]
    return result


class Poses(NamedTuple):
    """People as a decoder gives them."""

    keypoints: np.ndarray  # (P, K, 3) float32: x, y [px], score; NaN, NaN, 0 where missing
    scores: np.ndarray  # (P,) float32 [0..1]
    # (P, 133, 3) float32: all points of COCO-WholeBody, x, y [px], score; NaN, NaN, 0 of people without; None: of none
    points: Optional[np.ndarray] = None


def no_points(people: int) -> np.ndarray:
    """Return missing points of COCO-WholeBody, (P, 133, 3)."""
    return np.full((people, WHOLE_BODY_POINTS, 3), (np.nan, np.nan, 0), np.float32)


def distinct_ids(ids: np.ndarray) -> np.ndarray:
    """Return the ids (P,) of the people of a frame; where one is there twice, the numbers of their rows from 1 on."""
    return ids if len(np.unique(ids)) == len(ids) else np.arange(FIRST_ID, FIRST_ID + len(ids))


def checked_existence(existence: Optional[np.ndarray], people: int) -> np.ndarray:
    """Return the probabilities (P,) float64 that P people are there; None: 1.

    Raises:
        ValueError: the shape is another one, or a value is not within 0 and 1.
    """
    if existence is None:
        return np.ones(people)
    values: np.ndarray = np.asarray(existence, np.float64)
    if values.shape != (people,):
        raise ValueError(f'existence: expected ({people},), got {values.shape}')
    if not ((values >= 0) & (values <= 1)).all():
        raise ValueError(f'existence: expected probabilities from 0 to 1, got {values.tolist()}')
    return values


@dataclass(frozen=True)
class People2D:
    """The keypoints of P people; ValueError: an array has the wrong shape, or a joint is half missing."""

    skeleton: SkeletonModel  # names of the K joints
    # (P, K, 3) float32: x, y [px of the source image, an integer is a pixel's centre] and score [0..1]; a missing joint
    # has x = y = NaN and score 0
    keypoints: np.ndarray
    scores: np.ndarray  # (P,) float32, how sure the detector is of each person [0..1]
    ids: np.ndarray  # (P,) int64 track ids; negative where no tracker has named the person
    # (P,) bool, whether a network saw the person in this image; False: extrapolated; None: all were seen
    looked: np.ndarray = None  # type: ignore[assignment]
    # (P, 133, 3) float32: all points of COCO-WholeBody where a network for whole bodies saw the person, NaN, NaN, 0
    # elsewhere; None: there is no such network
    points: Optional[np.ndarray] = None
    # (P,) float64, the probability that each person is there [0..1]; None: 1
    existence: np.ndarray = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        joints = len(self.skeleton.joints)
        keypoints = np.asarray(self.keypoints, np.float32)
        if keypoints.ndim != 3 or keypoints.shape[1:] != (joints, 3):
            raise ValueError(f'keypoints of {self.skeleton.name}: expected (P, {joints}, 3), got {keypoints.shape}')
        people = (len(keypoints),)
        object.__setattr__(self, 'keypoints', keypoints)
        if self.looked is None:
            object.__setattr__(self, 'looked', np.ones(people, bool))
        for name, dtype, shape in (('scores', np.float32, people), ('ids', np.int64, people), ('looked', bool, people),
                                   ('points', np.float32, (*people, WHOLE_BODY_POINTS, 3))):
            if getattr(self, name) is not None:
                value: np.ndarray = np.asarray(getattr(self, name), dtype)
                if value.shape != shape:
                    raise ValueError(f'{name}: expected {shape}, got {value.shape}')
                object.__setattr__(self, name, value)
        object.__setattr__(self, 'existence', checked_existence(self.existence, len(keypoints)))
        if not np.array_equal(np.isfinite(keypoints[..., :2]).all(axis=2), keypoints[..., 2] > 0):
            raise ValueError('a joint needs finite x, y and a positive score, or NaN x, y and score 0')

    @classmethod
    def empty(cls, skeleton: SkeletonModel) -> 'People2D':
        """Return no people."""
        return cls(skeleton, np.zeros((0, len(skeleton.joints), 3), np.float32), np.zeros(0), np.zeros(0))

    def __len__(self) -> int:
        return len(self.keypoints)

    def select(self, indices: np.ndarray) -> 'People2D':
        """Return some of the people, in the order of their indices (N,)."""
        chosen: Any = {name: None if getattr(self, name) is None else getattr(self, name)[indices]
                       for name in ('keypoints', 'scores', 'ids', 'looked', 'points', 'existence')}
        return replace(self, **chosen)

    def joined(self, others: 'People2D') -> 'People2D':
        """Return these people and then others, with the same joints."""
        joined = {name: np.concatenate([getattr(self, name), getattr(others, name)])
                  for name in ('keypoints', 'scores', 'ids', 'looked', 'existence')}
        if self.points is not None or others.points is not None:
            joined['points'] = np.concatenate([no_points(len(each)) if each.points is None else each.points
                                               for each in (self, others)])
        return replace(self, **joined)

    @property
    def xy(self) -> np.ndarray:
        """(P, K, 2) float32 [px], NaN where missing."""
        return self.keypoints[..., :2]

    @property
    def confidence(self) -> np.ndarray:
        """(P, K) float32 [0..1], 0 where missing."""
        return self.keypoints[..., 2]

    @property
    def present(self) -> np.ndarray:
        """(P, K) bool: which joints were detected."""
        return self.keypoints[..., 2] > 0


@dataclass(frozen=True, eq=False)
class ExpectedPeople:
    """The T people that tracks expect in an image."""

    skeleton: SkeletonModel  # names of the K joints
    # (T, K, 3) float32: x, y [px of the image, also outside of it] and a score above 0; NaN, NaN, 0 where unknown
    keypoints: np.ndarray
    ids: np.ndarray  # (T,) int64 of the tracks
    existence: np.ndarray  # (T,) float64 probability that each is there [0..1]
    visibility: np.ndarray  # (T,) float64 share of the body that the camera would see [0..1]
    # (T,) float64 standard deviation of the place across the view, as a share of half the diagonal of the joints' box
    spread: np.ndarray

    @classmethod
    def none(cls, skeleton: SkeletonModel) -> 'ExpectedPeople':
        """Return no expected people."""
        nothing = np.zeros(0)
        return cls(skeleton, np.zeros((0, len(skeleton.joints), 3), np.float32), np.zeros(0, np.int64), nothing,
                   nothing, nothing)

    def __len__(self) -> int:
        return len(self.ids)

"""OpenPose's rows of numbers per joint, and people in another joint set."""
from dataclasses import replace
from typing import Optional

import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.people import People2D, keypoints_in
from openpose_ros_pkg.skeletons import SKELETONS, SkeletonModel


def in_joint_set(people: People2D, skeleton: SkeletonModel) -> People2D:
    """Return the people with the joints of another joint set; see `people.keypoints_in`."""
    return replace(people, skeleton=skeleton, keypoints=keypoints_in(people.keypoints, people.skeleton, skeleton))


def to_rows(people: People2D) -> np.ndarray:
    """Return (P, K, 3) float32 x, y, score as OpenPose writes it: missing joints are 0, 0, 0."""
    return np.where(people.present[..., None], people.keypoints, np.float32(0))


def from_rows(rows: np.ndarray, ids: np.ndarray, skeleton: Optional[SkeletonModel], place: str) -> People2D:
    """Return the people of OpenPose's numbers.

    Args:
        rows: (P, K, 3) float32 x, y, score; a joint with score 0 is missing.
        ids: (P,) int64, -1 for none.
        skeleton: joint set; None: the one with as many joints.
        place: file that the numbers are from, for the error.

    Returns:
        People whose score is the mean of their joints' scores, as OpenPose's files hold none.

    Raises:
        BadInputError: the number of joints fits no joint set, or not the named one; or there is no person and no named
            joint set.
    """
    if skeleton is None:
        skeleton = _skeleton_with(rows.shape[1] if len(rows) else 0, place)
    joints = len(skeleton.joints)
    if len(rows) == 0:
        return People2D.empty(skeleton)
    if rows.shape[1:] != (joints, 3):
        raise BadInputError(f'{place}: expected {joints} joints x, y, score of {skeleton.name}, got {rows.shape[1:]}')
    present = np.isfinite(rows).all(axis=2) & (rows[..., 2] > 0)
    keypoints = np.where(present[..., None], rows, np.array([np.nan, np.nan, 0], np.float32)).astype(np.float32)
    scores = keypoints[..., 2].sum(axis=1) / np.maximum(present.sum(axis=1), 1)
    return People2D(skeleton, keypoints, scores, ids)


def _skeleton_with(joints: int, place: str) -> SkeletonModel:
    if joints == 0:
        raise BadInputError(f'{place} has no person, so its joint set is unknown: name one ({", ".join(SKELETONS)})')
    for skeleton in SKELETONS.values():
        if len(skeleton.joints) == joints:
            return skeleton
    known = ', '.join(f'{name}: {len(skeleton.joints)}' for name, skeleton in SKELETONS.items())
    raise BadInputError(f'{place}: expected the number of joints of a known joint set ({known}), got {joints}')

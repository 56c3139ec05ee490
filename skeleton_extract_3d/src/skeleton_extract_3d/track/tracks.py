"""Everything that is remembered of the people who are followed, as one array per property."""
from typing import Tuple

import numpy as np

from skeleton_extract_3d.body.body import BONES, JOINTS, LIVELINESS, TRUNK
from skeleton_extract_3d.track.joint_filter import JointFilter

# What a new track knows: errors of its joints [m], of its trunk [m], and speeds of both [m/s].
_JOINT_SIGMA, _ROOT_SIGMA, _SPEED = 0.3, 0.1, 1.0
# Upper and lower part of the clothes.
CLOTHES = 2


class Tracks:
    """T people.

    Attributes:
        joints: filters of the 18 joints of COCO_18; root: of the middle of the trunk.
        ids: (T,) never used again.
        born, last_seen: (T,) stamps [s]; sightings: (T,) frames in which they were detected.
        has: (T, 18) joints that were ever placed; seen: (T, 18) stamp of when they were last detected [s].
        left, down: (T, 3) unit vectors of the trunk.
        stature: (T,) [m]; stature_weight: (T,) frames it was measured in.
        bones, bone_weights: (T, 8) measured lengths [m] and in how many frames, in the order of `body.BONES`.
        clothes, clothes_weight: (T, 2, 3) mean colours (CIELAB) and (T, 2) frames.
    """

    _FIELDS = ('ids', 'born', 'last_seen', 'sightings', 'has', 'seen', 'left', 'down', 'stature', 'stature_weight',
               'bones', 'bone_weights', 'clothes', 'clothes_weight')

    def __init__(self) -> None:
        joints = len(JOINTS)
        self.joints, self.root = JointFilter(joints), JointFilter(1)
        self.ids = np.zeros(0, np.int64)
        self.born, self.last_seen, self.sightings = np.zeros(0), np.zeros(0), np.zeros(0, np.int64)
        self.has, self.seen = np.zeros((0, joints), bool), np.zeros((0, joints))
        self.left, self.down = np.zeros((0, 3)), np.zeros((0, 3))
        self.stature, self.stature_weight = np.zeros(0), np.zeros(0)
        self.bones, self.bone_weights = np.zeros((0, len(BONES))), np.zeros((0, len(BONES)))
        self.clothes, self.clothes_weight = np.zeros((0, CLOTHES, 3)), np.zeros((0, CLOTHES))

    def __len__(self) -> int:
        return len(self.ids)

    def keep(self, tracks: np.ndarray) -> None:
        """Forget all tracks but those of a mask."""
        if tracks.all():
            return
        self.joints.keep(tracks)
        self.root.keep(tracks)
        for name in self._FIELDS:
            setattr(self, name, getattr(self, name)[tracks])

    def append(self, ids: np.ndarray, stamp: float, xyz: np.ndarray, known: np.ndarray, left: np.ndarray,
               stature: np.ndarray) -> None:
        """Begin N tracks.

        Args:
            ids: (N,).
            stamp: [s].
            xyz: (N, 18, 3) [m]; known: (N, 18) which of them are; at least one of each person.
            left: (N, 3); stature: (N,) [m].
        """
        count = len(ids)
        self.joints.append(np.where(known[..., None], xyz, 0.0), _JOINT_SIGMA, _SPEED)
        self.root.append(middle_of_trunk(xyz, known)[:, None], _ROOT_SIGMA, _SPEED)
        stamps = np.full(count, stamp)
        new = {
            'ids': ids, 'born': stamps, 'last_seen': stamps, 'sightings': np.zeros(count, np.int64),
            'has': np.zeros(known.shape, bool), 'seen': np.full(known.shape, stamp), 'left': left,
            'down': np.broadcast_to([0.0, 1.0, 0.0], (count, 3)), 'stature': stature,
            'stature_weight': np.zeros(count), 'bones': np.zeros((count, len(BONES))),
            'bone_weights': np.zeros((count, len(BONES))), 'clothes': np.zeros((count, CLOTHES, 3)),
            'clothes_weight': np.zeros((count, CLOTHES))}
        for name in self._FIELDS:
            setattr(self, name, np.concatenate([getattr(self, name), new[name]]))

    def predict(self, elapsed: float, acceleration: float, walking_acceleration: float) -> None:
        """Move everybody on by a time [s]; accelerations of the trunk's joints and of people as a whole [m/s^2]."""
        if len(self) and elapsed > 0:
            self.joints.predict(elapsed, acceleration * LIVELINESS)
            self.root.predict(elapsed, np.array([walking_acceleration]))

    def transform(self, rotation: np.ndarray, translation: np.ndarray) -> None:
        """Express all in another frame: x' = R x + t."""
        self.joints.transform(rotation, translation)
        self.root.transform(rotation, translation)
        self.left, self.down = self.left @ rotation.T, self.down @ rotation.T


def middle_of_trunk(xyz: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the mean of the known joints of the trunk, or of all where there are none, (N, 3) [m]."""
    trunk = known[:, TRUNK]
    chosen = known.copy()
    chosen[trunk.any(axis=1)] = False
    chosen[:, TRUNK] |= trunk
    count = np.maximum(chosen.sum(axis=1), 1)[:, None]
    return np.where(chosen[..., None], xyz, 0.0).sum(axis=1) / count


def frame_change(before: Tuple[np.ndarray, np.ndarray], now: Tuple[np.ndarray, np.ndarray]
                 ) -> Tuple[np.ndarray, np.ndarray]:
    """Return rotation and translation from where a camera was to where it is.

    Args:
        before, now: rotation (3, 3) and translation (3,) from the camera to a frame that stands still.
    """
    rotation = now[0].T @ before[0]
    return rotation, now[0].T @ (before[1] - now[1])

"""The body model: lengths of bones, depth of joints under the skin, directions of limbs, the shape of the head.

All of it is for an adult of `BodyConstants.adult_stature` and scales with the stature. Joints are those of COCO_18; a
network's other joints are in `extra_joints`.
"""
import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Tuple

import numpy as np

from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.skeletons import COCO_18

JOINTS = COCO_18.joints
_INDEX = COCO_18.index


def joint_indices(*names: str) -> np.ndarray:
    """Return the channels in COCO_18 of joints."""
    return np.array([_INDEX[name] for name in names])


NECK = _INDEX['neck']
SHOULDERS, HIPS = joint_indices('left_shoulder', 'right_shoulder'), joint_indices('left_hip', 'right_hip')
TRUNK = joint_indices('neck', 'left_shoulder', 'right_shoulder', 'left_hip', 'right_hip')
HEAD = joint_indices('nose', 'right_eye', 'left_eye', 'right_ear', 'left_ear')

# The four chains from the trunk outwards: left and right arm, left and right leg.
ROOTS = joint_indices('left_shoulder', 'right_shoulder', 'left_hip', 'right_hip')
MIDDLES = joint_indices('left_elbow', 'right_elbow', 'left_knee', 'right_knee')
ENDS = joint_indices('left_wrist', 'right_wrist', 'left_ankle', 'right_ankle')
# Twelve of the thirteen places of a person whose depths are inferred together; the last one is the middle of the ears.
CHAINS = np.concatenate([ROOTS, MIDDLES, ENDS])
# The same joint of the other side.
SWAP = np.array(COCO_18.swap)
# +1 on the left, -1 on the right side of the body.
SIDES = np.array([1, -1, 1, -1])

# Kinds of bones, left and right alike: the order of `Sizes.bones` and `BodyConstants.bone_lengths`.
BONES = ('shoulders', 'hips', 'trunk', 'head', 'upper_arm', 'forearm', 'thigh', 'shin')


def bone_kinds(*names: str) -> np.ndarray:
    """Return the places of kinds of bones in `BONES`."""
    return np.array([BONES.index(name) for name in names])


# Kinds of the upper and the lower bones of the four limbs, and of the two pairs.
UPPER_KINDS = bone_kinds('upper_arm', 'upper_arm', 'thigh', 'thigh')
LOWER_KINDS = bone_kinds('forearm', 'forearm', 'shin', 'shin')
PAIR_KINDS = bone_kinds('shoulders', 'hips')
# Bones that are measured between two joints, (10, 2), and their kinds; the last kind is that of neck to hips, (11,).
MEASURED_BONES = np.concatenate([[SHOULDERS, HIPS], np.stack([ROOTS, MIDDLES], axis=1),
                                 np.stack([MIDDLES, ENDS], axis=1)])
MEASURED_KINDS = np.concatenate([PAIR_KINDS, UPPER_KINDS, LOWER_KINDS, bone_kinds('trunk')])
# Bones in the order in which their lengths are satisfied: start, end, kind, (14, 3). Upper bones come twice.
_UPPER_BONES = np.stack([ROOTS, MIDDLES, UPPER_KINDS], axis=1)
SATISFIED_BONES = np.concatenate([np.stack([[SHOULDERS[0], HIPS[0]], [SHOULDERS[1], HIPS[1]], PAIR_KINDS], axis=1),
                                  _UPPER_BONES, np.stack([MIDDLES, ENDS, LOWER_KINDS], axis=1), _UPPER_BONES])


def of_all_joints(places: np.ndarray) -> np.ndarray:
    """Return values of the joints, (N, 18, ...), by those of the thirteen places, (N, 13, ...)."""
    values = np.empty((len(places), len(JOINTS), *places.shape[2:]))
    values[:, CHAINS], values[:, HEAD] = places[:, :-1], places[:, -1:]
    values[:, NECK] = values[:, SHOULDERS].mean(axis=1)
    return values


ByJoint = Tuple[Tuple[str, float], ...]
BetweenJoints = Tuple[Tuple[str, str, float], ...]


def by_joint(values: ByJoint) -> np.ndarray:
    """Return values that are given without the side for all joints, (18,)."""
    by_name = dict(values)
    return np.array([by_name[name.replace('left_', '').replace('right_', '')] for name in JOINTS])


_RENDERED = 'rendered, dressed bodies with known joints (five people, 1.66 to 1.86 m), rounded'
_LENGTHS = (_RENDERED + '; agrees with Winter, Biomechanics and Motor Control of Human Movement, 2009, fig. 4.1 (COCO '
            'marks joints, so shoulders and hips are closer together)')
_POSES = 'everyday poses (standing, walking, waving, sitting), broad; set by hand'


@dataclass(frozen=True, eq=False)
class BodyConstants:
    """An adult's body."""

    adult_stature: float = constant(1.70, 'Mean stature of adults, women and men together.', unit='m',
                                    source='chosen')
    stature_spread: float = constant(0.12, 'Standard deviation of the stature of a person without measurements.',
                                     unit='share')
    proportion_spread: float = constant(0.08, "Standard deviation of a bone's length, given the stature.",
                                        unit='share')
    stature_limits: Tuple[float, float] = constant(
        (0.8, 2.1), 'A measured stature is clipped to this range, from a small child on.', unit='m', source='chosen')
    shoulder_width: float = constant(0.331, 'Left to right shoulder.', unit='m', source=_LENGTHS)
    hip_width: float = constant(0.187, 'Left to right hip.', unit='m', source=_LENGTHS)
    trunk_length: float = constant(0.500, 'Neck to the middle of the hips.', unit='m', source=_LENGTHS)
    neck_to_head: float = constant(0.201, 'Neck to the middle of the ears.', unit='m', source=_LENGTHS)
    upper_arm: float = constant(0.269, 'Shoulder to elbow.', unit='m', source=_LENGTHS)
    forearm: float = constant(0.241, 'Elbow to wrist.', unit='m', source=_LENGTHS)
    thigh: float = constant(0.394, 'Hip to knee.', unit='m', source=_LENGTHS)
    shin: float = constant(0.400, 'Knee to ankle.', unit='m', source=_LENGTHS)
    under_skin: np.ndarray = constant(
        by_joint((('nose', 0.003), ('eye', 0.010), ('ear', 0.015), ('neck', 0.085), ('shoulder', 0.067),
                  ('elbow', 0.045), ('wrist', 0.028), ('hip', 0.115), ('knee', 0.078), ('ankle', 0.060))),
        'Depth of a joint under the surface at its pixel, along the ray.', unit='m', source=_RENDERED)
    thickness: np.ndarray = constant(
        by_joint((('nose', 0.13), ('eye', 0.13), ('ear', 0.13), ('neck', 0.17), ('shoulder', 0.17), ('elbow', 0.13),
                  ('wrist', 0.11), ('hip', 0.22), ('knee', 0.13), ('ankle', 0.11))),
        'A surface further than this in front of a joint occludes it.', unit='m')
    walking_acceleration: float = constant(
        3.0, 'How quickly people as a whole, who walk on while hidden, change their velocity, per axis.', unit='m/s^2')
    relative_acceleration: ByJoint = constant(
        (('nose', 1.0), ('eye', 1.0), ('ear', 1.0), ('neck', 1.0), ('shoulder', 1.0), ('elbow', 1.5), ('wrist', 2.5),
         ('hip', 1.0), ('knee', 1.5), ('ankle', 2.0)),
        "Acceleration of a joint, relative to that of the trunk's joints.")
    upper_directions: np.ndarray = constant(
        np.array([[0.04, 0.02], [0.04, 0.02], [0.01, 0.06], [0.01, 0.06]]),
        'Elbows from shoulders, knees from hips: mean outwards and forwards, by limb.', unit='m', source=_POSES)
    upper_direction_spreads: np.ndarray = constant(
        np.array([[0.13, 0.22], [0.13, 0.22], [0.09, 0.18], [0.09, 0.18]]),
        'Standard deviations of these.', unit='m', source=_POSES)
    lower_directions: np.ndarray = constant(
        np.array([[-0.02, 0.08], [-0.02, 0.08], [0.0, -0.06], [0.0, -0.06]]),
        'Wrists from elbows, ankles from knees: mean outwards and forwards, by limb.', unit='m', source=_POSES)
    lower_direction_spreads: np.ndarray = constant(
        np.array([[0.17, 0.16], [0.17, 0.16], [0.09, 0.13], [0.09, 0.13]]),
        'Standard deviations of these.', unit='m', source=_POSES)
    head_points: np.ndarray = constant(
        np.array([[0.0, 0.03, 0.105], [-0.03, -0.02, 0.085], [0.03, -0.02, 0.085], [-0.074, 0.0, 0.0],
                  [0.074, 0.0, 0.0]]),
        'Nose, right and left eye, right and left ear from the middle of the ears: left, down, forwards.', unit='m')
    head_axes: Tuple[float, float, float] = constant(
        (0.078, 0.140, 0.095), 'Half axes of the ellipsoid of the head: left, down, forwards.', unit='m')
    head_ahead: float = constant(0.015, 'The middle of this ellipsoid is this far ahead of the ears.', unit='m')
    parts: BetweenJoints = constant(
        (('left_shoulder', 'right_shoulder', 0.10), ('left_shoulder', 'left_hip', 0.12),
         ('right_shoulder', 'right_hip', 0.12), ('left_shoulder', 'right_hip', 0.12),
         ('right_shoulder', 'left_hip', 0.12), ('left_hip', 'right_hip', 0.12), ('neck', 'nose', 0.12),
         ('right_ear', 'left_ear', 0.12), ('left_shoulder', 'left_elbow', 0.09),
         ('right_shoulder', 'right_elbow', 0.09), ('left_elbow', 'left_wrist', 0.08),
         ('right_elbow', 'right_wrist', 0.08), ('left_hip', 'left_knee', 0.11), ('right_hip', 'right_knee', 0.11),
         ('left_knee', 'left_ankle', 0.10), ('right_knee', 'right_ankle', 0.10)),
        'Parts of a body that may cover a joint in the image: both ends, and half the breadth.', unit='m',
        source='chosen')

    @cached_property
    def bone_lengths(self) -> np.ndarray:
        """(8,) lengths [m], in the order of `BONES`."""
        return np.array([self.shoulder_width, self.hip_width, self.trunk_length, self.neck_to_head, self.upper_arm,
                         self.forearm, self.thigh, self.shin])

    @cached_property
    def accelerations(self) -> np.ndarray:
        """(18,) `relative_acceleration` of all joints."""
        return by_joint(self.relative_acceleration)

    @cached_property
    def sized_bones(self) -> BetweenJoints:
        """Eleven pairs of joints that tell the size of a person in the image, and their distances [m]."""
        shoulders, hips, trunk = self.shoulder_width / 2, self.hip_width / 2, self.trunk_length
        sides = [(('neck', f'{side}_hip', float(np.hypot(trunk, hips))),
                  (f'{side}_shoulder', f'{side}_hip', float(np.hypot(trunk, shoulders - hips))),
                  (f'{side}_hip', f'{side}_knee', self.thigh), (f'{side}_knee', f'{side}_ankle', self.shin),
                  (f'{side}_shoulder', f'{side}_elbow', self.upper_arm)) for side in ('right', 'left')]
        return (*itertools.chain(*sides), ('right_shoulder', 'left_shoulder', self.shoulder_width))

    @cached_property
    def sized_pairs(self) -> np.ndarray:
        """(11, 2) joints of `sized_bones`."""
        return _joints_of(self.sized_bones)

    @cached_property
    def sized_lengths(self) -> np.ndarray:
        """(11,) lengths of `sized_bones` [m]."""
        return np.array([length for *_, length in self.sized_bones])

    @cached_property
    def part_joints(self) -> np.ndarray:
        """(16, 2) ends of `parts`."""
        return _joints_of(self.parts)

    @cached_property
    def part_radii(self) -> np.ndarray:
        """(16,) half breadths of `parts` [m]."""
        return np.array([radius for *_, radius in self.parts])

    @cached_property
    def covering_parts(self) -> np.ndarray:
        """(18, 16) bool, which parts may cover which joint of the same body: none of its own limb."""
        covers = np.ones((len(JOINTS), len(self.parts)), bool)
        limbs = {side + end: chain for side in ('left_', 'right_') for chain, end in
                 (((side + 'shoulder', side + 'elbow'), 'wrist'), ((side + 'elbow', side + 'wrist'), 'shoulder'),
                  ((side + 'hip', side + 'knee'), 'ankle'), ((side + 'knee', side + 'ankle'), 'hip'))}
        for joint, name in enumerate(JOINTS):
            for part, (start, end, _) in enumerate(self.parts):
                if name in (start, end) or limbs.get(name) == (start, end):
                    covers[joint, part] = False
        return covers


def _joints_of(segments: BetweenJoints) -> np.ndarray:
    """Return both ends of segments, (N, 2)."""
    return np.array([joint_indices(start, end) for start, end, _ in segments])


BODY = BodyConstants()

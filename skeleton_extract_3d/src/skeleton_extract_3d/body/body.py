"""What is known about bodies before anybody is seen: lengths of bones, how deep joints lie under the skin, which ways
limbs bend, the shape of the head.

All of it is for an adult of `ADULT_STATURE` and scales with the stature. Joints are those of COCO_18; a network's other
joints are in `extra_joints`.

Sources. Lengths and depths under the skin: means and medians over rendered, dressed bodies with known COCO joints
(five people, 1.66 to 1.86 m), rounded. The lengths agree with Winter, Biomechanics and Motor Control of Human Movement
(2009, fig. 4.1, after Drillis and Contini 1966), but that shoulders and hips are nearer to each other, since COCO marks
joints and not the outside of the body. Freedoms of limbs: everyday poses (standing, walking, waving, sitting), set by
hand; they are broad, and a limb that was clearly measured elsewhere is believed.
"""
from typing import Dict, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18

# Mean of adults, women and men together, and standard deviation as a share of it.
ADULT_STATURE = 1.70
STATURE_SPREAD = 0.12
# Standard deviation of a bone's length, given the stature, as a share.
PROPORTION_SPREAD = 0.08
# What a stature may be measured as [m]: from a small child on.
STATURE_LIMITS = (0.8, 2.1)

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
# +1 on the left, -1 on the right side of the body.
SIDES = np.array([1, -1, 1, -1])

# Lengths [m].
SHOULDER_WIDTH, HIP_WIDTH, TRUNK_LENGTH = 0.331, 0.187, 0.500
NECK_TO_HEAD = 0.201  # to the middle of the ears
UPPER_LENGTHS = np.array([0.269, 0.269, 0.394, 0.394])  # from ROOTS to MIDDLES
LOWER_LENGTHS = np.array([0.241, 0.241, 0.400, 0.400])  # from MIDDLES to ENDS

# The same by kind of bone, left and right alike: the order of `Tracks.bones`.
BONES = ('shoulders', 'hips', 'trunk', 'head', 'upper_arm', 'forearm', 'thigh', 'shin')
BONE_LENGTHS = np.array([SHOULDER_WIDTH, HIP_WIDTH, TRUNK_LENGTH, NECK_TO_HEAD, UPPER_LENGTHS[0], LOWER_LENGTHS[0],
                         UPPER_LENGTHS[2], LOWER_LENGTHS[2]])

# Pairs of joints by which the size of a person in the image is judged, and their distances [m].
_SIZED: Tuple[Tuple[str, str, float], ...] = (
    ('neck', 'right_hip', 0.510), ('neck', 'left_hip', 0.510), ('right_shoulder', 'right_hip', 0.506),
    ('left_shoulder', 'left_hip', 0.506), ('right_hip', 'right_knee', 0.394), ('left_hip', 'left_knee', 0.394),
    ('right_knee', 'right_ankle', 0.400), ('left_knee', 'left_ankle', 0.400),
    ('right_shoulder', 'left_shoulder', SHOULDER_WIDTH), ('right_shoulder', 'right_elbow', 0.269),
    ('left_shoulder', 'left_elbow', 0.269))
SIZED_PAIRS = np.array([(_INDEX[start], _INDEX[end]) for start, end, _ in _SIZED])
SIZED_LENGTHS = np.array([length for *_, length in _SIZED])


def _by_joint(values: Dict[str, float]) -> np.ndarray:
    """Return values that are given without the side for all joints, (18,)."""
    return np.array([values[name.replace('left_', '').replace('right_', '')] for name in JOINTS])


# Depth of the joints under the surface that is seen at their pixel, along the ray [m].
SURFACE_OFFSETS = _by_joint({
    'nose': 0.003, 'eye': 0.010, 'ear': 0.015, 'neck': 0.085, 'shoulder': 0.067, 'elbow': 0.045, 'wrist': 0.028,
    'hip': 0.115, 'knee': 0.078, 'ankle': 0.060})
# A surface that is further than this in front of a joint hides it [m].
THICKNESSES = _by_joint({
    'nose': 0.13, 'eye': 0.13, 'ear': 0.13, 'neck': 0.17, 'shoulder': 0.17, 'elbow': 0.13, 'wrist': 0.11, 'hip': 0.22,
    'knee': 0.13, 'ankle': 0.11})

# How much quicker joints change their velocity than those of the trunk.
LIVELINESS = _by_joint({'nose': 1, 'eye': 1, 'ear': 1, 'neck': 1, 'shoulder': 1, 'hip': 1, 'elbow': 1.5, 'knee': 1.5,
                        'wrist': 2.5, 'ankle': 2.0})

# Where joints lie from their parent, outwards and forwards [m]: mean and standard deviation, (4, 2) each.
UPPER_DIRECTIONS = (np.array([[0.04, 0.02], [0.04, 0.02], [0.01, 0.06], [0.01, 0.06]]),
                    np.array([[0.13, 0.22], [0.13, 0.22], [0.09, 0.18], [0.09, 0.18]]))
LOWER_DIRECTIONS = (np.array([[-0.02, 0.08], [-0.02, 0.08], [0.0, -0.06], [0.0, -0.06]]),
                    np.array([[0.17, 0.16], [0.17, 0.16], [0.09, 0.13], [0.09, 0.13]]))

# The joints of the head from the middle of the ears: to the left, down, forwards [m]; in the order of `HEAD`.
HEAD_POINTS = np.array([[0.0, 0.03, 0.105], [-0.03, -0.02, 0.085], [0.03, -0.02, 0.085],
                        [-0.074, 0.0, 0.0], [0.074, 0.0, 0.0]])
# The head is an ellipsoid with these half axes, to the left, down, forwards [m], so far ahead of the ears [m].
HEAD_AXES, HEAD_AHEAD = (0.078, 0.140, 0.095), 0.015

# Parts of a body that may cover a joint in the image: pairs of joints and half the breadth [m].
_PARTS: Tuple[Tuple[str, str, float], ...] = (
    ('left_shoulder', 'right_shoulder', 0.10), ('left_shoulder', 'left_hip', 0.12),
    ('right_shoulder', 'right_hip', 0.12), ('left_shoulder', 'right_hip', 0.12), ('right_shoulder', 'left_hip', 0.12),
    ('left_hip', 'right_hip', 0.12), ('neck', 'nose', 0.12), ('right_ear', 'left_ear', 0.12),
    ('left_shoulder', 'left_elbow', 0.09), ('right_shoulder', 'right_elbow', 0.09),
    ('left_elbow', 'left_wrist', 0.08), ('right_elbow', 'right_wrist', 0.08), ('left_hip', 'left_knee', 0.11),
    ('right_hip', 'right_knee', 0.11), ('left_knee', 'left_ankle', 0.10), ('right_knee', 'right_ankle', 0.10))
PARTS = np.array([(_INDEX[start], _INDEX[end]) for start, end, _ in _PARTS])
PART_RADII = np.array([radius for *_, radius in _PARTS])


def _covering_parts() -> np.ndarray:
    """Return which parts may cover which joint of the same body, (18, parts): none of its own limb."""
    covers = np.ones((len(JOINTS), len(_PARTS)), bool)
    limbs = {side + end: chain for side in ('left_', 'right_') for chain, end in
             (((side + 'shoulder', side + 'elbow'), 'wrist'), ((side + 'elbow', side + 'wrist'), 'shoulder'),
              ((side + 'hip', side + 'knee'), 'ankle'), ((side + 'knee', side + 'ankle'), 'hip'))}
    for joint, name in enumerate(JOINTS):
        for part, (start, end, _) in enumerate(_PARTS):
            if name in (start, end) or limbs.get(name) == (start, end):
                covers[joint, part] = False
    return covers


COVERING_PARTS = _covering_parts()

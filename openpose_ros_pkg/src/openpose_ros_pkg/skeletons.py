"""Joint sets of pose networks, by name: joints, limbs, part affinity channels, left/right swap and colours.

No other module holds joint indices: they come from the `SkeletonModel`.
"""
import functools
from dataclasses import dataclass
from typing import Dict, Sequence, Tuple

Colour = Tuple[int, int, int]

# Body parts that the messages hold: the fields of openpose_ros_msgs/PersonDetection, in its order.
MESSAGE_JOINTS = (
    'nose', 'neck', 'right_shoulder', 'right_elbow', 'right_wrist', 'left_shoulder', 'left_elbow', 'left_wrist',
    'right_hip', 'right_knee', 'right_ankle', 'left_hip', 'left_knee', 'left_ankle', 'right_eye', 'left_eye',
    'right_ear', 'left_ear', 'chest', 'mid_hip', 'left_big_toe', 'left_small_toe', 'left_heel', 'right_big_toe',
    'right_small_toe', 'right_heel', 'head_top')


@dataclass(frozen=True)
class Limb:
    """A pair of joints that a part affinity field connects."""

    start: str  # joint names; the field points from start to end
    end: str
    paf: Tuple[int, int]  # channels of its x and y component within the part affinity block of the network's output
    starts_person: bool = True  # False for limbs that only add to a person or join two (ear to shoulder)


@dataclass(frozen=True)
class SkeletonModel:
    """A joint set; ValueError: the parts contradict each other, or left and right are no mirror images."""

    name: str  # as published in `pose_model` of the array messages
    joints: Tuple[str, ...]  # names in channel order; messages hold those among `MESSAGE_JOINTS`
    limbs: Tuple[Limb, ...]  # all pairs with a part affinity field, in the order of assembly; none without fields
    drawn_limbs: Tuple[Tuple[str, str], ...]  # pairs of joint names of the drawn skeleton
    colours: Tuple[Colour, ...]  # RGB per joint, as OpenPose draws them

    def __post_init__(self) -> None:
        if len(set(self.joints)) != len(self.joints) or len(self.colours) != len(self.joints):
            raise ValueError(f'{self.name}: joints must be unique and have one colour each')
        for start, end in [(limb.start, limb.end) for limb in self.limbs] + list(self.drawn_limbs):
            if start not in self.joints or end not in self.joints:
                raise ValueError(f'{self.name}: limb {start} - {end} names an unknown joint')
        for joint in self.joints:
            if mirrored_joint(joint) not in self.joints:
                raise ValueError(f'{self.name}: joint {joint} has no partner {mirrored_joint(joint)}')
        pairs = [(limb.start, limb.end) for limb in self.limbs]
        for start, end in pairs:
            if (mirrored_joint(start), mirrored_joint(end)) not in pairs:
                raise ValueError(f'{self.name}: limb {start} - {end} has no partner {mirrored_joint(start)} - '
                                 f'{mirrored_joint(end)}')

    def __hash__(self) -> int:
        return hash(self.name)

    @functools.cached_property
    def index(self) -> Dict[str, int]:
        """Map from joint name to channel."""
        return {joint: i for i, joint in enumerate(self.joints)}

    @functools.cached_property
    def swap(self) -> Tuple[int, ...]:
        """Channel of each joint's mirror partner."""
        index = self.index
        return tuple(index[mirrored_joint(joint)] for joint in self.joints)


def starting_limbs(limbs: Sequence[Limb]) -> Tuple[Tuple[str, str], ...]:
    """Return the ends of the limbs that start a person: OpenPose draws those."""
    return tuple((limb.start, limb.end) for limb in limbs if limb.starts_person)


def mirrored_joint(joint: str) -> str:
    """Return the name of a joint in the mirror image."""
    if joint.startswith('left_'):
        return 'right_' + joint[len('left_'):]
    if joint.startswith('right_'):
        return 'left_' + joint[len('right_'):]
    return joint


def openpose_name(joint: str) -> str:
    """Return the name of a joint as OpenPose writes it: right_shoulder is RShoulder."""
    side, _, part = joint.partition('_')
    words = f'{side[0]}_{part}' if side in ('left', 'right') else joint
    return ''.join(word.capitalize() for word in words.split('_'))


def _limbs(table: str) -> Tuple[Limb, ...]:
    """Return the limbs of rows 'start end channel [joins]'; the y component has the next channel."""
    rows = [row.split() for row in table.split(',')]
    return tuple(Limb(start, end, (int(channel), int(channel) + 1), not joins) for start, end, channel, *joins in rows)


# OpenPose, src/openpose/pose/poseParameters.cpp: POSE_COCO_BODY_PARTS, POSE_COCO_MAP_IDX, POSE_COCO_PAIRS_RENDER,
# POSE_COCO_COLORS_RENDER. The order of the limbs is that of POSE_COCO_PAIRS.
_COCO_18_LIMBS = _limbs('''
    neck right_shoulder 12, neck left_shoulder 20, right_shoulder right_elbow 14, right_elbow right_wrist 16,
    left_shoulder left_elbow 22, left_elbow left_wrist 24, neck right_hip 0, right_hip right_knee 2,
    right_knee right_ankle 4, neck left_hip 6, left_hip left_knee 8, left_knee left_ankle 10, neck nose 28,
    nose right_eye 30, right_eye right_ear 34, nose left_eye 32, left_eye left_ear 36,
    right_shoulder right_ear 18 joins, left_shoulder left_ear 26 joins''')
COCO_18 = SkeletonModel(
    name='COCO_18',
    joints=('nose', 'neck', 'right_shoulder', 'right_elbow', 'right_wrist', 'left_shoulder', 'left_elbow',
            'left_wrist', 'right_hip', 'right_knee', 'right_ankle', 'left_hip', 'left_knee', 'left_ankle',
            'right_eye', 'left_eye', 'right_ear', 'left_ear'),
    limbs=_COCO_18_LIMBS,
    drawn_limbs=starting_limbs(_COCO_18_LIMBS),
    colours=((255, 0, 85), (255, 0, 0), (255, 85, 0), (255, 170, 0), (255, 255, 0), (170, 255, 0), (85, 255, 0),
             (0, 255, 0), (0, 255, 85), (0, 255, 170), (0, 255, 255), (0, 170, 255), (0, 85, 255), (0, 0, 255),
             (255, 0, 170), (170, 0, 255), (255, 0, 255), (85, 0, 255)),
)

# The same file, POSE_BODY_25_BODY_PARTS, and the rows BODY_25 of POSE_BODY_PART_PAIRS and POSE_MAP_INDEX; colours and
# drawn limbs: include/openpose/pose/poseParametersRender.hpp, POSE_BODY_25_*_RENDER_GPU. Pairs 18 and 19 only join:
# src/openpose/pose/bodyPartConnectorBase.cpp, connectBodyPartsCpu.
_BODY_25_LIMBS = _limbs('''
    neck mid_hip 0, neck right_shoulder 14, neck left_shoulder 22, right_shoulder right_elbow 16,
    right_elbow right_wrist 18, left_shoulder left_elbow 24, left_elbow left_wrist 26, mid_hip right_hip 6,
    right_hip right_knee 2, right_knee right_ankle 4, mid_hip left_hip 8, left_hip left_knee 10,
    left_knee left_ankle 12, neck nose 30, nose right_eye 32, right_eye right_ear 36, nose left_eye 34,
    left_eye left_ear 38, right_shoulder right_ear 20 joins, left_shoulder left_ear 28 joins,
    left_ankle left_big_toe 40, left_big_toe left_small_toe 42, left_ankle left_heel 44,
    right_ankle right_big_toe 46, right_big_toe right_small_toe 48, right_ankle right_heel 50''')
BODY_25 = SkeletonModel(
    name='BODY_25',
    joints=('nose', 'neck', 'right_shoulder', 'right_elbow', 'right_wrist', 'left_shoulder', 'left_elbow',
            'left_wrist', 'mid_hip', 'right_hip', 'right_knee', 'right_ankle', 'left_hip', 'left_knee', 'left_ankle',
            'right_eye', 'left_eye', 'right_ear', 'left_ear', 'left_big_toe', 'left_small_toe', 'left_heel',
            'right_big_toe', 'right_small_toe', 'right_heel'),
    limbs=_BODY_25_LIMBS,
    drawn_limbs=starting_limbs(_BODY_25_LIMBS),
    colours=((255, 0, 85), (255, 0, 0), (255, 85, 0), (255, 170, 0), (255, 255, 0), (170, 255, 0), (85, 255, 0),
             (0, 255, 0), (255, 0, 0), (0, 255, 85), (0, 255, 170), (0, 255, 255), (0, 170, 255), (0, 85, 255),
             (0, 0, 255), (255, 0, 170), (170, 0, 255), (255, 0, 255), (85, 0, 255), (0, 0, 255), (0, 0, 255),
             (0, 0, 255), (0, 255, 255), (0, 255, 255), (0, 255, 255)),
)

# The same files: POSE_MPI_BODY_PARTS, POSE_MPI_PAIRS_RENDER_GPU (which are the limbs as well),
# POSE_MPI_COLORS_RENDER_GPU and the row MPI_15 of POSE_MAP_INDEX. No face.
_MPI_15_LIMBS = _limbs('''
    head_top neck 0, neck right_shoulder 2, right_shoulder right_elbow 4, right_elbow right_wrist 6,
    neck left_shoulder 8, left_shoulder left_elbow 10, left_elbow left_wrist 12, neck chest 14,
    chest right_hip 16, right_hip right_knee 18, right_knee right_ankle 20, chest left_hip 22,
    left_hip left_knee 24, left_knee left_ankle 26''')
MPI_15 = SkeletonModel(
    name='MPI_15',
    joints=('head_top', 'neck', 'right_shoulder', 'right_elbow', 'right_wrist', 'left_shoulder', 'left_elbow',
            'left_wrist', 'right_hip', 'right_knee', 'right_ankle', 'left_hip', 'left_knee', 'left_ankle', 'chest'),
    limbs=_MPI_15_LIMBS,
    drawn_limbs=starting_limbs(_MPI_15_LIMBS),
    colours=((255, 0, 85), (255, 0, 0), (255, 85, 0), (255, 170, 0), (255, 255, 0), (170, 255, 0), (85, 255, 0),
             (43, 255, 0), (0, 255, 0), (0, 255, 85), (0, 255, 170), (0, 255, 255), (0, 170, 255), (0, 85, 255),
             (0, 0, 255)),
)

# OpenPose's colour of each part; heads and chests are MPI's alone.
COLOURS: Dict[str, Colour] = {joint: colour for model in (MPI_15, BODY_25)
                              for joint, colour in zip(model.joints, model.colours)}

_COCO_17_JOINTS = (
    'nose', 'left_eye', 'right_eye', 'left_ear', 'right_ear', 'left_shoulder', 'right_shoulder', 'left_elbow',
    'right_elbow', 'left_wrist', 'right_wrist', 'left_hip', 'right_hip', 'left_knee', 'right_knee', 'left_ankle',
    'right_ankle')

# Joints and drawn limbs of the COCO data set (`keypoints` and `skeleton` of the category person), in its order. There
# are no affinity fields.
COCO_17 = SkeletonModel(
    name='COCO_17',
    joints=_COCO_17_JOINTS,
    limbs=(),
    drawn_limbs=(
        ('left_ankle', 'left_knee'), ('left_knee', 'left_hip'), ('right_ankle', 'right_knee'),
        ('right_knee', 'right_hip'), ('left_hip', 'right_hip'), ('left_shoulder', 'left_hip'),
        ('right_shoulder', 'right_hip'), ('left_shoulder', 'right_shoulder'), ('left_shoulder', 'left_elbow'),
        ('right_shoulder', 'right_elbow'), ('left_elbow', 'left_wrist'), ('right_elbow', 'right_wrist'),
        ('left_eye', 'right_eye'), ('nose', 'left_eye'), ('nose', 'right_eye'), ('left_eye', 'left_ear'),
        ('right_eye', 'right_ear'), ('left_ear', 'left_shoulder'), ('right_ear', 'right_shoulder')),
    colours=tuple(COLOURS[joint] for joint in _COCO_17_JOINTS),
)


# mmpose 1.3.2, configs/_base_/datasets/halpe26.py: COCO's joints, head, neck, hip and feet. Its neck is higher than the
# middle of the shoulders, which the neck is everywhere else: in training it is MPII's upper neck as well
# (`mpii_halpe26` of configs/body_2d_keypoint/rtmpose/body8/).
_HALPE_26_JOINTS = (*_COCO_17_JOINTS, 'head_top', 'upper_neck', 'mid_hip', 'left_big_toe', 'right_big_toe',
                    'left_small_toe', 'right_small_toe', 'left_heel', 'right_heel')
HALPE_26 = SkeletonModel('HALPE_26', _HALPE_26_JOINTS, (), COCO_17.drawn_limbs,
                         tuple(COLOURS.get(joint, COLOURS['neck']) for joint in _HALPE_26_JOINTS))


def _face_names() -> Tuple[str, ...]:
    """Return names of the 68 points of a face in iBUG's order, so that mirror partners have one name but for the side.

    mmpose 1.3.2, configs/_base_/datasets/coco_wholebody.py, `swap`.
    """
    pairs = [*((i, 16 - i) for i in range(8)), *((17 + i, 26 - i) for i in range(5)), (31, 35), (32, 34), (36, 45),
             (37, 44), (38, 43), (39, 42), (40, 47), (41, 46), (48, 54), (49, 53), (50, 52), (59, 55), (58, 56),
             (60, 64), (61, 63), (67, 65)]
    names = [f'face_{i}' for i in range(68)]
    for right, left in pairs:
        names[right], names[left] = f'right_face_{right}', f'left_face_{right}'
    return tuple(names)


# COCO-WholeBody's 133 points, the same file: COCO's joints, feet, face (23 to 90), left and right hand (91 and 112 on).
# The order of a face and of a hand is OpenPose's, but for the pupils, which are missing.
_WHOLE_BODY_JOINTS = (
    *_COCO_17_JOINTS, 'left_big_toe', 'left_small_toe', 'left_heel', 'right_big_toe', 'right_small_toe', 'right_heel',
    *_face_names(), *(f'{side}_hand_{i}' for side in ('left', 'right') for i in range(21)))
WHOLE_BODY_133 = SkeletonModel('WHOLE_BODY_133', _WHOLE_BODY_JOINTS, (), COCO_17.drawn_limbs,
                               tuple(COLOURS.get(joint, (255, 255, 255)) for joint in _WHOLE_BODY_JOINTS))

# MediaPipe, mediapipe/modules/pose_landmark/pose_landmark_by_roi_cpu.pbtxt. What it calls foot index is the tip of the
# big toe.
_BLAZEPOSE_JOINTS = (
    'nose', 'left_inner_eye', 'left_eye', 'left_outer_eye', 'right_inner_eye', 'right_eye', 'right_outer_eye',
    'left_ear', 'right_ear', 'left_mouth', 'right_mouth', 'left_shoulder', 'right_shoulder', 'left_elbow',
    'right_elbow', 'left_wrist', 'right_wrist', 'left_pinky', 'right_pinky', 'left_index', 'right_index', 'left_thumb',
    'right_thumb', 'left_hip', 'right_hip', 'left_knee', 'right_knee', 'left_ankle', 'right_ankle', 'left_heel',
    'right_heel', 'left_big_toe', 'right_big_toe')
BLAZEPOSE_33 = SkeletonModel('BLAZEPOSE_33', _BLAZEPOSE_JOINTS, (), (),
                             tuple(COLOURS.get(joint, (255, 255, 255)) for joint in _BLAZEPOSE_JOINTS))

# What networks without fields give of a person, by the number of points.
POINT_SETS: Dict[int, SkeletonModel] = {len(model.joints): model for model in (COCO_17, HALPE_26, WHOLE_BODY_133)}

# All joint sets by the name that the array messages publish as `pose_model`.
SKELETONS: Dict[str, SkeletonModel] = {model.name: model for model in (COCO_18, BODY_25, MPI_15, COCO_17)}


def _lines(*paths: Sequence[int]) -> Tuple[Tuple[str, str], ...]:
    """Return the pairs of neighbours along paths through numbered points."""
    return tuple((str(start), str(end)) for path in paths for start, end in zip(path, path[1:]))


# OpenPose, include/openpose/hand/handParameters.hpp and face/faceParameters.hpp: *_PAIRS_RENDER, *_COLORS_RENDER. The
# points have numbers there: of a hand the wrist, then thumb, index, middle, ring and little finger from base to tip.
HAND_21 = SkeletonModel(
    'HAND_21', tuple(map(str, range(21))), (), _lines(*([0, *range(base, base + 4)] for base in (1, 5, 9, 13, 17))),
    ((100, 100, 100), (100, 0, 0), (150, 0, 0), (200, 0, 0), (255, 0, 0), (100, 100, 0), (150, 150, 0), (200, 200, 0),
     (255, 255, 0), (0, 100, 50), (0, 150, 75), (0, 200, 100), (0, 255, 125), (0, 50, 100), (0, 75, 150), (0, 100, 200),
     (0, 125, 255), (100, 0, 100), (150, 0, 150), (200, 0, 200), (255, 0, 255)))
FACE_70 = SkeletonModel(
    'FACE_70', tuple(map(str, range(70))), (), _lines(
        range(17), range(17, 22), range(22, 27), range(27, 31), range(31, 36), (*range(36, 42), 36),
        (*range(42, 48), 42), (*range(48, 60), 48), (*range(60, 68), 60)), ((255, 255, 255),) * 70)

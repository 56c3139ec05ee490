"""Joint sets of pose networks, by name: joints, limbs, part affinity channels, left/right swap and colours.

No other module holds joint indices; a decoder, a painter or a test asks the `SkeletonModel`.
"""
from dataclasses import dataclass
from typing import Dict, Tuple

Colour = Tuple[int, int, int]


@dataclass(frozen=True)
class Limb:
    """A pair of joints that a part affinity field connects.

    Attributes:
        start, end: joint names; the field points from start to end.
        paf: channels of its x and y component within the part affinity block of the network's output.
        starts_person: False for limbs that only add to a person or join two (ear to shoulder).
    """

    start: str
    end: str
    paf: Tuple[int, int]
    starts_person: bool = True


@dataclass(frozen=True)
class SkeletonModel:
    """A joint set.

    Attributes:
        name: as published in `pose_model` of the array messages.
        joints: names in channel order; they are the field names of openpose_ros_msgs/PersonDetection.
        limbs: all pairs with a part affinity field, in the order in which people are assembled.
        drawn_limbs: pairs of joint names that make up the drawn skeleton.
        colours: RGB per joint, as OpenPose draws them.
    """

    name: str
    joints: Tuple[str, ...]
    limbs: Tuple[Limb, ...]
    drawn_limbs: Tuple[Tuple[str, str], ...]
    colours: Tuple[Colour, ...]

    def __post_init__(self) -> None:
        if len(set(self.joints)) != len(self.joints) or len(self.colours) != len(self.joints):
            raise ValueError(f'{self.name}: joints must be unique and have one colour each')
        for start, end in [(limb.start, limb.end) for limb in self.limbs] + list(self.drawn_limbs):
            if start not in self.joints or end not in self.joints:
                raise ValueError(f'{self.name}: limb {start} - {end} names an unknown joint')

    @property
    def index(self) -> Dict[str, int]:
        """Map from joint name to channel."""
        return {joint: i for i, joint in enumerate(self.joints)}

    @property
    def swap(self) -> Tuple[int, ...]:
        """Channel of each joint's mirror partner: what a joint is called in the mirrored picture."""
        index = self.index
        return tuple(index[_mirrored(joint)] for joint in self.joints)


def _mirrored(joint: str) -> str:
    if joint.startswith('left_'):
        return 'right_' + joint[len('left_'):]
    if joint.startswith('right_'):
        return 'left_' + joint[len('right_'):]
    return joint


# OpenPose, src/openpose/pose/poseParameters.cpp: POSE_COCO_BODY_PARTS, POSE_COCO_MAP_IDX, POSE_COCO_PAIRS_RENDER,
# POSE_COCO_COLORS_RENDER. The order of the limbs is that of POSE_COCO_PAIRS.
COCO_18 = SkeletonModel(
    name='COCO_18',
    joints=('nose', 'neck', 'right_shoulder', 'right_elbow', 'right_wrist', 'left_shoulder', 'left_elbow',
            'left_wrist', 'right_hip', 'right_knee', 'right_ankle', 'left_hip', 'left_knee', 'left_ankle',
            'right_eye', 'left_eye', 'right_ear', 'left_ear'),
    limbs=(
        Limb('neck', 'right_shoulder', (12, 13)),
        Limb('neck', 'left_shoulder', (20, 21)),
        Limb('right_shoulder', 'right_elbow', (14, 15)),
        Limb('right_elbow', 'right_wrist', (16, 17)),
        Limb('left_shoulder', 'left_elbow', (22, 23)),
        Limb('left_elbow', 'left_wrist', (24, 25)),
        Limb('neck', 'right_hip', (0, 1)),
        Limb('right_hip', 'right_knee', (2, 3)),
        Limb('right_knee', 'right_ankle', (4, 5)),
        Limb('neck', 'left_hip', (6, 7)),
        Limb('left_hip', 'left_knee', (8, 9)),
        Limb('left_knee', 'left_ankle', (10, 11)),
        Limb('neck', 'nose', (28, 29)),
        Limb('nose', 'right_eye', (30, 31)),
        Limb('right_eye', 'right_ear', (34, 35)),
        Limb('nose', 'left_eye', (32, 33)),
        Limb('left_eye', 'left_ear', (36, 37)),
        Limb('right_shoulder', 'right_ear', (18, 19), starts_person=False),
        Limb('left_shoulder', 'left_ear', (26, 27), starts_person=False),
    ),
    drawn_limbs=(
        ('neck', 'right_shoulder'), ('neck', 'left_shoulder'), ('right_shoulder', 'right_elbow'),
        ('right_elbow', 'right_wrist'), ('left_shoulder', 'left_elbow'), ('left_elbow', 'left_wrist'),
        ('neck', 'right_hip'), ('right_hip', 'right_knee'), ('right_knee', 'right_ankle'), ('neck', 'left_hip'),
        ('left_hip', 'left_knee'), ('left_knee', 'left_ankle'), ('neck', 'nose'), ('nose', 'right_eye'),
        ('right_eye', 'right_ear'), ('nose', 'left_eye'), ('left_eye', 'left_ear')),
    colours=((255, 0, 85), (255, 0, 0), (255, 85, 0), (255, 170, 0), (255, 255, 0), (170, 255, 0), (85, 255, 0),
             (0, 255, 0), (0, 255, 85), (0, 255, 170), (0, 255, 255), (0, 170, 255), (0, 85, 255), (0, 0, 255),
             (255, 0, 170), (170, 0, 255), (255, 0, 255), (85, 0, 255)),
)

# All joint sets by the name that the array messages publish as `pose_model`.
SKELETONS: Dict[str, SkeletonModel] = {model.name: model for model in (COCO_18,)}

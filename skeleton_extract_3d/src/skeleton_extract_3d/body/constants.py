"""Constants of measured sizes, of joints that COCO_18 does not have, and of the frames of joints."""
from dataclasses import dataclass

from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class SizeConstants:
    """How stature and bones of a person are learnt."""

    least_score: float = constant(
        0.5, 'Keypoints with a lower score may be beside the body: they measure neither sizes nor clothes.')
    least_bones: int = constant(3, 'A stature is measured by at least this many bones at once.', source='chosen')
    most_frames: float = constant(
        30.0, 'A frame counts at least one in this many, so sizes and colours may still change; '
              "an adult's proportions count like so many.", unit='frames')
    known: float = constant(
        0.06, 'Standard deviation that a measured length tends to (where `most_frames` count, half of the way there '
              'from that of proportions), that of the size in the image where the depth of the trunk is sure, and '
              'that of a depth by it.', unit='share')


@dataclass(frozen=True)
class ExtraJointConstants:
    """Joints at the end of a body that COCO_18 does not have: the top of the head, toes and heels."""

    foot_reach: float = constant(0.25, "Toes and heels are within this distance of the ankle's depth.", unit='m',
                                 source='chosen')
    offset: float = constant(
        0.02, "Depth of the top of the head, toes and heels under the surface, and how much greater than the parent's "
              'their errors are.', unit='m', source='chosen')
    window: float = constant(0.03, 'Half the side of the window around the keypoint; feet are narrow.', unit='m',
                             source='chosen')


@dataclass(frozen=True)
class JointFrameConstants:
    """The frames of joints."""

    least_bend: float = constant(
        0.2, 'Sine of the bend of elbow or knee (12 degrees) from which on the bending axis turns the limb.',
        source='error of two directions with 3 cm at the end of a bone of 25 cm')
    clear_bend: float = constant(
        0.5, 'Sine of the bend (30 degrees) from which on the bending axis alone is the second axis of the limb.',
        source='chosen')

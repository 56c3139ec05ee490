"""The model of the body: both sides alike, in agreement with itself and with what was measured on people."""
import pytest

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body import body
from skeleton_extract_3d.body.body import BODY

JOINTS = body.JOINTS


def named(joints):
    return [JOINTS[joint] for joint in joints]


# Winter, Biomechanics and Motor Control of Human Movement, fig. 4.1, as shares of the stature
@pytest.mark.parametrize('bone, share', [('forearm', 0.146), ('thigh', 0.245), ('shin', 0.246)])
def test_limbs_are_as_long_as_in_the_literature(bone, share):
    length = BODY.bone_lengths[body.BONES.index(bone)]
    assert length == pytest.approx(share * BODY.adult_stature, rel=0.06)


def parts_over(joint):
    """Return the parts of the same body that may cover a joint, as sets of joint names."""
    covering = BODY.covering_parts[COCO_18.index[joint]]
    return {frozenset(named(part)) for part in BODY.part_joints[covering].tolist()}


@pytest.mark.parametrize('joint, limb', [
    ('left_wrist', [('left_elbow', 'left_wrist'), ('left_shoulder', 'left_elbow')]),
    ('right_elbow', [('right_elbow', 'right_wrist'), ('right_shoulder', 'right_elbow')]),
    ('left_ankle', [('left_hip', 'left_knee'), ('left_knee', 'left_ankle')]),
    ('right_hip', [('right_hip', 'right_knee'), ('right_knee', 'right_ankle')])])
def test_no_joint_is_covered_by_its_own_limb(joint, limb):
    assert not parts_over(joint) & {frozenset(part) for part in limb}

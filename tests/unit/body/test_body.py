"""The model of the body: both sides alike, in agreement with itself and with what was measured on people."""
import numpy as np
import pytest

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body import body
from skeleton_extract_3d.body.body import BODY

JOINTS = body.JOINTS
MIRRORED = np.array(COCO_18.swap)


def named(joints):
    return [JOINTS[joint] for joint in joints]


def test_indices_are_those_of_the_skeleton():
    names = ('left_wrist', 'neck', 'right_ear')
    assert body.joint_indices(*names).tolist() == [COCO_18.index[name] for name in names]
    with pytest.raises(KeyError, match='tail'):
        body.joint_indices('tail')


def test_chains_run_outwards_on_alternating_sides():
    for chain in zip(named(body.ROOTS), named(body.MIDDLES), named(body.ENDS), body.SIDES):
        root, middle, end, side = chain
        assert [name.split('_')[0] for name in (root, middle, end)] == ['left' if side > 0 else 'right'] * 3
        assert [name.split('_')[1] for name in (root, middle, end)] in (['shoulder', 'elbow', 'wrist'],
                                                                        ['hip', 'knee', 'ankle'])


# what the depths of joints under the rendered skin of dressed bodies were measured to be [m]
@pytest.mark.parametrize('joint, least, most', [
    ('nose', 0.0, 0.02), ('left_eye', 0.0, 0.02), ('left_shoulder', 0.04, 0.09), ('right_hip', 0.08, 0.13),
    ('left_knee', 0.06, 0.10), ('right_wrist', 0.02, 0.06)])
def test_joints_lie_as_deep_as_was_measured(joint, least, most):
    assert least <= BODY.surface_offsets[COCO_18.index[joint]] <= most


def test_a_surface_that_hides_a_joint_is_further_in_front_than_the_own_skin():
    assert (BODY.thicknesses > BODY.surface_offsets + 0.03).all()


def test_bones_that_are_measured_and_satisfied_are_of_their_kind():
    kinds = {('hip', 'hip'): 'hips', ('shoulder', 'shoulder'): 'shoulders', ('shoulder', 'elbow'): 'upper_arm',
             ('elbow', 'wrist'): 'forearm', ('hip', 'knee'): 'thigh', ('knee', 'ankle'): 'shin'}
    measured = np.column_stack([body.MEASURED_BONES, body.MEASURED_KINDS[:-1]])
    for start, end, kind in [*measured.tolist(), *body.SATISFIED_BONES.tolist()]:
        assert kinds[tuple(name.split('_')[1] for name in named((start, end)))] == body.BONES[kind]
    assert body.BONES[body.MEASURED_KINDS[-1]] == 'trunk'


# Winter, Biomechanics and Motor Control of Human Movement, fig. 4.1, as shares of the stature
@pytest.mark.parametrize('bone, share', [('forearm', 0.146), ('thigh', 0.245), ('shin', 0.246)])
def test_limbs_are_as_long_as_in_the_literature(bone, share):
    length = BODY.bone_lengths[body.BONES.index(bone)]
    assert length == pytest.approx(share * BODY.adult_stature, rel=0.06)


def test_pairs_that_measure_the_size_are_as_long_as_the_bones():
    length = dict(zip(body.BONES, BODY.bone_lengths))
    expected = {frozenset(('shoulder',)): length['shoulders'], frozenset(('hip', 'knee')): length['thigh'],
                frozenset(('knee', 'ankle')): length['shin'], frozenset(('shoulder', 'elbow')): length['upper_arm'],
                # the middle of a shoulder is beside the line from hip to neck, so both pairs are longer than the trunk
                frozenset(('neck', 'hip')): length['trunk'], frozenset(('shoulder', 'hip')): length['trunk']}
    for pair, measured in zip(BODY.sized_pairs, BODY.sized_lengths):
        kinds = frozenset(name.split('_')[-1] for name in named(pair))
        assert measured == pytest.approx(expected[kinds], abs=0.011)
    pairs = {frozenset(pair) for pair in BODY.sized_pairs.tolist()}
    assert {frozenset(MIRRORED[list(pair)].tolist()) for pair in pairs} == pairs


def test_a_head_is_the_same_on_both_sides_and_the_nose_is_in_front():
    points = dict(zip(named(body.HEAD), BODY.head_points))
    for part in ('eye', 'ear'):
        np.testing.assert_array_equal(points[f'left_{part}'], points[f'right_{part}'] * [-1, 1, 1])
        assert points[f'left_{part}'][0] > 0
    assert points['nose'][0] == 0 and points['nose'][2] > points['left_eye'][2] > points['left_ear'][2] == 0
    assert points['nose'][1] > points['left_ear'][1] > points['left_eye'][1], 'eyes, ears, nose from above'


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

"""Joint sets against the published tables of the networks that use them."""
import pytest

from openpose_ros_pkg.models import MOBILENET_THIN
from openpose_ros_pkg.skeletons import COCO_18, SKELETONS, Limb, SkeletonModel

# Pairs and channels as in tf-pose-estimation, tf_pose/common.py: CocoPairs and CocoPairsNetwork (less the 19
# confidence maps that come first).
PAIRS = [(1, 2), (1, 5), (2, 3), (3, 4), (5, 6), (6, 7), (1, 8), (8, 9), (9, 10), (1, 11), (11, 12), (12, 13), (1, 0),
         (0, 14), (14, 16), (0, 15), (15, 17), (2, 16), (5, 17)]
CHANNELS = [(12, 13), (20, 21), (14, 15), (16, 17), (22, 23), (24, 25), (0, 1), (2, 3), (4, 5), (6, 7), (8, 9),
            (10, 11), (28, 29), (30, 31), (34, 35), (32, 33), (36, 37), (18, 19), (26, 27)]


def test_coco_limbs_and_channels_are_the_published_ones():
    index = COCO_18.index
    assert [(index[limb.start], index[limb.end]) for limb in COCO_18.limbs] == PAIRS
    assert [limb.paf for limb in COCO_18.limbs] == CHANNELS


def test_only_ear_to_shoulder_limbs_start_nobody():
    assert [limb.starts_person for limb in COCO_18.limbs] == [True] * 17 + [False] * 2


def test_coco_joints_in_channel_order():
    assert COCO_18.joints == (
        'nose', 'neck', 'right_shoulder', 'right_elbow', 'right_wrist', 'left_shoulder', 'left_elbow', 'left_wrist',
        'right_hip', 'right_knee', 'right_ankle', 'left_hip', 'left_knee', 'left_ankle', 'right_eye', 'left_eye',
        'right_ear', 'left_ear')


def test_drawn_limbs_are_all_but_ear_to_shoulder():
    assert set(COCO_18.drawn_limbs) == {(limb.start, limb.end) for limb in COCO_18.limbs if limb.starts_person}


@pytest.mark.parametrize('skeleton', SKELETONS.values(), ids=SKELETONS.keys())
def test_paf_channels_are_used_once_each(skeleton):
    channels = sorted(channel for limb in skeleton.limbs for channel in limb.paf)
    assert channels == list(range(2 * len(skeleton.limbs)))


@pytest.mark.parametrize('skeleton', SKELETONS.values(), ids=SKELETONS.keys())
def test_swap_is_its_own_inverse_and_names_the_other_side(skeleton):
    for joint, partner in enumerate(skeleton.swap):
        assert skeleton.swap[partner] == joint
        name, other = skeleton.joints[joint], skeleton.joints[partner]
        assert {name, other} == {name} or name.split('_', 1)[1] == other.split('_', 1)[1]
    assert skeleton.swap[skeleton.index['nose']] == skeleton.index['nose']
    assert skeleton.swap[skeleton.index['left_knee']] == skeleton.index['right_knee']


def test_network_output_has_57_channels():
    assert (MOBILENET_THIN.heatmaps, MOBILENET_THIN.channels) == (19, 57)


def test_limb_of_an_unknown_joint_is_refused():
    with pytest.raises(ValueError, match='tail'):
        SkeletonModel('cat', ('nose',), (Limb('nose', 'tail', (0, 1)),), (), ((0, 0, 0),))


def test_joints_need_one_colour_each():
    with pytest.raises(ValueError, match='colour'):
        SkeletonModel('cat', ('nose', 'tail'), (), (), ((0, 0, 0),))

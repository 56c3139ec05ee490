"""Joint sets against the published tables of the networks that use them."""
import re

import pytest

from openpose_ros_pkg.skeletons import BODY_25, COCO_17, COCO_18, MPI_15, Limb, SkeletonModel

# OpenPose, src/openpose/pose/poseParameters.cpp and include/openpose/pose/poseParametersRender.hpp, in its own words:
# POSE_*_BODY_PARTS, POSE_BODY_PART_PAIRS, POSE_MAP_INDEX.
UPPER_BODY = 'Neck RShoulder RElbow RWrist LShoulder LElbow LWrist'
LEGS = 'RHip RKnee RAnkle LHip LKnee LAnkle'
FACE = 'REye LEye REar LEar'
PUBLISHED = {
    'COCO_18': {
        'parts': f'Nose {UPPER_BODY} {LEGS} {FACE}',
        'pairs': '1,2, 1,5, 2,3, 3,4, 5,6, 6,7, 1,8, 8,9, 9,10, 1,11, 11,12, 12,13, 1,0, 0,14, 14,16, 0,15, 15,17, '
                 '2,16, 5,17',
        'map': '12,13, 20,21, 14,15, 16,17, 22,23, 24,25, 0,1, 2,3, 4,5, 6,7, 8,9, 10,11, 28,29, 30,31, 34,35, 32,33, '
               '36,37, 18,19, 26,27',
    },
    'BODY_25': {
        'parts': f'Nose {UPPER_BODY} MidHip {LEGS} {FACE} LBigToe LSmallToe LHeel RBigToe RSmallToe RHeel',
        'pairs': '1,8, 1,2, 1,5, 2,3, 3,4, 5,6, 6,7, 8,9, 9,10, 10,11, 8,12, 12,13, 13,14, 1,0, 0,15, 15,17, 0,16, '
                 '16,18, 2,17, 5,18, 14,19, 19,20, 14,21, 11,22, 22,23, 11,24',
        'map': '0,1, 14,15, 22,23, 16,17, 18,19, 24,25, 26,27, 6,7, 2,3, 4,5, 8,9, 10,11, 12,13, 30,31, 32,33, 36,37, '
               '34,35, 38,39, 20,21, 28,29, 40,41, 42,43, 44,45, 46,47, 48,49, 50,51',
    },
    'MPI_15': {
        'parts': f'Head {UPPER_BODY} {LEGS} Chest',
        'pairs': '0,1, 1,2, 2,3, 3,4, 1,5, 5,6, 6,7, 1,14, 14,8, 8,9, 9,10, 14,11, 11,12, 12,13',
        'map': '0,1, 2,3, 4,5, 6,7, 8,9, 10,11, 12,13, 14,15, 16,17, 18,19, 20,21, 22,23, 24,25, 26,27',
    },
}
WITH_PAF = [COCO_18, BODY_25, MPI_15]
def by_name(skeleton):
    return skeleton.name


def pairs(text):
    numbers = [int(number) for number in text.split(',')]
    return list(zip(numbers[::2], numbers[1::2]))


def field_name(part):
    """OpenPose's name of a part as the messages spell it: RBigToe is right_big_toe, Head is head_top."""
    side = {'R': 'right_', 'L': 'left_'}.get(part[0], '')
    words = re.findall('[A-Z][a-z]+', part[1:] if side else part)
    return {'head': 'head_top'}.get('_'.join(words).lower(), side + '_'.join(words).lower())


@pytest.mark.parametrize('skeleton', WITH_PAF, ids=by_name)
def test_joints_limbs_and_channels_are_the_published_ones(skeleton):
    table, index = PUBLISHED[skeleton.name], skeleton.index
    assert list(skeleton.joints) == [field_name(part) for part in table['parts'].split()]
    assert [(index[limb.start], index[limb.end]) for limb in skeleton.limbs] == pairs(table['pairs'])
    assert [limb.paf for limb in skeleton.limbs] == pairs(table['map'])


def test_coco_17_is_the_data_sets_order_and_skeleton():
    """Numbers as in its annotation files, which count from 1."""
    skeleton = [(16, 14), (14, 12), (17, 15), (15, 13), (12, 13), (6, 12), (7, 13), (6, 7), (6, 8), (7, 9), (8, 10),
                (9, 11), (2, 3), (1, 2), (1, 3), (2, 4), (3, 5), (4, 6), (5, 7)]
    assert [(COCO_17.index[start] + 1, COCO_17.index[end] + 1) for start, end in COCO_17.drawn_limbs] == skeleton
    sides = [f'{side}_{joint}' for joint in ('eye', 'ear', 'shoulder', 'elbow', 'wrist', 'hip', 'knee', 'ankle')
             for side in ('left', 'right')]
    assert list(COCO_17.joints) == ['nose', *sides]


GREY = (9, 9, 9)


@pytest.mark.parametrize('joints, limbs, drawn, colours, named', [
    (('nose',), (Limb('nose', 'tail', (0, 1)),), (), (GREY,), 'tail'),
    (('nose',), (), (('nose', 'tail'),), (GREY,), 'tail'),
    (('nose', 'neck'), (), (), (GREY,), 'colour'),
    (('nose', 'nose'), (), (), (GREY, GREY), 'unique'),
    (('nose', 'left_eye'), (), (), (GREY, GREY), 'left_eye has no partner right_eye'),
    (('nose', 'left_eye', 'right_eye'), (Limb('nose', 'left_eye', (0, 1)),), (), (GREY,) * 3,
     'nose - left_eye has no partner nose - right_eye')])
def test_parts_that_do_not_fit_are_refused(joints, limbs, drawn, colours, named):
    with pytest.raises(ValueError, match=f'cat: .*{named}'):
        SkeletonModel('cat', joints, limbs, drawn, colours)

"""Bodies of REP-155: the joint angles, put into the joints of its model, give the limbs that were seen."""
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from animated_skeleton import KNEELING, RUNNING, SITTING, STANDING, Limb, joints_of, people_of, without
from openpose_ros_bridges.body_model import SKELETON_2D, body_poses, skeleton_2d
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.points.transform import rotation_of

POSES = {
    'stands': STANDING, 'sits': SITTING, 'kneels': KNEELING, 'runs': RUNNING,
    'turned': replace(SITTING, facing=130.0, place=(2.0, 1.0)),
    'arms ahead': replace(STANDING, left=Limb((0.1, 1.0, 0.1), (0.0, 0.4, 1.0)),
                          right=Limb((0.3, 1.0, -0.2), (0.0, 1.0, 1.0))),
    'arms up': replace(STANDING, left=Limb((0.5, 0.1, 1.0), (-0.2, 0.3, 1.0)),
                       right=Limb((0.9, 0.3, 0.4), (-0.4, 0.1, 1.0))),
    'leans': replace(STANDING, lean=40.0)}
# Axes of the joints of human_description's urdf/human-tpl.xacro, root to tip; reflect: 1 left, -1 right.
SHOULDER = (('y', (0, 0, -1), True), ('p', (1, 0, 0), True), ('r', (0, 0, 1), True))
HIP = (('y', (0, 0, -1), False), ('p', (1, 0, 0), True), ('r', (0, -1, 0), False))
BEND = (0, -1, 0)


def body(pose, missing=()):
    return body_poses(without(people_of([pose], [4], np.random.RandomState(0)), missing))[4]


def place(pose, joint):
    return joints_of(pose)[COCO_18.index[joint]]


def direction(vector):
    return vector / np.linalg.norm(vector)


@pytest.mark.parametrize('pose', POSES.values(), ids=POSES)
@pytest.mark.parametrize(('side', 'reflect'), [('left', 1), ('right', -1)])
@pytest.mark.parametrize(('axes', 'parts', 'parent'), [
    (SHOULDER, ('shoulder', 'elbow', 'wrist'), 'torso'), (HIP, ('hip', 'knee', 'ankle'), None)])
def test_the_model_with_these_angles_has_the_limbs_that_were_seen(pose, side, reflect, axes, parts, parent):
    found = body(pose)
    turn = rotation_of(found.root.rotation @ (found.links[parent].rotation if parent else np.eye(3)))
    for letter, axis, mirrored in axes:
        angle = found.joints[f'{side[0]}_{letter}_{parts[0]}']
        turn = turn * Rotation.from_rotvec(np.multiply(axis, (reflect if mirrored else 1) * angle))
    first, middle, last = (place(pose, f'{side}_{part}') for part in parts)
    # 5 mm of noise at the ends of a limb of 0.25 m are 2 degrees, and more about a limb that is nearly straight
    assert turn.apply([0, 0, -1]) @ direction(middle - first) > np.cos(np.radians(6))
    turn = turn * Rotation.from_rotvec(np.multiply(BEND, found.joints[f'{side[0]}_{parts[1]}']))
    assert turn.apply([0, 0, -1]) @ direction(last - middle) > np.cos(np.radians(8))


def test_links_are_at_their_joints_in_the_frame_of_the_root():
    pose = replace(STANDING, facing=70.0)
    found = body(pose)
    for link, joint in (('l_wrist', 'left_wrist'), ('r_knee', 'right_knee'), ('torso', 'neck')):
        at = found.root.position + found.root.rotation @ found.links[link].position
        np.testing.assert_allclose(at, place(pose, joint), atol=0.03)
    np.testing.assert_allclose(found.links['head'].rotation[:, 0], [1, 0, 0], atol=0.25)  # looks ahead
    np.testing.assert_allclose(found.links['l_knee'].rotation[:, 2], [0, 0, 1], atol=0.15)  # shins are along -z


def test_what_is_missing_has_neither_link_nor_angle():
    missing = ('left_wrist', 'right_knee', 'nose')
    found = body(STANDING, missing)
    assert not {'l_wrist', 'r_knee', 'head'} & set(found.links)
    assert not {'l_elbow', 'r_knee', 'r_p_hip', 'y_head'} & set(found.joints)
    assert {'l_elbow', 'r_wrist', 'l_knee'} <= set(found.links) and {'r_elbow', 'l_p_hip'} <= set(found.joints)


@pytest.mark.parametrize('joint', ['left_hip', 'neck'])
def test_without_hips_and_neck_there_is_no_body(joint):
    assert body_poses(without(people_of([STANDING], [4], np.random.RandomState(0)), (joint,))) == {}


def test_the_face_has_its_left_first():
    assert SKELETON_2D[14:] == ('left_eye', 'right_eye', 'left_ear', 'right_ear')
    assert SKELETON_2D[:14] == COCO_18.joints[:14]
    keypoints = np.zeros((18, 3), np.float32)
    keypoints[COCO_18.index['left_eye']] = (320, 120, 0.5)
    keypoints[COCO_18.index['right_wrist']] = (650, -3, 0.75)  # a little outside of the image
    points = skeleton_2d(keypoints, COCO_18, (640, 480))
    np.testing.assert_allclose(points[14], [0.5, 0.25, 0.5])
    np.testing.assert_allclose(points[4], [1.0, 0.0, 0.75])
    assert not points[[0, 15, 16, 17]].any()

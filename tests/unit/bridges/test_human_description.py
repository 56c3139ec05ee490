"""Robot models of people: links of the lengths that were seen, where they were seen, in a URDF that readers accept."""
from dataclasses import replace

import numpy as np
import pytest

from animated_skeleton import ADULT, KNEELING, SITTING, STANDING, Limb, joints_of, people_of, without
from openpose_ros_bridges.body_model import BodyPose, body_poses
from openpose_ros_bridges.human_description import joints_of as joints_of_model
from openpose_ros_bridges.human_description import lengths_of, links_of, urdf_of
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.body import BODY
from urdf_reader import parsed_urdf

SCALE = ADULT / BODY.adult_stature
POSES = {'stands': STANDING, 'sits': SITTING, 'kneels': KNEELING, 'leans': replace(STANDING, lean=30.0, facing=70.0),
         'arms ahead': replace(STANDING, left=Limb((0.1, 1.0, 0.1), (0.0, 0.4, 1.0)))}
# Of urdf/human-tpl.xacro in human_description 1.0.1, without the id.
LINKS = {'body', 'waist', 'torso', 'r_head', 'y_head', 'p_head', 'head', *(
    f'{side}_{link}' for side in 'lr' for link in (
        'y_shoulder', 'p_shoulder', 'shoulder', 'elbow', 'wrist', 'y_hip', 'p_hip', 'hip', 'knee', 'ankle'))}
TURNING = {'waist', 'r_head', 'y_head', 'p_head', *(
    f'{side}_{joint}' for side in 'lr' for joint in (
        'y_shoulder', 'p_shoulder', 'r_shoulder', 'elbow', 'y_hip', 'p_hip', 'r_hip', 'knee'))}
FIXED = {'torso', 'head', 'l_wrist', 'r_wrist', 'l_ankle', 'r_ankle'}


def body(pose, missing=()):
    return body_poses(without(people_of([pose], [4], np.random.RandomState(0)), missing))[4]


def in_room(found, poses):
    return {link: found.root.position + found.root.rotation @ pose.position for link, pose in poses.items()}


def test_lengths_are_those_of_the_person():
    lengths = lengths_of(body(SITTING))
    for name, length in (('shoulders', BODY.shoulder_width), ('hips', BODY.hip_width), ('trunk', BODY.trunk_length),
                         ('head', BODY.neck_to_head), ('upper_arm', BODY.upper_arm), ('forearm', BODY.forearm),
                         ('thigh', BODY.thigh), ('shin', BODY.shin)):
        assert lengths[name] == pytest.approx(SCALE * length, abs=0.015), name


def test_lengths_that_are_not_seen_have_the_proportions_of_an_adult():
    missing = [f'{side}_{joint}' for side in ('left', 'right') for joint in ('knee', 'ankle', 'ear')]
    lengths = lengths_of(body(STANDING, [*missing, 'left_elbow']))
    assert lengths['thigh'] == pytest.approx(SCALE * BODY.thigh, rel=0.05)
    assert lengths['shin'] == pytest.approx(SCALE * BODY.shin, rel=0.05)
    assert lengths['head'] == pytest.approx(SCALE * BODY.neck_to_head, rel=0.05)
    assert lengths['upper_arm'] == pytest.approx(SCALE * BODY.upper_arm, abs=0.015)  # of the other arm


@pytest.mark.parametrize('pose', POSES.values(), ids=POSES)
def test_the_angles_put_the_model_where_the_person_is(pose):
    found = body(pose)
    lengths = lengths_of(found)
    # nothing but the angles is known
    model = in_room(found, links_of(BodyPose(found.root, {}, found.joints, found.velocity), lengths))
    assert np.linalg.norm(model['torso'] - joints_of(pose)[COCO_18.index['neck']]) < 0.02
    # 5 mm of noise at the hips turn the shoulders, which the model has in parallel, by 3 cm
    for side in ('left', 'right'):
        for joint, tolerance in (('shoulder', 0.04), ('elbow', 0.06), ('wrist', 0.09), ('hip', 0.02), ('knee', 0.06),
                                 ('ankle', 0.09)):
            away = model[f'{side[0]}_{joint}'] - joints_of(pose)[COCO_18.index[f'{side}_{joint}']]
            assert np.linalg.norm(away) < tolerance, f'{side}_{joint}'


@pytest.mark.parametrize('pose', POSES.values(), ids=POSES)
def test_links_that_were_seen_stay_and_the_others_are_between_them(pose):
    found = body(pose)
    links = links_of(found, lengths_of(found))
    assert set(links) == LINKS - {'body'}
    assert all(links[link] is found.links[link] for link in found.links)
    for side in 'lr':
        for root in ('shoulder', 'hip'):
            for letter in 'yp':
                np.testing.assert_array_equal(links[f'{side}_{letter}_{root}'].position,
                                              links[f'{side}_{root}'].position)
    for pose_of_link in links.values():
        np.testing.assert_allclose(pose_of_link.rotation @ pose_of_link.rotation.T, np.eye(3), atol=1e-6)


def test_readers_accept_the_urdf_and_find_the_links_and_joints_of_human_description():
    found = body(STANDING)
    model = parsed_urdf(urdf_of('p7', lengths_of(found)))
    assert model.root == 'body_p7'
    assert set(model.links) == {f'{link}_p7' for link in LINKS}
    assert {name for name, joint in model.joints.items() if joint.kind == 'revolute'} == {f'{j}_p7' for j in TURNING}
    assert {name for name, joint in model.joints.items() if joint.kind == 'fixed'} == {f'{j}_p7' for j in FIXED}
    for joint in joints_of_model(lengths_of(found)):
        there = model.joints[f'{joint.name}_p7']
        assert (there.parent, there.child) == (f'{joint.parent}_p7', f'{joint.child}_p7')
        np.testing.assert_array_equal(there.origin, joint.origin)

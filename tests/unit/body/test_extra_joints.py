"""People with other joints than COCO_18's, through the estimator: chest, middle of the hips, feet, top of the head."""
from functools import lru_cache

import numpy as np
import pytest

from estimating import new_estimator, update
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import BODY_25, COCO_17, COCO_18, MPI_15
from skeleton_extract_3d.people import INFERRED, MEASURED
from synthetic_scene import HEAD_CENTRE, HEAD_RADII, Person, Room, joints_of, pinhole, render, standing

RATE = 15.0
SKELETONS = pytest.mark.parametrize('skeleton', [BODY_25, MPI_15, COCO_17], ids=lambda skeleton: skeleton.name)
SIDES = ('left', 'right')
FREE = Room(wall=4.0)
WHO = Person(1, 0.1, 2.6, standing())


@lru_cache(maxsize=None)
def scene(room=FREE):
    return render(pinhole(480, 270), [WHO], room)


@lru_cache(maxsize=None)
def truth():
    """Return where joints are by name, [m]; for feet, roughly."""
    joints = joints_of(WHO, 1.2)
    hips, neck = (joints['left_hip'] + joints['right_hip']) / 2, joints['neck']
    below = np.array([0, 0.035, 0])
    joints.update(mid_hip=hips, chest=(hips + neck) / 2, head_top=neck + HEAD_CENTRE - np.array([0, HEAD_RADII[1], 0]))
    for side in SIDES:
        # a capsule of 4 cm from the ankle to 13 cm in front of it
        ankle = joints[f'{side}_ankle']
        joints[f'{side}_heel'] = ankle + below
        for toe, aside in (('big_toe', -0.015), ('small_toe', 0.015)):
            joints[f'{side}_{toe}'] = ankle + below + np.array([aside, 0, -0.12])
    return joints


def people_2d(skeleton, missing=()):
    """Return the keypoints of the joints, a little below the top of the head, where its surface is."""
    keypoints = np.full((1, len(skeleton.joints), 3), (np.nan, np.nan, 0))
    for i, name in enumerate(skeleton.joints):
        if name not in missing:
            xyz = truth()[name] + np.array([0, 0.02 if name == 'head_top' else 0, 0])
            keypoints[0, i] = (*scene().camera.project(xyz)[0], 0.9)
    return People2D(skeleton, keypoints, [0.9], [-1])


def answer(people, room=FREE):
    """Return the estimate after people have been shown in a few frames."""
    estimator = new_estimator()
    for i in range(4):
        result = update(estimator, scene(), i / RATE, people, scene(room).depth)
    return result


@lru_cache(maxsize=None)
def estimate(skeleton, missing=(), room=FREE):
    """Return the estimate of a person without the keypoints of some joints."""
    return answer(people_2d(skeleton, missing), room)


def joint(result, name):
    """Return status, position and sigma of a joint of the first person."""
    people = result.people
    row = people.skeleton.index[name]
    return people.status[0, row], people.xyz[0, row], people.sigma[0, row]


@SKELETONS
def test_no_people(skeleton):
    none = answer(People2D.empty(skeleton)).people
    assert none.skeleton is skeleton and none.xyz.shape == (0, len(skeleton.joints), 3)


@SKELETONS
def test_joints_that_both_sets_have_are_those_of_coco_18(skeleton):
    result, expected = estimate(skeleton), estimate(COCO_18)
    assert result.people.skeleton is skeleton and result.people_2d.skeleton is skeleton
    for name in set(skeleton.joints) & set(COCO_18.joints):
        status, xyz, sigma = joint(result, name)
        assert status == MEASURED
        # a face tells more of the depth of the shoulders than none
        np.testing.assert_allclose(xyz, joint(expected, name)[1], atol=0.03, err_msg=name)
        np.testing.assert_allclose(xyz, truth()[name], atol=0.06, err_msg=name)
        assert sigma == pytest.approx(joint(expected, name)[2], rel=0.1)


@pytest.mark.parametrize('skeleton, name', [(BODY_25, 'mid_hip'), (MPI_15, 'chest')])
def test_joints_of_the_trunk_are_between_shoulders_and_hips(skeleton, name):
    status, xyz, sigma = joint(estimate(skeleton), name)
    assert status == MEASURED
    assert np.linalg.norm(xyz - truth()[name]) < 0.04 and 0.02 <= sigma < 0.06
    assert np.isfinite(estimate(skeleton).people.velocity[0, skeleton.index[name]]).all()


def test_the_top_of_the_head_is_measured():
    status, xyz, sigma = joint(estimate(MPI_15), 'head_top')
    assert status == MEASURED
    assert np.linalg.norm(xyz - truth()['head_top']) < 0.1 and sigma > 0


@SKELETONS
def test_a_person_who_is_hidden_is_inferred_with_the_joints_that_can_be(skeleton):
    depth, estimator = scene().depth, new_estimator()
    for i in range(6):
        shown = i < 4
        result = update(estimator, scene(), i / RATE, people_2d(skeleton) if shown else People2D.empty(skeleton),
                        depth if shown else np.full_like(depth, 1500))
    assert len(result.people) == 1 and len(result.people_2d) == 0
    common = [name != 'head_top' for name in skeleton.joints]
    np.testing.assert_array_equal(result.people.status[0, common], INFERRED)
    assert not result.people.confidence.any()
    assert not (result.people.status == MEASURED).any()

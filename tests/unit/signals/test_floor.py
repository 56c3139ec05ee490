"""Where people are on the floor, and how they are turned: below the trunk, x to where the body faces, z upwards."""
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from animated_skeleton import ADULT, CHILD, FACE, LYING, SITTING, STANDING, UP, Limb, held, people_of, watch, without
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.person import Surroundings
from openpose_ros_signals.reader import SignalReader

GROUND = np.array([0.0, 0.0, 1.0, 0.0])
BOW = replace(STANDING, left=Limb((0.0, 1.0, 0.0), (0.0, 1.0, 0.0)), facing=50.0, place=(2.0, -1.0))


def pose_of(pose, floor=None, hidden=(), missing=(), stature=ADULT):
    """Return the pose on the floor of a person that holds a pose for a second."""
    random, reader = np.random.RandomState(1), SignalReader()
    for frame in range(10):
        people = without(people_of([pose], [1], random, hidden, stature), missing)
        (person,) = reader.update(people, frame / 10, UP, Surroundings(floor=floor))
    return person.floor


def axes_of(found):
    """Return the axes of a pose, (3, 3), one per row."""
    return Rotation.from_quat(found.orientation).apply(np.eye(3))


def test_no_joint_no_pose():
    assert pose_of(STANDING, missing=COCO_18.joints) is None


@pytest.mark.parametrize('facing', [50.0, 180.0, -90.0])
def test_below_the_trunk_and_turned_to_where_the_body_faces(facing):
    found = pose_of(replace(STANDING, facing=facing, place=(2.0, -1.0)), GROUND)
    np.testing.assert_allclose(found.position, [2.0, -1.0, 0.0], atol=0.03)
    turn = np.radians(facing)
    np.testing.assert_allclose(axes_of(found), [[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], UP],
                               atol=0.1)
    np.testing.assert_allclose(axes_of(found)[2], UP, atol=1e-9)


@pytest.mark.parametrize('pose, stature, hidden', [
    (STANDING, ADULT, ()), (STANDING, CHILD, ()), (SITTING, CHILD, ()), (LYING, ADULT, ()),
    (STANDING, ADULT, ('knee', 'ankle'))])
def test_without_a_plane_the_body_tells_the_floor(pose, stature, hidden):
    """The lowest joint of the skeleton is 6 cm over the floor, ankles of people in shoes are 11 cm over it."""
    assert pose_of(pose, hidden=hidden, stature=stature).position[2] == pytest.approx(0.0, abs=0.08)


def test_a_half_hidden_person_has_a_pose():
    found = pose_of(replace(STANDING, place=(2.0, -1.0)), GROUND, hidden=COCO_18.joints)
    np.testing.assert_allclose(found.position, [2.0, -1.0, 0.0], atol=0.25)
    head = pose_of(replace(STANDING, place=(2.0, -1.0)), GROUND, missing=[
        name for name in COCO_18.joints if name not in FACE])
    np.testing.assert_allclose(head.position, [2.0, -1.0, 0.0], atol=0.2)


def test_with_a_hidden_facing_the_walk_gives_the_direction():
    walk = held((0.0, replace(STANDING, place=(0.0, 0.0))), (2.0, replace(STANDING, place=(0.0, 2.0))))
    _, person = watch(walk, 1.5, hidden=('shoulder',))[-1]
    assert person.body is None
    np.testing.assert_allclose(axes_of(person.floor)[0], [0.0, 1.0, 0.0], atol=0.1)


def test_without_any_direction_it_is_that_of_the_frame():
    np.testing.assert_allclose(axes_of(pose_of(BOW, hidden=('shoulder',))), np.eye(3), atol=1e-9)
    # on the back the body faces upwards
    np.testing.assert_allclose(axes_of(pose_of(replace(LYING, facing=50.0))), np.eye(3), atol=1e-9)

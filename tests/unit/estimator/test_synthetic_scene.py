"""The synthetic scenes: depth, pixels and labels are what geometry says, so that tests may rely on them."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.skeletons import COCO_18
from synthetic_scene import (
    HIDDEN_BY_SELF,
    OUTSIDE,
    SCENERY,
    VISIBLE,
    Person,
    Room,
    pinhole,
    render,
    standing,
)

CAMERA = pinhole()
INDEX = COCO_18.index
ROOM = Room(floor=1.2, wall=5.0)
ALONE = Person(7, 0.2, 2.5, standing())


def labels(frame, person, *joints):
    """Return the labels of some joints, as a list."""
    return [int(frame.vis[person, INDEX[joint]]) for joint in joints]


def test_pixels_are_the_projected_joints_in_the_order_of_the_skeleton():
    frame = render(CAMERA, [ALONE], ROOM)
    assert frame.people.skeleton is COCO_18 and frame.ids.tolist() == [7]
    assert frame.people.present.all() and (frame.people.confidence == 1).all()
    np.testing.assert_allclose(frame.people.xy[0], CAMERA.project(frame.xyz[0]), atol=1e-3)
    left, right = frame.people.xy[0, INDEX['left_wrist']], frame.people.xy[0, INDEX['right_wrist']]
    assert left[0] > right[0], 'the left hand of a person who looks at the camera is on the right'


@pytest.mark.parametrize('joint, depth, tolerance', [
    ('nose', 0.0, 0.01), ('right_eye', 0.0, 0.01), ('right_wrist', 0.035, 0.01), ('left_elbow', 0.045, 0.015),
    ('right_shoulder', 0.06, 0.01), ('left_knee', 0.07, 0.015), ('right_hip', 0.1, 0.01),
    ('left_ankle', 0.05, 0.015)])
def test_joints_lie_under_the_surface_as_in_people(joint, depth, tolerance):
    frame = render(CAMERA, [ALONE], ROOM)
    u, v = np.round(frame.people.xy[0, INDEX[joint]]).astype(int)
    assert frame.xyz[0, INDEX[joint], 2] - frame.depth[v, u] / 1000 == pytest.approx(depth, abs=tolerance)


def test_the_far_arm_of_a_person_who_looks_aside_is_hidden_by_the_body():
    frame = render(CAMERA, [replace(ALONE, x=0.0, yaw=np.pi / 2, pose=standing(2))], ROOM)
    assert frame.xyz[0, INDEX['nose'], 0] > frame.xyz[0, INDEX['neck'], 0], 'looks to the right of the picture'
    # the trunk is in front of the left arm
    assert labels(frame, 0, 'left_shoulder', 'left_elbow', 'right_shoulder', 'right_elbow', 'right_wrist') == [
        HIDDEN_BY_SELF, HIDDEN_BY_SELF, VISIBLE, VISIBLE, VISIBLE]


def test_people_cut_by_the_border_lack_joints_and_people_outside_are_left_out():
    frame = render(CAMERA, [Person(1, 40, 3, standing()), Person(2, -2.65, 3, standing())], ROOM)
    assert frame.ids.tolist() == [2] and len(frame.people) == len(frame.xyz) == 1
    present = frame.people.present[0]
    assert 0 < present.sum() < 18 and not present[INDEX['right_wrist']] and present[INDEX['left_wrist']]
    np.testing.assert_array_equal(present, frame.vis[0] != OUTSIDE)
    assert set(np.unique(frame.owner)) == {SCENERY, 0}

"""Things before the body: a sheet that a person holds is not the trunk, an arm is, and so is the lap of who sits."""
import numpy as np
import pytest

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.body import HEAD, JOINTS
from skeleton_extract_3d.lift.detached import falls_along
from skeleton_extract_3d.lift.lifting import LiftingParams, make_lifting
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.lift.records import Expectation
from skeleton_extract_3d.points.depth import DepthImage
from synthetic_scene import VISIBLE, Box, Person, Pose, Room, pinhole, pointing, render, seated, standing, walking

CAMERA = pinhole(640, 360)
BODY, SHEET = 2.8, 2.45  # distance of the person and of the sheet [m]
HIPS, KNEES, SHOULDERS = ({f'{side}_{name}' for side in ('left', 'right')} for name in ('hip', 'knee', 'shoulder'))


def folded_arm():
    """Return a pose with the left forearm across the trunk."""
    rest = standing(8)
    return Pose(rest.upper_arms, np.stack([rest.forearms[0], pointing(60, -40, 1)]), rest.thighs, rest.shins)


def scene(top=None, bottom=None, pose=None):
    """Return a standing person, behind a sheet from top to bottom (y [m], downwards from the camera) if given."""
    sheet = () if top is None else (Box((-0.4, top, SHEET), (0.4, bottom, SHEET + 0.02)),)
    return render(CAMERA, [Person(1, 0.0, BODY, pose or standing(25))], Room(floor=1.2, wall=4.5, furniture=sheet))


def points_of(frame):
    return DepthImage(frame.depth, frame.camera)


def detached(frame, people=None):
    """Return the names of the joints behind a thing."""
    seen = observe(frame.people if people is None else people, frame.size, points_of(frame), frame.camera)
    return {JOINTS[joint] for joint in np.flatnonzero(seen.detached.any(axis=(0, 2)))}


def lifted(frame):
    seen = observe(frame.people, frame.size, points_of(frame), frame.camera)
    with np.errstate(invalid='ignore'):
        return make_lifting(LiftingParams(), True)(seen, points_of(frame), Expectation.of_strangers(1))


@pytest.mark.parametrize('pose', [standing(), walking(0.6), walking(2.0), seated(), folded_arm()])
@pytest.mark.parametrize('yaw', [0.0, 0.7, np.pi / 2, np.pi])
def test_visible_joints_are_behind_no_part_of_the_own_body(pose, yaw):
    frame = render(CAMERA, [Person(1, 0.0, BODY, pose, yaw)], Room(wall=4.5))
    assert not detached(frame) & {JOINTS[joint] for joint in np.flatnonzero(frame.vis[0] == VISIBLE)}


def test_no_people():
    frame = scene()
    people = People2D.empty(COCO_18)
    assert observe(people, frame.size, points_of(frame), frame.camera).detached.shape == (0, 18, 25)


@pytest.mark.parametrize('bottom, hidden', [(0.5, HIPS), (1.1, HIPS | KNEES)])
def test_a_sheet_from_the_chest_down_is_before_the_hips(bottom, hidden):
    """It hides the knees as well where it reaches so far; without it they would be measured on its surface."""
    assert detached(scene(-0.05, bottom)) & (SHOULDERS | HIPS | KNEES) == hidden


@pytest.mark.parametrize('top, score', [(-0.33, 1.0), (-0.6, 0.4)])
def test_a_sheet_up_to_the_face_is_before_the_shoulders(top, score):
    """Also where it hides the head, which networks then find with low scores."""
    frame = scene(top, 0.5)
    keypoints = frame.people.keypoints.copy()
    keypoints[:, HEAD, 2] = score
    assert detached(frame, People2D(COCO_18, keypoints, [1], [-1])) >= SHOULDERS | HIPS | {'neck'}


@pytest.mark.parametrize('top, bottom', [(-0.05, 0.5), (-0.05, 1.1), (-0.33, 0.5)])
def test_joints_behind_a_sheet_are_inferred_near_their_place(top, bottom):
    frame = scene(top, bottom)
    result = lifted(frame)
    behind = [JOINTS.index(name) for name in detached(frame)]
    assert len(behind) >= 2 and not result.measured[0, behind].any()
    sheet = np.linalg.norm(frame.xyz[0, behind] * (SHEET / frame.xyz[0, behind, 2:]) - frame.xyz[0, behind], axis=1)
    error = np.linalg.norm(result.xyz[0, behind] - frame.xyz[0, behind], axis=1)
    assert (error < sheet / 2).all() and error.max() < 0.18


def test_a_narrow_thing_before_one_hip_is_an_arm_or_a_hand():
    x, y, _ = scene().xyz[0, JOINTS.index('left_hip')]
    hand = Box((x - 0.04, y - 0.05, SHEET), (x + 0.04, y + 0.05, SHEET + 0.02))
    frame = render(CAMERA, [Person(1, 0.0, BODY, standing(25))], Room(wall=4.5, furniture=(hand,)))
    assert not detached(frame) & HIPS


def falls(depth):
    """Return the fall from left to right over an image of one row's depths [m]."""
    image = np.round(1000 * np.tile(depth, (5, 1))).astype(np.uint16)
    ends = np.array([[0.0, 2.0], [len(depth) - 1.0, 2.0]])
    return float(falls_along(DepthImage(image, pinhole(len(depth), 5)), *ends))


def test_steps_are_summed_with_their_sign():
    flat = np.full(100, 2.0)
    step, arm, hole = flat.copy(), flat.copy(), flat.copy()
    step[60:], arm[40:60], hole[40:60] = 1.7, 1.7, 0.0
    assert falls(step) == pytest.approx(0.3) and falls(step[::-1]) == pytest.approx(-0.3)
    assert falls(flat) == falls(arm) == falls(hole) == 0
    assert falls(np.linspace(2.0, 1.5, 100)) == 0, 'a slope has no step'
    assert falls(step + np.linspace(0, 0.2, 100)) == pytest.approx(0.1, abs=0.03), 'at most the whole fall'


def test_the_fall_on_an_unknown_way_is_unknown():
    points = points_of(scene())
    assert np.isnan(falls_along(points, np.full((2, 2), np.nan), np.zeros((2, 2)))).all()

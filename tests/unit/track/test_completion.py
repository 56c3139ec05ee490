"""Joints without a keypoint and people out of sight: where they are put, how sure that is, and for how long."""
from dataclasses import replace

import numpy as np
import pytest

from estimating import tracks_of
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.body import JOINTS
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.settings import SmoothingParams
from skeleton_extract_3d.track.completion import Completion, complete, walk_on
from synthetic_scene import Person, Room, joints_of, pinhole, render, standing

INDEX = COCO_18.index
DT = 0.1
CAMERA = pinhole(320, 180)


def person(x=0.0, z=2.6, scale=1.0, **values):
    """Return the joints of a person who stands, (18, 3) [m]."""
    joints = joints_of(Person(1, x, z, standing(5), scale=scale, **values), 1.2)
    return np.array([joints[name] for name in JOINTS])


def tracks(*xyz, has=True, stamp=0.0, velocity=(0, 0, 0), stature=1.75):
    """Return tracks of people that know the joints of a mask and walk."""
    result = tracks_of(xyz, stamp, has, stature)
    joints, root = (each._replace(velocity=np.zeros_like(each.velocity) + velocity)
                    for each in (result.joints, result.root))
    return replace(result, joints=joints, root=root)


def only(*names):
    """Return a mask of joints, (1, 18)."""
    return np.isin(JOINTS, names)[None]


def completed(one, trusted, stamp=DT, elapsed=DT, timeout=5.0):
    """Return the track with all joints, which joints are placed, and the errors of all, (18,) each."""
    seen = Completion(one, trusted, trusted, np.where(one.has | trusted, 0.03, np.nan))
    with np.errstate(invalid='ignore'):
        after = complete(seen, FrameView(room(), CAMERA, stamp, elapsed), timeout)
    return after.tracks, after.placed[0], after.sigma[0]


def off(one, xyz):
    """Return the distances of the joints of the first track, (18,) [m]."""
    return np.linalg.norm(one.joints.position[0] - xyz, axis=1)


# --- joints ---------------------------------------------------------------------------------------------------------

def test_of_a_new_person_with_shoulders_only_the_rest_is_where_bodies_have_it():
    trusted = only('left_shoulder', 'right_shoulder')
    one = tracks(person(), has=trusted)
    one, placed, sigma = completed(one, trusted, stamp=0.0, elapsed=0.0)
    head = [INDEX[name] for name in ('nose', 'left_eye', 'right_eye', 'left_ear', 'right_ear')]
    assert placed[np.setdiff1d(np.arange(18), head)].all() and not placed[head].any()
    distance = off(one, person())
    assert distance[INDEX['neck']] < 0.01 and distance[placed].max() < 0.15
    assert (distance[placed] < 2 * sigma[placed]).all()


def test_a_raised_arm_is_remembered_and_sinks():
    raised = person()
    raised[INDEX['left_elbow']] = raised[INDEX['left_shoulder']] + [0.25, -0.1, 0]
    raised[INDEX['left_wrist']] = raised[INDEX['left_elbow']] + [0, -0.25, 0]
    trusted, heights = ~only('left_elbow', 'left_wrist'), []
    one = tracks(raised)
    for i in range(1, 31):
        one, *_ = completed(one.predicted(DT, SmoothingParams()), trusted, stamp=i * DT)
        heights.append(raised[INDEX['left_shoulder'], 1] - one.joints.position[0, INDEX['left_wrist'], 1])
    assert heights[0] > 0.2, 'it is where it was'
    assert (np.diff(heights) < 1e-9).all()
    assert heights[-1] < -0.35, 'it hangs, three seconds later'


def test_a_hidden_joint_moves_along_with_its_parent():
    one, trusted = tracks(person(), velocity=(0.8, 0, 0)), ~only('left_wrist')
    velocity = one.joints.velocity.copy()
    velocity[0, INDEX['left_wrist']] = (-2, 0, 0)  # it was on its way elsewhere when it was lost
    one = replace(one, joints=one.joints._replace(velocity=velocity))
    for i in range(1, 6):
        one, *_ = completed(one.predicted(DT, SmoothingParams()), trusted, stamp=i * DT)
    moved = one.joints.position[0] - person()
    np.testing.assert_allclose(moved[INDEX['left_wrist']], moved[INDEX['left_elbow']], atol=0.06)
    np.testing.assert_allclose(one.joints.velocity[0, INDEX['left_wrist']], (0.8, 0, 0), atol=1e-6)


@pytest.mark.parametrize('joint', ['left_wrist', 'right_ankle', 'nose'])
def test_sigma_grows_up_to_that_of_a_new_person(joint):
    one, trusted, sigmas = tracks(person()), ~only(joint), []
    for i in range(1, 40):
        one, _, sigma = completed(one.predicted(DT, SmoothingParams()), trusted, stamp=i * DT)
        sigmas.append(sigma[INDEX[joint]])
        # it is the filter's as well
        assert one.joints.sigmas()[0, INDEX[joint]] == pytest.approx(sigmas[-1])
    assert (np.diff(sigmas) >= -1e-12).all() and sigmas[0] < 0.1 and sigmas[5] > 1.25 * sigmas[0]
    assert sigmas[-1] == sigmas[-2] < 0.3


# --- people out of sight --------------------------------------------------------------------------------------------

def room(wall=5.0, front=None):
    """Return the points of a room with a wall, and one in front that begins at an x [m]."""
    depth = render(CAMERA, [], Room(wall=wall, has_floor=False)).depth.copy()
    if front is not None:
        columns = np.arange(CAMERA.width)
        depth[:, (columns - 159.5) / 180 * 2.0 > front] = 2000
    return DepthImage(depth, CAMERA)


def unseen(those, points, frames=1, elapsed=DT):
    """Return tracks of people who are not detected for a number of frames, after each of them."""
    result = []
    for i in range(1, frames + 1):
        those = walk_on(those, FrameView(points, CAMERA, i * elapsed, elapsed))
        result.append(those)
    return result


def test_a_person_who_walks_behind_something_walks_on_ever_more_slowly_and_less_surely():
    start = tracks(person(x=-1.0, z=3.0), velocity=(1.0, 0, 0))
    after = unseen(start, room(wall=2.0), 40)
    x = np.array([one.root.position[0, 0, 0] for one in (start, *after)])
    steps = np.diff(x)
    assert steps[0] == pytest.approx(0.1, rel=0.15) and (np.diff(steps) < 0).all() and (steps > 0).all()
    # walks on for about that time
    assert x[-1] - x[0] == pytest.approx(METHOD.track.out_of_sight.stopping_time, abs=0.1)
    sigmas = np.array([one.joints.sigmas()[0] for one in after])
    assert (np.diff(sigmas, axis=0) > 0).all()
    # the person may have gone on, or stopped at once
    true = np.array([x[0] + 0.1 * np.arange(41), np.full(41, x[0])])
    assert (np.abs(true - x)[:, 1:20] < 2 * sigmas[:19].min(axis=1)).all()
    # of all joints, trunk and limbs move alike
    moved = after[-1].joints.position - start.joints.position
    np.testing.assert_allclose(moved, np.full((1, 18, 3), (x[-1] - x[0], 0, 0)), atol=1e-9)


@pytest.mark.parametrize('frames', [1, 2, 60])
def test_motion_out_of_sight_is_the_same_at_any_rate(frames):
    start, points = tracks(person(x=-1.0, z=3.0), velocity=(1.0, 0, 0)), room(wall=2.0)
    after, other = (unseen(start, points, count, 2 / count)[-1] for count in (frames, 20))
    np.testing.assert_allclose(after.root.position, other.root.position, atol=1e-9)
    np.testing.assert_allclose(after.root.velocity, other.root.velocity, atol=1e-9)


def test_hidden_people_do_not_walk_into_free_view():
    # a wall from the middle to the right hides a person who walks to the left and is not detected there: they stopped
    one = tracks(person(x=0.7, z=3.0), velocity=(-1.5, 0, 0))
    after = unseen(one, room(front=0.0), 30)
    assert 0.0 < after[-1].root.position[0, 0, 0] < 0.7
    # without the wall's end the person would have come out
    free = unseen(one, room(wall=2.0), 30)[-1]
    assert free.root.position[0, 0, 0] < -0.2

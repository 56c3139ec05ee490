"""Joints without a keypoint and people out of sight: where they are put, how sure that is, and for how long."""
import numpy as np
import pytest

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.body.body import JOINTS
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.track.completion import OcclusionParams, complete_joints, hidden_and_there, move_unseen
from skeleton_extract_3d.track.tracks import Tracks
from synthetic_scene import Person, Room, joints_of, pinhole, render, standing

INDEX = COCO_18.index
DT = 0.1
CAMERA = pinhole(320, 180)
LEGS = [INDEX[f'{side}_{joint}'] for side in ('left', 'right') for joint in ('knee', 'ankle')]
ROW = np.array([0])


def person(x=0.0, z=2.6, scale=1.0, **values):
    """Return the joints of somebody who stands, (18, 3) [m]."""
    joints = joints_of(Person(1, x, z, standing(5), scale=scale, **values), 1.2)
    return np.array([joints[name] for name in JOINTS])


def tracks(*xyz, has=True, stamp=0.0, velocity=(0, 0, 0), stature=1.75):
    """Return tracks of people that know the joints of a mask and walk."""
    result, count = Tracks(), len(xyz)
    if count:
        result.append(np.arange(count), stamp, np.stack(xyz), np.ones((count, 18), bool),
                      np.tile([1.0, 0, 0], (count, 1)), np.full(count, stature))
        result.has[:] = has
        result.sightings[:] = 10
        result.joints.velocity[:], result.root.velocity[:] = velocity, velocity
    return result


def only(*names):
    """Return a mask of joints, (1, 18)."""
    return np.isin(JOINTS, names)[None]


def completed(one, trusted, stamp=DT, elapsed=DT, **params):
    """Return which joints are placed, and the errors of all, (18,) each."""
    sigma = np.where(one.has, 0.03, np.nan)
    sigma[trusted] = 0.03
    with np.errstate(invalid='ignore'):
        placed = complete_joints(one, ROW, trusted, sigma, stamp, elapsed, OcclusionParams(**params))
    return placed[0], sigma[0]


def off(one, xyz):
    """Return the distances of the joints of the first track, (18,) [m]."""
    return np.linalg.norm(one.joints.position[0] - xyz, axis=1)


# --- joints ---------------------------------------------------------------------------------------------------------

def test_nobody():
    none = np.zeros((0, 18), bool)
    assert complete_joints(tracks(), np.zeros(0, int), none, np.zeros((0, 18)), 1.0, DT, OcclusionParams()
                           ).shape == (0, 18)


def test_where_all_joints_are_seen_nothing_is_filled_in():
    one = tracks(person())
    placed, sigma = completed(one, np.ones((1, 18), bool))
    assert placed.all() and (sigma == 0.03).all()
    np.testing.assert_array_equal(one.joints.position[0], person())


def test_of_a_stranger_hidden_legs_hang_down():
    upper = ~only(*(JOINTS[joint] for joint in LEGS))
    one = tracks(person(), has=upper)
    placed, sigma = completed(one, upper, stamp=0.0, elapsed=0.0)
    assert placed.all()
    # the model's thighs and shins are 2 cm shorter, and the scene's legs stand 3 degrees apart
    assert off(one, person())[LEGS].max() < 0.1
    assert (sigma[LEGS] > 0.15).all(), 'what a stranger does is not known'
    assert one.has.all()


def test_of_a_stranger_with_shoulders_only_the_rest_is_where_bodies_have_it():
    trusted = only('left_shoulder', 'right_shoulder')
    one = tracks(person(), has=trusted)
    placed, sigma = completed(one, trusted, stamp=0.0, elapsed=0.0)
    head = [INDEX[name] for name in ('nose', 'left_eye', 'right_eye', 'left_ear', 'right_ear')]
    assert placed[np.setdiff1d(np.arange(18), head)].all() and not placed[head].any()
    distance = off(one, person())
    assert distance[INDEX['neck']] < 0.01 and distance[placed].max() < 0.15
    assert (distance[placed] < 2 * sigma[placed]).all()


@pytest.mark.parametrize('shown, hidden', [
    (('left_hip', 'right_hip'), 'neck'), (('left_shoulder',), 'right_shoulder'), (('right_hip', 'neck'), 'left_hip'),
    (('nose', 'left_ear', 'right_ear'), 'neck')])
def test_one_part_of_the_trunk_tells_where_the_others_are(shown, hidden):
    trusted = only(*shown)
    one = tracks(person(), has=trusted)
    placed, sigma = completed(one, trusted, stamp=0.0, elapsed=0.0)
    assert placed[INDEX[hidden]]
    assert off(one, person())[INDEX[hidden]] < 0.06 < sigma[INDEX[hidden]]


@pytest.mark.parametrize('scale', [0.6, 1.1])
def test_limbs_are_as_long_as_the_stature_says(scale):
    trusted = only('left_shoulder', 'right_shoulder', 'left_hip', 'right_hip')
    one = tracks(person(scale=scale), has=trusted, stature=1.75 * scale)
    completed(one, trusted, stamp=0.0, elapsed=0.0)
    position = one.joints.position[0]
    # thigh of an adult of 1.70 m
    length = np.linalg.norm(position[INDEX['left_hip']] - position[INDEX['left_knee']])
    assert length == pytest.approx(0.394 * 1.75 / 1.70 * scale, rel=0.01)


def test_without_any_known_joint_nothing_is_placed():
    one = tracks(person(), has=False)
    placed, _ = completed(one, np.zeros((1, 18), bool))
    assert not placed.any()


def test_a_raised_arm_is_remembered_and_sinks():
    raised = person()
    raised[INDEX['left_elbow']] = raised[INDEX['left_shoulder']] + [0.25, -0.1, 0]
    raised[INDEX['left_wrist']] = raised[INDEX['left_elbow']] + [0, -0.25, 0]
    trusted, heights = ~only('left_elbow', 'left_wrist'), []
    one = tracks(raised)
    for i in range(1, 31):
        one.predict(DT, 4.0, 3.0)
        completed(one, trusted, stamp=i * DT)
        heights.append(raised[INDEX['left_shoulder'], 1] - one.joints.position[0, INDEX['left_wrist'], 1])
    assert heights[0] > 0.2, 'it is where it was'
    assert (np.diff(heights) < 1e-9).all()
    assert heights[-1] < -0.35, 'it hangs, three seconds later'


def test_a_hidden_joint_moves_along_with_its_parent():
    one, trusted = tracks(person(), velocity=(0.8, 0, 0)), ~only('left_wrist')
    one.joints.velocity[0, INDEX['left_wrist']] = (-2, 0, 0)  # it was on its way elsewhere when it was lost
    for i in range(1, 6):
        one.predict(DT, 4.0, 3.0)
        completed(one, trusted, stamp=i * DT)
    moved = one.joints.position[0] - person()
    np.testing.assert_allclose(moved[INDEX['left_wrist']], moved[INDEX['left_elbow']], atol=0.06)
    np.testing.assert_allclose(one.joints.velocity[0, INDEX['left_wrist']], (0.8, 0, 0), atol=1e-6)


@pytest.mark.parametrize('joint', ['left_wrist', 'right_ankle', 'nose'])
def test_sigma_grows_up_to_that_of_a_stranger(joint):
    one, trusted, sigmas = tracks(person()), ~only(joint), []
    for i in range(1, 40):
        one.predict(DT, 4.0, 3.0)
        _, sigma = completed(one, trusted, stamp=i * DT)
        sigmas.append(sigma[INDEX[joint]])
        # it is the filter's as well
        assert one.joints.sigmas()[0, INDEX[joint]] == pytest.approx(sigmas[-1])
    assert (np.diff(sigmas) >= -1e-12).all() and sigmas[0] < 0.1 and sigmas[5] > 1.25 * sigmas[0]
    assert sigmas[-1] == sigmas[-2] < 0.3


def test_the_end_of_a_limb_is_less_sure_than_its_middle():
    one = tracks(person())
    for i in range(1, 20):
        _, sigma = completed(one, ~only('left_knee', 'left_ankle'), stamp=i * DT)
        assert sigma[INDEX['left_ankle']] > sigma[INDEX['left_knee']] > sigma[INDEX['left_hip']] == 0.03


@pytest.mark.parametrize('timeout', [0.5, 2.0])
def test_after_a_while_a_joint_is_missing(timeout):
    one, trusted = tracks(person()), ~only('left_wrist')
    stamps = np.arange(1, 31) * DT
    placed = [completed(one, trusted, stamp=stamp, inference_timeout=timeout)[0][INDEX['left_wrist']]
              for stamp in stamps]
    np.testing.assert_array_equal(placed, stamps <= timeout)


def test_the_time_of_a_joint_that_was_never_seen_begins_with_the_person():
    trusted = ~only('left_wrist')
    one = tracks(person(), has=trusted, stamp=10.0)
    assert completed(one, trusted, stamp=10.5, inference_timeout=1.0)[0][INDEX['left_wrist']]
    assert not completed(one, trusted, stamp=11.1, inference_timeout=1.0)[0][INDEX['left_wrist']]


def test_without_a_timeout_nothing_is_inferred_after_the_frame():
    one, trusted = tracks(person()), ~only('left_wrist')
    assert not completed(one, trusted, inference_timeout=0.0)[0][INDEX['left_wrist']]


# --- people out of sight --------------------------------------------------------------------------------------------

def room(wall=5.0, front=None):
    """Return the points of a room with a wall, and one in front that begins at an x [m]."""
    depth = render(CAMERA, [], Room(wall=wall, has_floor=False)).depth.copy()
    if front is not None:
        columns = np.arange(CAMERA.width)
        depth[:, (columns - 159.5) / 180 * 2.0 > front] = 2000
    return DepthImage(depth, CAMERA)


def unseen(one, points, frames=1, elapsed=DT, start=0.0):
    """Move people who are not detected; return the errors and who is there, after each frame."""
    rows, result = np.arange(len(one)), []
    for i in range(1, frames + 1):
        sigma = np.zeros((len(one), 18))
        one.predict(elapsed, 4.0, 3.0)
        move_unseen(one, rows, sigma, points, CAMERA, start + i * elapsed, elapsed)
        result.append((sigma, hidden_and_there(one, rows, points, CAMERA)))
    return result


def test_nobody_is_out_of_sight():
    none = np.zeros(0, int)
    move_unseen(tracks(), none, np.zeros((0, 18)), room(), CAMERA, 1.0, DT)
    assert hidden_and_there(tracks(), none, room(), CAMERA).shape == (0,)


def test_somebody_behind_a_wall_is_there():
    one = tracks(person(z=3.0))
    assert hidden_and_there(one, ROW, room(wall=2.0), CAMERA).tolist() == [True]


def test_somebody_whose_place_is_in_plain_view_is_not_there():
    one = tracks(person(z=3.0))
    assert hidden_and_there(one, ROW, room(wall=5.0), CAMERA).tolist() == [False]


def test_who_stands_right_before_the_wall_could_be_overlooked():
    # the surface is the person's own, or almost
    one = tracks(person(z=3.0))
    assert hidden_and_there(one, ROW, room(wall=3.2), CAMERA).tolist() == [True]


def test_without_depth_somebody_may_be_there():
    points = DepthImage(np.zeros((180, 320), np.uint16), CAMERA)
    assert hidden_and_there(tracks(person(z=3.0)), ROW, points, CAMERA).tolist() == [True]


@pytest.mark.parametrize('x', [-8.0, 8.0])
def test_who_left_the_picture_is_not_there(x):
    assert hidden_and_there(tracks(person(x=x, z=3.0)), ROW, room(wall=2.0), CAMERA).tolist() == [False]


def test_who_was_hardly_seen_is_not_there():
    one = tracks(person(z=3.0))
    one.sightings[:] = 1
    assert hidden_and_there(one, ROW, room(wall=2.0), CAMERA).tolist() == [False]


def test_who_walks_behind_something_walks_on_ever_more_slowly_and_less_surely():
    one = tracks(person(x=-1.0, z=3.0), velocity=(1.0, 0, 0))
    positions, sigmas = [], []
    for sigma, there in unseen_one_by_one(one, room(wall=2.0), 40):
        positions.append(one.root.position[0, 0, 0])
        sigmas.append(sigma[0])
        assert there[0]
    steps = np.diff([-1.0, *positions])
    assert steps[0] == pytest.approx(0.1, rel=0.15) and (np.diff(steps) < 0).all() and (steps > 0).all()
    # walks on for about a second
    assert positions[-1] - -1.0 == pytest.approx(1.0, abs=0.15)
    assert (np.diff(sigmas, axis=0) > 0).all()
    # of all joints, trunk and limbs move alike
    np.testing.assert_allclose(one.joints.position[0] - person(z=3.0), np.tile(one.root.position[0] - 0, (18, 1))
                               - person(z=3.0)[[INDEX[name] for name in (
                                   'neck', 'left_shoulder', 'right_shoulder', 'left_hip', 'right_hip')]].mean(axis=0),
                               atol=1e-9)


def unseen_one_by_one(one, points, frames):
    """Yield what `unseen` returns for a frame, frame by frame."""
    for i in range(frames):
        yield unseen(one, points, start=i * DT)[0]


def test_nobody_runs_out_of_sight():
    one = tracks(person(x=-1.0, z=3.0), velocity=(9.0, 0, 0))
    unseen(one, room(wall=2.0))
    assert one.root.position[0, 0, 0] + 1.0 <= 2.0 * DT + 1e-9


def test_hidden_people_do_not_walk_into_free_view():
    # a wall from the middle to the right hides somebody who walks to the left: as nobody is seen, the person stopped
    one = tracks(person(x=0.7, z=3.0), velocity=(-1.5, 0, 0))
    seen = unseen(one, room(front=0.0), 30)
    assert all(there[0] for _, there in seen)
    assert 0.0 < one.root.position[0, 0, 0] < 0.7
    # without the wall's end the person would have come out
    free = tracks(person(x=0.7, z=3.0), velocity=(-1.5, 0, 0))
    unseen(free, room(wall=2.0), 30)
    assert free.root.position[0, 0, 0] < -0.5


def test_who_stands_in_free_view_when_lost_is_not_held_back():
    one = tracks(person(x=0.0, z=3.0), velocity=(1.0, 0, 0))
    unseen(one, room(wall=5.0), 5)
    assert one.root.position[0, 0, 0] > 0.3


def test_people_out_of_sight_move_each_for_themselves():
    two = tracks(person(x=-1.0, z=3.0), person(x=0.5, z=3.5))
    two.root.velocity[:, 0] = [(1.0, 0, 0), (0, 0, 0.5)]
    unseen(two, room(wall=2.0), 3)
    moved = two.root.position[:, 0] - [person(x, z)[[1, 2, 5, 8, 11]].mean(axis=0) for x, z in ((-1, 3), (0.5, 3.5))]
    assert moved[0, 0] > 0.2 and abs(moved[0, 2]) < 1e-9
    assert moved[1, 2] > 0.1 and abs(moved[1, 0]) < 1e-9


@pytest.mark.parametrize('values', [{'hidden_min_score': 1.5}, {'measured_min_score': -0.1},
                                    {'inference_timeout': -1.0}, {'occlusion': 1}], ids=str)
def test_parameters_out_of_range_are_refused(values):
    with pytest.raises(ParameterError, match=next(iter(values))):
        OcclusionParams(**values)

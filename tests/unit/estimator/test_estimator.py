"""The switches of the estimator, and what it promises whatever they are; edges are in test_estimator_edges.py."""
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from estimating import new_estimator, update
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.lift.window_mean import lift_by_window
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.settings import EstimatorSettings
from synthetic_scene import VISIBLE, Box, Person, Room, moved_pixels, pinhole, render, standing, without_joints

RATE = 15.0
INDEX = COCO_18.index
CAMERA = pinhole(320, 180)
NO_PEOPLE = People2D.empty(COCO_18)
FREE = Room(wall=4.0)
COUNTER = Room(wall=4.0, furniture=(Box((-1.5, 0.4, 1.6), (1.5, 1.2, 2.0)),))
ORIGINAL = {'lifting': 'mean3x3', 'tracking': False}
WALKERS = ((-0.8, 2.6), (0.6, 3.0))
POSE = standing()


@lru_cache(maxsize=None)
def scene(*places, room=FREE):
    """Return people who stand at (x, z)."""
    return render(CAMERA, [Person(i, x, z, POSE) for i, (x, z) in enumerate(places or [(0.1, 2.6)])], room)


def shown(frame, frames=5, start=0.0, estimator=None, people=None, depth=None, **values):
    """Return the estimate after a frame was shown for a while."""
    estimator = estimator or new_estimator(**values)
    for i in range(frames):
        estimate = update(estimator, frame, start + i / RATE, people, depth)
    return estimate


def named(people, *ids):
    return replace(people, ids=np.array(ids))


def errors(estimate, frame):
    return np.linalg.norm(estimate.people.xyz - frame.xyz, axis=2)


# --- no people ------------------------------------------------------------------------------------------------------


# --- lifting --------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('window, statistic', [(3, 'mean'), (5, 'median')])
def test_the_original_method_without_tracking_is_lift(window, statistic):
    frame = scene(*WALKERS, room=COUNTER)
    people = named(frame.people, 7, 3)
    points = DepthImage(frame.depth, frame.camera)
    expected = lift_by_window(people, frame.size, points, window, statistic)
    estimate = shown(frame, 3, people=people, window=window, statistic=statistic, **ORIGINAL)
    for name in ('xyz', 'confidence', 'status', 'sigma', 'ids'):
        np.testing.assert_array_equal(getattr(estimate.people, name), getattr(expected, name), name)
    np.testing.assert_array_equal(estimate.people_2d.keypoints, people.keypoints)


def test_the_original_method_with_occlusion_leaves_hidden_joints_where_robust_lifting_has_them():
    frame = scene(room=COUNTER)
    seen = frame.vis == VISIBLE
    robust, original = (shown(frame, lifting=lifting, smoothing=False).people for lifting in ('robust', 'mean3x3'))
    assert (original.status[seen] == MEASURED).all() and not (original.status[~seen] == MEASURED).any()
    window = lift_by_window(frame.people, frame.size, DepthImage(frame.depth, frame.camera))
    np.testing.assert_allclose(original.xyz[seen], window.xyz[seen], atol=0.03)
    np.testing.assert_allclose(original.xyz[~seen], robust.xyz[~seen], atol=0.1)


# --- occlusion ------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('lifting', ['robust', 'mean3x3'])
@pytest.mark.parametrize('missing', [(), ('left_wrist', 'nose')])
def test_without_occlusion_nothing_is_inferred(lifting, missing):
    frame = scene(room=COUNTER)
    people = without_joints(frame.people, np.isin(COCO_18.joints, missing)[None])
    estimate = shown(frame, people=people, lifting=lifting, occlusion=False)
    assert not (estimate.people.status == INFERRED).any()
    assert (estimate.people.status[:, np.isin(COCO_18.joints, missing)] == MISSING).all()
    visible = (frame.vis == VISIBLE) & people.present
    assert (estimate.people.status[visible] == MEASURED).all()
    # the original method leaves joints on the skin, and mixes feet with what is beside them
    assert np.nanmedian(errors(estimate, frame)[visible]) < (0.03 if lifting == 'robust' else 0.1)


@pytest.mark.parametrize('score, status', [(0.9, MEASURED), (0.25, MEASURED), (0.15, INFERRED)])
def test_keypoints_below_a_score_do_not_measure(score, status):
    frame = scene()
    keypoints = frame.people.keypoints.copy()
    keypoints[0, INDEX['left_knee'], 2] = score
    estimate = shown(frame, people=People2D(COCO_18, keypoints, [1], [-1]))
    assert estimate.people.status[0, INDEX['left_knee']] == status
    assert errors(estimate, frame)[0, INDEX['left_knee']] < 0.1


# --- tracking -------------------------------------------------------------------------------------------------------

def test_without_tracking_nothing_is_remembered():
    estimator, frame, other = new_estimator(tracking=False), scene((0.1, 2.6)), scene((0.5, 3.4))
    shown(frame, estimator=estimator, people=named(frame.people, 3))
    alone = update(new_estimator(tracking=False), other, 0.0, named(other.people, 3)).people
    after = update(estimator, other, 1.0, named(other.people, 3)).people
    for name in ('xyz', 'status', 'sigma', 'ids', 'velocity'):
        np.testing.assert_array_equal(getattr(after, name), getattr(alone, name), name)
    wall = np.full_like(frame.depth, 1500)
    assert len(update(estimator, frame, 1.1, NO_PEOPLE, wall).people) == 0


def test_a_person_who_shows_too_few_joints_gets_no_id():
    frame = scene()
    few = without_joints(frame.people, ~np.isin(COCO_18.joints, ('neck', 'left_shoulder', 'right_shoulder'))[None])
    assert len(shown(frame, people=few).people_2d) == 1
    # of measured joints: keypoints on the wall do not count
    keypoints = frame.people.keypoints.copy()
    keypoints[0, [INDEX[name] for name in COCO_18.joints if 'wrist' in name or 'ankle' in name], 0] += 70
    odd = without_joints(People2D(COCO_18, keypoints, [1], [-1]), ~np.isin(
        COCO_18.joints, ('neck', 'left_wrist', 'right_wrist', 'left_ankle', 'right_ankle'))[None])
    five = replace(METHOD, track=replace(METHOD.track, identity=replace(METHOD.track.identity, birth_joints=5)))
    assert len(shown(frame, 1, estimator=PeopleEstimator(build(EstimatorSettings, {}), method=five),
                     people=odd).people_2d) == 0


@pytest.mark.parametrize('told', [True, False])
def test_people_stand_still_before_a_camera_that_moves_and_tells(told):
    # it rolls to the right at 1.5 m/s
    estimator, velocities, ids = new_estimator(), [], set()
    for i in range(10):
        moved = 1.5 * i / RATE
        frame = scene((0.6 - moved, 2.6))
        pose = (np.eye(3), np.array([moved, 0.0, 0.0])) if told else None
        people = update(estimator, frame, i / RATE, tracking_from_points=pose).people
        ids.update(people.ids.tolist())
        velocities.append(people.velocity[0, INDEX['neck']])
        assert np.median(np.linalg.norm(people.xyz - frame.xyz, axis=2)) < 0.06
    assert ids == {1}
    # velocities are those in the room, in the axes of the points
    np.testing.assert_allclose(velocities[-1], (0, 0, 0) if told else (-1.5, 0, 0), atol=0.3)


# --- smoothing ------------------------------------------------------------------------------------------------------

def test_without_smoothing_positions_are_those_of_the_frame():
    rng, estimator, frame = np.random.default_rng(0), new_estimator(smoothing=False), scene()
    for i in range(5):
        people = moved_pixels(frame.people, rng, sigma=1.0)
        xyz = update(estimator, frame, i / RATE, people).people.xyz[0]
        alone = update(new_estimator(tracking=False, smoothing=False), frame, 0.0, people).people.xyz[0]
        # on the rays of the keypoints, and measured at the same surfaces; the stature, by which depths under the skin
        # grow, is known better and better: 10 % of 11 cm
        np.testing.assert_allclose(CAMERA.project(xyz), people.xy[0], atol=0.01)
        np.testing.assert_allclose(xyz[:, 2], alone[:, 2], atol=0.015)


# --- reconfiguration ------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('values', [{'smoothing': False}, {'occlusion': False}, {'lifting': 'mean3x3'}], ids=str)
def test_parameters_that_change_while_it_runs_keep_the_ids(values):
    frame, estimator = scene(*WALKERS), new_estimator()
    before = shown(frame, estimator=estimator).people.ids.tolist()
    estimator.reconfigure(build(EstimatorSettings, values))
    changed = shown(frame, 5, 1.0, estimator).people
    assert changed.ids.tolist() == before
    # and the new ones are those that count
    expected = shown(frame, **values).people
    np.testing.assert_array_equal(changed.status, expected.status)
    np.testing.assert_allclose(changed.xyz, expected.xyz, atol=0.03)
    estimator.reconfigure(build(EstimatorSettings, {}))
    assert update(estimator, frame, 2.0).people.ids.tolist() == before

"""What looks and points tell of the existence of tracks; the lives of people are in estimator/test_lives.py."""
from dataclasses import replace

import numpy as np
import pytest

from estimating import tracks_of
from openpose_ros_pkg.detect.existence import EXISTENCE
from openpose_ros_pkg.detect.tracking import TRACKING
from skeleton_extract_3d.body.body import JOINTS
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.lift.lifting import lift_robustly
from skeleton_extract_3d.lift.observation import observe
from skeleton_extract_3d.lift.records import Expectation
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.track.existence import (
    after_time,
    evidence_of,
    relief_of,
    views_at,
    views_of,
    with_detection,
    without_detection,
)
from skeleton_extract_3d.track.joint_filter import isotropic
from skeleton_extract_3d.track.tracks import PLACE_WEIGHTS
from synthetic_scene import Person, Room, joints_of, pinhole, render, standing

CAMERA, TIMEOUT = pinhole(320, 180), 2.0


def points(wall=5.0, half_width=0.0, shift=0.0):
    """Return points of a wall [m], and of a board 1.5 m before the camera around x = shift [m]."""
    depth = np.full((CAMERA.height, CAMERA.width), wall)
    x = 1.5 * (np.arange(CAMERA.width) - CAMERA.matrix[0, 2]) / CAMERA.matrix[0, 0]
    depth[:, np.abs(x - shift) < half_width] = 1.5
    return DepthImage((1000 * depth).astype(np.uint16), CAMERA)


def view(points, stamp=0.0):
    return FrameView(points, CAMERA, stamp, 0.0)


def track(x=0.0, z=3.0, sigma=0.1, existence=0.99, **values):
    """Return a track of a person who stands at (x, z), with the error of the place per axis."""
    joints = joints_of(Person(1, x, z, standing()), 1.0)
    one = tracks_of([[joints[name] for name in JOINTS]], existence=np.array([existence]), **values)
    return replace(one, root=one.root._replace(position_covariance=isotropic(np.full((1, 1), sigma * np.sqrt(3)))))


@pytest.mark.parametrize('x, those, visible, inside, empty', [
    (0.0, points(), 1, 1, 1), (0.0, points(3.1), 1, 1, 0), (0.0, points(1.5), 0, 1, 0), (9.0, points(), 0, 0, 0),
    (0.0, points(0.0), TRACKING.open_view, 1, 0)],
    ids=['before a far wall', 'at a wall', 'behind a wall', 'beside the image', 'no depth'])
def test_what_the_camera_would_see_of_a_body(x, those, visible, inside, empty):
    one = track(x)
    views = views_at(one.joints.position, one.has, view(those))
    assert [float(values[0]) for values in views] == pytest.approx([visible, inside, empty])


def test_of_a_person_half_behind_something_half_is_visible():
    one = track()
    views = views_at(one.joints.position, one.has, view(points(half_width=0.5, shift=0.5)))
    assert 0.3 < views.visible[0] < 0.7 and views.inside[0] == 1


def after(one, those, looked, seconds=0.3, rate=15):
    """Return a track after frames in which no person was detected, and existence in each of them."""
    existence = []
    for stamp in np.arange(1, round(seconds * rate) + 1) / rate:
        one = without_detection(one, np.array([looked]), view(those, stamp), TIMEOUT)
        existence.append(float(one.existence[0]))
    return one, existence


@pytest.mark.parametrize('those, looked, less', [
    (points(1.5), True, False), (points(1.5), False, False), (points(3.1), False, False),
    (points(3.1), True, True), (points(5.0), False, True), (points(5.0), True, True)],
    ids=['hidden', 'hidden, no look', 'visible, no look', 'visible', 'empty, no look', 'empty'])
def test_a_look_in_vain_and_an_empty_place_tell_against_a_person(those, looked, less):
    *_, existence = after(track(), those, looked)[1]
    assert existence < 0.93 if less else 0.95 < existence <= 0.99


@pytest.mark.parametrize('those', [points(3.1), points(5.0)], ids=['visible', 'empty'])
def test_the_same_time_tells_the_same_at_any_rate(those):
    *_, slow = after(track(), those, True, 0.3, 20)[1]
    *_, fast = after(track(), those, True, 0.3, 100)[1]
    assert fast == pytest.approx(slow, rel=0.05, abs=EXISTENCE.ended / 50)


def test_places_that_were_seen_empty_are_used_up_and_the_hidden_one_stays():
    one, existence = after(track(sigma=0.4), points(half_width=0.18), True, 2.0)
    assert 0.6 < existence[-1] < existence[0] and one.places.sum() == pytest.approx(1)
    assert one.places[0, 2] > 0.95 and views_of(one, view(points(half_width=0.18))).empty[0] < 0.05
    gone, existence = after(one, points(), True, 0.3)
    assert existence[-1] < EXISTENCE.reported, 'the place is in free view now'
    found = with_detection(gone, gone.existence, np.array([3.0]), 2.0)
    np.testing.assert_allclose(found.places[0], PLACE_WEIGHTS)


@pytest.mark.parametrize('born, most', [(1.0, EXISTENCE.born), (0.0, EXISTENCE.most)])
def test_one_detection_makes_no_certain_person(born, most):
    one = replace(track(), born=np.array([born]))
    assert with_detection(one, np.array([0.5]), np.array([50.0]), 1.0).existence[0] == most


@pytest.mark.parametrize('x, lasting', [(0.0, METHOD.track.existence.lasting * TIMEOUT), (9.0, EXISTENCE.leaving)])
def test_people_fade_faster_outside_the_image(x, lasting):
    one = track(x)
    existence = after_time(one, views_of(one, view(points())), 0.5, TIMEOUT)
    assert existence == pytest.approx(0.99 * np.exp(-0.5 / lasting))


@pytest.mark.parametrize('measured, has_depth', [(0, True), (4, True), (5, True), (0, False)],
                         ids=['none', 'few', 'body', 'no depth'])
@pytest.mark.parametrize('told', [1.0, 5.0])
def test_a_detection_without_a_body_in_the_points_tells_less(measured, has_depth, told):
    frame = render(CAMERA, [Person(1, 0.0, 2.6, standing())], Room(wall=6.0))
    those = DepthImage(frame.depth * np.uint16(has_depth), CAMERA)
    score = EXISTENCE.even_score + told * EXISTENCE.score_scale
    observed = observe(replace(frame.people, scores=np.array([score])), frame.size, those, CAMERA)
    lifted = lift_robustly(observed, those, Expectation.of_strangers(1))
    evidence = evidence_of(observed, lifted._replace(measured=np.arange(len(JOINTS))[None] < measured),
                           np.array([np.inf]), view(those))
    less = METHOD.track.existence.against_few if has_depth and measured < 5 else 0.0
    assert evidence == pytest.approx([max(told + less, EXISTENCE.least_evidence)])


@pytest.mark.parametrize('x', [-0.9, 0.0, 0.9])
def test_a_wide_lens_may_have_depth_where_it_has_no_rays(x):
    """An RGB camera whose polynomial folds: beyond a circle, no direction of space is seen in its pixels."""
    lens = CameraModel(CAMERA.width, CAMERA.height, CAMERA.matrix, 'plumb_bob', np.array([-0.42, 0, 0, 0, 0]))
    assert 0.2 < np.isnan(lens.ray_grid()[..., 0]).mean() < 0.8
    frame = render(CAMERA, [Person(1, x, 2.6, standing())], Room(wall=3.0))
    those = DepthImage(frame.depth, lens)
    observed = observe(frame.people, frame.size, those, lens)
    relief = relief_of(observed, FrameView(those, lens, 0.0, 0.0))
    assert np.isnan(relief).all() or 0.1 < relief[0] < 0.6

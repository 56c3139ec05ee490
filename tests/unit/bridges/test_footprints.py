"""Footprints of people on the floor: they hold the body, and where it may be in the next seconds."""
from dataclasses import replace

import numpy as np
import pytest

from animated_skeleton import SIGMA, STANDING, joints_of, people_of, without
from openpose_ros_bridges.footprints import Circle, circles_of, points_in, predicted
from openpose_ros_bridges.located import located
from openpose_ros_bridges.planning_scene import solids_of
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.capsules import capsules_of
from openpose_ros_signals.records import FloorPose, PersonSignals, Walk

PLACE = np.array([2.0, -1.0])
FLOOR = FloorPose(np.array([*PLACE, 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))
WALKS = PersonSignals(7, np.array([*PLACE, 1.1]), walk=Walk(True, 1.5, np.array([0.0, 1.0, 0.0])), floor=FLOOR)
STANDS = replace(WALKS, walk=Walk(False, 0.0, np.zeros(3)))
POSE = replace(STANDING, place=tuple(PLACE))
FAR = {'near': 0.0, 'far': 100.0}


def footprints(signals=WALKS, sigmas=1.0):
    people = people_of([POSE], [7], np.random.RandomState(1))
    return circles_of(located(people, [signals]), capsules_of(people), sigmas)


def test_a_body_is_in_its_circle():
    (circle,) = footprints(sigmas=0.0)
    assert circle.id == 7
    np.testing.assert_array_equal(circle.centre, PLACE)
    np.testing.assert_array_equal(circle.velocity, [0.0, 1.5])
    reach = np.linalg.norm(joints_of(POSE)[:, :2] - PLACE, axis=1).max()
    # the arms hang beside the hips
    assert reach + 0.05 < circle.radius < reach + 0.25
    (wider,) = footprints(sigmas=2.0)
    assert wider.radius == pytest.approx(circle.radius + 2 * SIGMA, abs=0.1)
    assert wider.radius > circle.radius + 2 * SIGMA - 0.01


@pytest.mark.parametrize('known, least, most', [
    (['nose', 'left_ear'], 0.4, 0.9), (['right_shoulder', 'right_elbow'], 0.5, 0.9), (['right_wrist'], 0.9, 1.6),
    (['right_knee', 'right_ankle', 'left_ankle'], 0.6, 1.2)])
def test_the_trunk_of_a_person_known_in_part_is_in_the_circle_and_in_the_planning_scene(known, least, most):
    people = without(people_of([POSE], [7], np.random.RandomState(1)), [j for j in COCO_18.joints if j not in known])
    capsules = capsules_of(people)
    (circle,) = circles_of(located(people, [WALKS]), capsules, 0.0)
    assert least < circle.radius < most
    assert len(points_in([circle], 0.05, **FAR)) > 100
    trunk = joints_of(POSE)[[j.endswith(('shoulder', 'hip')) for j in COCO_18.joints]]
    held = [np.linalg.norm(trunk - solid.centre, axis=1) < solid.radius for solid in solids_of(capsules, 0.0).values()]
    assert np.any(held, axis=0).sum() >= 2


def test_walking_people_go_on_and_their_places_grow_unsure():
    (circle,) = footprints()
    ahead = predicted(circle, 2.0, 0.25, 1.0)
    assert len(ahead) == 9
    assert ahead[0].centre.tolist() == PLACE.tolist()
    assert ahead[0].radius == circle.radius
    np.testing.assert_allclose(ahead[-1].centre, PLACE + np.array([0.0, 3.0]))
    # the error of a difference of two positions over 0.4 s, of which two of three axes are level
    growth = np.sqrt(2) * SIGMA / 0.4 * np.sqrt(2 / 3)
    assert ahead[-1].radius == pytest.approx(circle.radius + 2.0 * growth)
    assert predicted(circle, 2.0, 0.25, 0.0)[-1].radius == circle.radius
    assert len(predicted(circle, 0.0, 0.25, 1.0)) == 1


def test_points_fill_circles_once():
    circle = Circle(1, np.array([1.0, 0.0]), 0.3, np.zeros(2), 0.0)
    points = points_in([circle, circle._replace(centre=np.array([1.1, 0.0]))], 0.05, **FAR)
    distances = np.linalg.norm(points[:, np.newaxis] - [[1.0, 0.0], [1.1, 0.0]], axis=2).min(axis=1)
    assert distances.max() <= 0.3 + 1e-9
    cells = np.rint(points / 0.05).astype(int)
    assert len(np.unique(cells, axis=0)) == len(points)
    # every place of the circle has a point within half a diagonal of the grid
    angles = np.linspace(0, 2 * np.pi, 100)
    rim = np.array([1.0, 0.0]) + 0.25 * np.column_stack((np.cos(angles), np.sin(angles)))
    assert np.linalg.norm(rim[:, np.newaxis] - points, axis=2).min(axis=1).max() <= 0.05 * np.sqrt(0.5) + 1e-9


def test_points_in_the_robot_and_out_of_reach_are_left_out():
    near = Circle(1, np.zeros(2), 1.0, np.zeros(2), 0.0)
    distances = np.linalg.norm(points_in([near], 0.05, 0.5, 5.0), axis=1)
    assert 0.5 <= distances.min() < 0.56
    huge = Circle(1, np.array([1e6, 0.0]), 1e9, np.zeros(2), 0.0)
    distances = np.linalg.norm(points_in([huge], 0.1, 0.5, 2.0), axis=1)
    assert distances.max() <= 2.0
    assert len(distances) > 1000
    assert len(points_in([huge._replace(radius=1.0)], 0.1, 0.5, 2.0)) == 0

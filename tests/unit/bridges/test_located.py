"""Where people are, how they move and how sure that is, by joints and signals; and boxes round them."""
from dataclasses import replace

import numpy as np
import pytest

from animated_skeleton import SIGMA, STANDING, TRUNK, UP, people_of, without
from openpose_ros_bridges.body_model import body_poses
from openpose_ros_bridges.footprints import circles_of
from openpose_ros_bridges.located import located
from openpose_ros_bridges.planning_scene import solids_of
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.capsules import capsules_of, reaches_of
from openpose_ros_signals.reader import SignalReader
from openpose_ros_signals.records import Facing, Fall, FloorPose, Gesture, PersonSignals, Posture, Walk
from skeleton_extract_3d.people import INFERRED, People3D

AHEAD = np.array([1.0, 0.0, 0.0])
FLOOR = FloorPose(np.array([2.0, -1.0, 0.0]), np.array([0.0, 0.0, 0.6, 0.8]))
BUSY = PersonSignals(7, np.array([2.0, -1.0, 1.1]), Posture('standing', 11.5, 0.75),
                     (Gesture('wave', 'left', 12.25, 0.5), Gesture('arms_crossed', 'both', 12.0, 1.0)),
                     Facing(AHEAD, 0.125), walk=Walk(True, 1.5, np.array([0.0, 1.0, 0.0])), floor=FLOOR)


def visible(*ids):
    return people_of([STANDING] * len(ids), ids, np.random.RandomState(1))


def test_all_that_is_known_of_a_person():
    (person,) = located(visible(3, 7), [BUSY])
    assert (person.id, person.measured, person.turn_sigma) == (7, True, 0.125)
    assert person.reliability == 1.0
    assert person.sigma == pytest.approx(SIGMA)
    assert (person.position is FLOOR.position) and (person.orientation is FLOOR.orientation)
    np.testing.assert_array_equal(person.velocity, [0.0, 1.5, 0.0])
    assert person.tags == (('posture', 'standing'), ('gesture', 'wave left'), ('gesture', 'arms_crossed both'))


def test_what_is_not_known_stays_unknown():
    (person,) = located(visible(7), [PersonSignals(7, np.full(3, np.nan), floor=FLOOR)])
    assert (person.velocity, person.tags) == (None, ())
    assert np.isnan(person.turn_sigma)
    assert np.isnan(located(replace(visible(7), sigma=np.full((1, 18), np.nan)), [BUSY])[0].sigma)
    # people without a place or without joints are left out
    for people, signals in ((People3D.empty(COCO_18), ()), (visible(7), [replace(BUSY, floor=None)]),
                            (visible(8), [BUSY])):
        assert located(people, signals) == []


@pytest.mark.parametrize('number', [0, 5])
def test_people_who_have_one_id_are_told_apart_by_their_rows(number):
    people, reader = without(people_of([replace(STANDING, place=place) for place in ((2.0, 0.0), (4.0, 1.0))],
                                       [number, number], np.random.RandomState(1)), ('left_wrist',)), SignalReader()
    for stamp in np.arange(0.0, 2.0, 0.1):
        signals = reader.update(people, stamp, UP)
    assert [(person.id, person.walk.moving, round(person.floor.position[0])) for person in signals] == [
        (1, False, 2), (2, False, 4)]
    placed, capsules = located(people, signals), capsules_of(people)
    assert [(person.id, round(person.position[0])) for person in placed] == [(1, 2), (2, 4)]
    assert all(circle.radius < 1 for circle in circles_of(placed, capsules, 1.0))
    solids = solids_of(capsules, 1.0)
    assert [round(solids[f'person_{row}_head'].centre[0]) for row in (1, 2)] == [2, 4]
    assert sorted(body_poses(people)) == sorted(set(reaches_of(people).persons.tolist())) == [1, 2]


def test_a_lying_person_has_no_direction_and_a_hidden_one_is_not_measured():
    fallen = replace(BUSY, posture=Posture('lying', 12.0, 1.0), fall=Fall(12.0, 0.5, 2.0), gestures=())
    people = visible(7)
    (person,) = located(replace(people, status=np.full((1, 18), INFERRED), confidence=np.zeros((1, 18))), [fallen])
    assert person.tags == (('posture', 'lying'), ('fallen', 'true'))
    assert np.isnan(person.turn_sigma)
    assert (person.measured, person.reliability) == (False, 0.0)
    half = replace(people, confidence=np.where(np.arange(18) < 4, 0.5, 0.0)[np.newaxis])
    assert located(half, [BUSY])[0].reliability == 0.5


def test_sigma_is_that_of_the_trunk_where_it_is_known():
    people = visible(7)
    arms = replace(people, sigma=np.where([name in TRUNK for name in COCO_18.joints], 0.04, 0.5)[np.newaxis])
    assert located(arms, [BUSY])[0].sigma == pytest.approx(0.04)
    assert located(without(arms, TRUNK), [BUSY])[0].sigma == pytest.approx(0.5)

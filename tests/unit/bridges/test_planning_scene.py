"""What a planner is told of people from frame to frame: what it knows holds each part of each of them."""
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from animated_skeleton import ADULT, SIGMA, STANDING, frames, held, joints_of, people_of, without
from openpose_ros_bridges.capsules import capsules_of
from openpose_ros_bridges.planning_scene import ADD, MOVE, REMOVE, SceneObjects, Solid, solids_of
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import People3D

STRAIGHT = Solid(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), 0.3, 0.1)


class Planner:
    """Applies changes as MoveIt does: it moves what it knows, and takes shapes of what is added."""

    def __init__(self):
        self.objects = {}

    def apply(self, changes):
        for operation, name, solid in changes:
            if operation == REMOVE:
                del self.objects[name]
            elif operation == ADD:
                self.objects[name] = solid
            else:
                self.objects[name] = self.objects[name]._replace(centre=solid.centre, orientation=solid.orientation)


def axis(solid):
    along = Rotation.from_quat(solid.orientation).apply([0.0, 0.0, solid.length / 2])
    return solid.centre - along, solid.centre + along


def distance(point, solid):
    """Return the distance of a point to the axis of a solid."""
    start, end = axis(solid)
    share = np.clip((point - start) @ (end - start) / max((end - start) @ (end - start), 1e-12), 0, 1)
    return np.linalg.norm(point - start - share * (end - start))


def operations(changes):
    return {change.name: change.operation for change in changes}


def test_parts_lie_along_the_limbs_and_are_wider_by_sigma():
    assert solids_of(capsules_of(People3D.empty(COCO_18)), 1.0) == {}
    people = people_of([STANDING], [5], np.random.RandomState(0))
    bare, wide = (solids_of(capsules_of(people), sigmas) for sigmas in (0.0, 2.0))
    assert {'person_5_head', 'person_5_spine', 'person_5_left_hand', 'person_5_right_shin'} <= set(bare)
    shin = bare['person_5_left_shin']
    ends = [people.xyz[0, COCO_18.index[f'left_{joint}']] for joint in ('knee', 'ankle')]
    np.testing.assert_allclose(axis(shin), ends, atol=1e-6)
    assert wide['person_5_left_shin'].radius == pytest.approx(shin.radius + 2 * SIGMA)
    for sigma in (np.nan, np.inf, 1e30):
        unknown = solids_of(capsules_of(replace(people, sigma=np.full((1, 18), sigma))), 1.0)
        assert 0.2 < unknown['person_5_left_shin'].radius - shin.radius < 1001.0


def test_known_objects_hold_a_walking_person_and_mostly_move():
    walk = held((0.0, replace(STANDING, place=(0.0, -1.0))), (2.0, replace(STANDING, place=(0.0, 1.0), facing=90.0)))
    scene, planner, counts = SceneObjects(), Planner(), dict.fromkeys((ADD, MOVE, REMOVE), 0)
    for stamp, people in frames(walk, 2.0, 10):
        solids = solids_of(capsules_of(people), 1.0)
        changes = scene.update(solids, stamp)
        planner.apply(changes)
        for change in changes:
            counts[change.operation] += 1
        assert set(planner.objects) == set(solids)
        for name, solid in solids.items():
            known = planner.objects[name]
            for end in axis(solid):
                # the whole ball at the end of the part
                assert distance(end, known) + solid.radius <= known.radius + 1e-6
        # the true joints
        true = joints_of(walk(stamp), ADULT)
        for joint in true:
            assert min(distance(joint, known) - known.radius for known in planner.objects.values()) < 0
    assert counts[REMOVE] == 0
    assert counts[MOVE] > 2 * counts[ADD]


def test_a_person_comes_loses_a_hand_and_leaves():
    scene, random = SceneObjects(), np.random.RandomState(0)

    def told(people, stamp):
        return operations(scene.update(solids_of(capsules_of(people), 1.0), stamp))
    both = people_of([STANDING, replace(STANDING, place=(2.0, 0.0))], [1, 2], random)
    first = told(both, 0.0)
    assert set(first.values()) == {ADD}
    removed = {name for name, operation in told(without(both, ['left_wrist']), 0.1).items() if operation == REMOVE}
    assert removed == {f'person_{person}_left_{part}' for person in (1, 2) for part in ('forearm', 'hand')}
    third = told(people_of([STANDING], [2], random), 0.2)
    assert {name for name, operation in third.items() if operation == REMOVE} == {
        name for name in first if name.startswith('person_1_')} - removed
    assert {third[f'person_2_left_{part}'] for part in ('forearm', 'hand')} == {ADD}
    assert set(operations(scene.update({}, 0.0)).values()) == {REMOVE}
    assert scene.update({}, 0.1) == []


def test_shapes_that_do_not_fit_any_more_are_added_anew():
    scene = SceneObjects()

    def told(solid, stamp):
        (change,) = scene.update({'part': solid}, stamp)
        return change.operation, change.solid.length, change.solid.radius
    assert told(STRAIGHT, 0.0) == (ADD, 0.31, 0.11)
    assert told(STRAIGHT._replace(length=0.305, radius=0.105), 0.1) == (MOVE, 0.31, 0.11)
    assert told(STRAIGHT._replace(radius=0.09), 0.2) == (MOVE, 0.31, 0.11)
    assert told(STRAIGHT._replace(radius=0.12), 0.3) == (ADD, 0.31, 0.13)
    assert told(STRAIGHT, 0.4) == (MOVE, 0.31, 0.13)
    assert told(STRAIGHT._replace(radius=0.09), 0.5)[0] == ADD  # too large by more than 3 cm
    assert told(STRAIGHT._replace(length=0.5), 0.6)[0] == ADD

"""What a planner is told of people from frame to frame: what it knows holds each part of each of them."""
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from animated_skeleton import SIGMA, STANDING, people_of
from openpose_ros_bridges.planning_scene import solids_of
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.capsules import capsules_of
from skeleton_extract_3d.people import People3D


def axis(solid):
    along = Rotation.from_quat(solid.orientation).apply([0.0, 0.0, solid.length / 2])
    return solid.centre - along, solid.centre + along


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

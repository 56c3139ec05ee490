"""People as capsules: which parts there are, where they end, how wide they are, and what is unknown."""
from dataclasses import replace

import numpy as np
import pytest

from animated_skeleton import ADULT, CHILD, SIGMA, STANDING, people_of, without
from capsule_rows import rows
from openpose_ros_pkg.skeletons import BODY_25, COCO_18
from openpose_ros_signals.capsules import CAPSULES, PARTS, capsules_of, reaches_of
from skeleton_extract_3d.body.body import BODY
from skeleton_extract_3d.people import MEASURED, MISSING, People3D


def standing(*ids, **how):
    return people_of([STANDING] * len(ids), ids, np.random.RandomState(1), **how)


def by_part(people):
    return {capsule.part: capsule for capsule in rows(capsules_of(people))}


def test_a_person_has_all_parts_but_feet():
    people = standing(3, 7)
    capsules = capsules_of(people)
    assert [capsule.part for capsule in rows(capsules)] == 2 * [part for part in PARTS if not part.endswith('foot')]
    assert set(capsules.persons[:len(capsules) // 2].tolist()) == {3}
    assert capsules.measured.all()
    first = by_part(people)['left_forearm']
    np.testing.assert_allclose(first.ends, people.xyz[1, [COCO_18.index['left_elbow'], COCO_18.index['left_wrist']]],
                               atol=1e-6)
    np.testing.assert_allclose(first.sigma, SIGMA, atol=1e-6)


def test_radii_scale_with_the_stature():
    widths = {}
    for stature in (ADULT, CHILD):
        people = standing(3)
        grown = replace(people, xyz=people.xyz * stature / ADULT)
        widths[stature] = by_part(grown)
    assert widths[ADULT]['spine'].radius == pytest.approx(CAPSULES.trunk * ADULT / BODY.adult_stature, rel=0.05)
    for part, capsule in widths[CHILD].items():
        assert capsule.radius == pytest.approx(widths[ADULT][part].radius * CHILD / ADULT, rel=1e-5)


def test_hands_lie_on_from_the_forearms_and_move_with_them():
    people = standing(3)
    index = COCO_18.index
    velocity = np.zeros_like(people.velocity)
    velocity[0, index['left_wrist']] = (1.0, 0.0, 0.0)
    parts = by_part(replace(people, velocity=velocity))
    (elbow, wrist), (begin, end) = parts['left_forearm'].ends, parts['left_hand'].ends
    np.testing.assert_array_equal(wrist, begin)
    along = (wrist - elbow) / np.linalg.norm(wrist - elbow)
    length = (CAPSULES.hand_length - CAPSULES.hand) * ADULT / BODY.adult_stature
    np.testing.assert_allclose(end - wrist, length * along, rtol=0.05, atol=1e-6)
    assert parts['left_hand'].velocity[1, 0] == pytest.approx(1 + np.linalg.norm(end - wrist) / np.linalg.norm(
        wrist - elbow))
    assert parts['left_hand'].sigma[1] > parts['left_hand'].sigma[0] == pytest.approx(SIGMA)


def test_a_hand_without_forearm_points_anywhere():
    parts = by_part(without(standing(3), ('left_elbow',)))
    assert not {'left_forearm', 'left_upper_arm'} & set(parts)
    np.testing.assert_array_equal(*parts['left_hand'].ends)
    assert parts['left_hand'].sigma[1] > CAPSULES.hand_length - CAPSULES.hand
    assert not parts['left_hand'].measured and parts['right_hand'].measured
    assert 'left_hand' not in by_part(without(standing(3), ('left_wrist',)))


def test_the_head_without_ears_is_less_certain():
    parts = by_part(without(standing(3), ('left_ear', 'right_eye')))
    assert 'head' not in parts
    assert not parts['neck'].measured
    assert parts['neck'].sigma[1] > CAPSULES.part_of_head
    assert 'neck' not in by_part(without(standing(3), ('left_ear', 'right_ear', 'left_eye', 'right_eye', 'nose')))


def test_feet_where_the_network_has_toes():
    people = standing(3)
    rows = [COCO_18.index.get(name, -1) for name in BODY_25.joints]
    known = np.array(rows) >= 0
    status = np.where(known, people.status[:, rows], MISSING)
    xyz = np.where(known[:, np.newaxis], people.xyz[:, rows], np.nan)
    toe = BODY_25.index['left_big_toe']
    xyz[0, toe], status[0, toe] = (0.3, 0.1, 0.02), MEASURED
    feet = by_part(People3D(BODY_25, xyz, (status > 0).astype(float), status,
                            np.where(status > 0, SIGMA, np.nan), people.ids))
    np.testing.assert_allclose(feet['left_foot'].ends[1], (0.3, 0.1, 0.02), atol=1e-6)
    assert 'right_foot' not in feet
    assert np.isnan(feet['left_foot'].velocity).all()


def test_a_missing_part_is_within_reach_of_the_nearest_known_joint():
    people = standing(3)
    hidden = reaches_of(without(people, ('left_wrist',)))
    assert [capsule.part for capsule in rows(hidden)] == ['left_forearm', 'left_hand']
    for capsule in rows(hidden):
        np.testing.assert_allclose(capsule.ends, people.xyz[0, [COCO_18.index['left_elbow']] * 2], atol=1e-6)
    forearm, hand = hidden.radii
    size = ADULT / BODY.adult_stature
    assert forearm > (BODY.forearm + CAPSULES.forearm) * size
    assert hand > (BODY.forearm + CAPSULES.hand_length) * size
    # the true parts are in there
    known = by_part(people)
    for capsule in rows(hidden):
        own = known[capsule.part]
        assert (np.linalg.norm(own.ends - capsule.ends[0], axis=1) + own.radius <= capsule.radius).all()


def test_of_a_person_with_one_joint_all_parts_are_within_reach_of_it():
    people = standing(3)
    reaches = reaches_of(without(people, [joint for joint in COCO_18.joints if joint != 'neck']))
    known = by_part(people)
    assert {capsule.part for capsule in rows(reaches)} == set(known)
    for capsule in rows(reaches):
        own = known[capsule.part]
        assert (np.linalg.norm(own.ends - capsule.ends[0], axis=1) + own.radius <= capsule.radius).all(), capsule.part
    assert len(reaches_of(without(people, COCO_18.joints))) == 0

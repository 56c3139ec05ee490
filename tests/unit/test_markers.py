"""Markers: finite points only, deletes for whoever left, a lifetime that outlasts the frame period."""
import numpy as np
import pytest

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.markers import MarkerLifetime, MarkerParams, MarkerTracker, people_markers
from skeleton_extract_3d.people import MEASURED, MISSING, People3D

K = len(COCO_18.joints)
INDEX = COCO_18.index
# A person standing upright in the optical frame (y down), 3 m ahead.
UPRIGHT = {'nose': (0, -0.6, 2.9), 'neck': (0, -0.4, 3), 'right_shoulder': (-0.2, -0.4, 3),
           'left_shoulder': (0.2, -0.4, 3), 'right_hip': (-0.1, 0.2, 3), 'left_hip': (0.1, 0.2, 3)}


def people(persons):
    """People by id, each a mapping from joint to position."""
    xyz = np.full((len(persons), K, 3), np.nan)
    for row, joints in zip(xyz, persons.values()):
        for joint, position in joints.items():
            row[INDEX[joint]] = position
    found = np.isfinite(xyz).all(axis=2)
    return People3D(COCO_18, xyz, found * 0.9, np.where(found, MEASURED, MISSING), np.full(found.shape, np.nan),
                    list(persons))


def names(markers):
    return [(marker.action, marker.ns, marker.id) for marker in markers]


def test_nobody_has_no_markers():
    assert people_markers(people({}), MarkerParams(), 0.2) == []
    assert MarkerTracker(MarkerParams()).update(people({}), 0.0) == []


def test_joints_and_limbs_look_as_in_the_original():
    joints, skeleton = people_markers(people({7: UPRIGHT}), MarkerParams(), 0.15)
    assert (joints.ns, joints.id, joints.action, joints.kind) == ('joints', 7, 'add', 'sphere_list')
    assert (joints.scale, joints.rgba, joints.lifetime) == (0.05, (1, 0, 0, 1), 0.15)
    np.testing.assert_allclose(joints.points, [UPRIGHT[joint] for joint in COCO_18.joints if joint in UPRIGHT])
    assert (skeleton.ns, skeleton.id, skeleton.action, skeleton.kind) == ('skeleton', 7, 'add', 'line_list')
    assert (skeleton.scale, skeleton.rgba, skeleton.lifetime) == (0.03, (0, 0, 1, 1), 0.15)


def test_a_limb_needs_both_ends():
    _, skeleton = people_markers(people({0: UPRIGHT}), MarkerParams(), 0.2)
    both = [limb for limb in COCO_18.drawn_limbs if set(limb) <= set(UPRIGHT)]
    assert len(both) == 5
    np.testing.assert_allclose(skeleton.points, [UPRIGHT[joint] for limb in both for joint in limb])


def test_joints_without_a_limb_have_no_lines():
    assert names(people_markers(people({0: {'nose': (0, 0, 1)}}), MarkerParams(), 0.2)) == [('add', 'joints', 0)]


def test_who_left_and_what_is_no_more_is_deleted_once():
    tracker = MarkerTracker(MarkerParams())
    assert names(tracker.update(people({1: UPRIGHT, 2: UPRIGHT}), 0.0)) == [
        ('add', 'joints', 1), ('add', 'skeleton', 1), ('add', 'joints', 2), ('add', 'skeleton', 2)]
    # 1 leaves; of 2 one joint remains
    assert names(tracker.update(people({2: {'nose': (0, 0, 1)}}), 0.1)) == [
        ('delete', 'joints', 1), ('delete', 'skeleton', 1), ('delete', 'skeleton', 2), ('add', 'joints', 2)]
    # 2 is seen in the image, but has no position: no empty list, which RViz complains about
    assert names(tracker.update(people({2: {}}), 0.2)) == [('delete', 'joints', 2)]
    assert tracker.update(people({}), 0.3) == []
    assert names(tracker.update(people({1: {'nose': (0, 0, 1)}}), 0.4)) == [('add', 'joints', 1)]


def test_one_colour_per_person():
    persons = people(dict.fromkeys(range(12), UPRIGHT))
    markers = people_markers(persons, MarkerParams(colour_by_person=True), 0.2)
    colours = {person: {marker.rgba for marker in markers if marker.id == person} for person in range(12)}
    assert all(len(own) == 1 for own in colours.values())
    assert len(set.union(*colours.values())) == 12
    again = people_markers(people({5: UPRIGHT}), MarkerParams(colour_by_person=True), 0.2)
    assert again[0].rgba in colours[5]


# Optical frame, an upright world frame (x right, y ahead, z up), and somebody who stands on the head.
@pytest.mark.parametrize('turn', [np.eye(3), [[1, 0, 0], [0, 0, 1], [0, -1, 0]], np.diag([-1, -1, 1])],
                         ids=['optical frame', 'world frame', 'upside down'])
def test_the_label_stands_above_the_head_in_any_frame(turn):
    turned = {joint: np.dot(turn, position) for joint, position in UPRIGHT.items()}
    label = people_markers(people({31: turned}), MarkerParams(label=True), 0.2)[-1]
    assert (label.ns, label.id, label.kind, label.text) == ('label', 31, 'text', '31')
    np.testing.assert_allclose(label.points, [np.dot(turn, (0, -0.6 - 0.3, 2.9))], atol=1e-6)


@pytest.mark.parametrize('joints, position', [
    ({'left_knee': (0, 0, 2), 'right_knee': (1, 0, 2)}, (0.5, 0, 2)),
    ({'nose': (0, 0, 2)}, (0, 0, 2)),
    ({'neck': (0, 0, 2), 'left_hip': (0, 1, 2)}, (0, -0.3, 2)),
    ({'neck': (0, 0, 2), 'left_hip': (0, 0, 2)}, (0, 0, 2)),
], ids=['legs', 'face', 'trunk', 'no direction'])
def test_the_label_makes_do_with_what_there_is(joints, position):
    label = people_markers(people({0: joints}), MarkerParams(label=True), 0.2)[-1]
    np.testing.assert_allclose(label.points, [position], atol=1e-6)


def test_only_finite_points_are_published():
    rng = np.random.default_rng(0)
    for _ in range(20):
        person = {joint: rng.normal(size=3) for joint in COCO_18.joints if rng.random() < 0.5}
        for marker in people_markers(people({0: person}), MarkerParams(label=True), 0.2):
            assert np.isfinite(marker.points).all()
            assert len(marker.points) > 0


@pytest.mark.parametrize('rate, expected', [(30, 0.15), (15, 0.2), (5, 0.6)])
def test_the_lifetime_covers_three_frames(rate, expected):
    lifetime = MarkerLifetime(0.15)
    assert lifetime.update(100.0) == 0.15
    for i in range(1, 20):
        value = lifetime.update(100.0 + i / rate)
    assert value == pytest.approx(expected, rel=1e-6)


def test_a_pause_or_a_jump_back_does_not_change_the_lifetime():
    lifetime = MarkerLifetime(0.15)
    for i in range(10):
        lifetime.update(i / 10)
    assert lifetime.update(60.0) == pytest.approx(0.3)
    assert lifetime.update(0.0) == pytest.approx(0.3)


@pytest.mark.parametrize('values', [{'joint_colour': 'red'}, {'joint_colour': '1 0 0'}, {'skeleton_colour': '0 0 2 1'},
                                    {'skeleton_colour': '0 0 nan 1'}, {'joint_scale': 0.0}, {'lifetime': 0.0},
                                    {'label': 1}], ids=str)
def test_bad_parameters_are_refused_by_name(values):
    (key, value), = values.items()
    with pytest.raises(ParameterError, match=f"parameter '{key}' = {value!r}"):
        MarkerParams(**values)

"""Markers: finite points only, inferred apart from measured ones, deletes for people who left, a lifetime that outlasts
the frame period."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import COCO_18, FACE_70, HAND_21
from skeleton_extract_3d.landmarks import Faces3D, Hands3D, Points3D
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.show.markers import MarkerParams, ShownMarkers, face_markers, hand_markers, people_markers

K = len(COCO_18.joints)
INDEX = COCO_18.index
# A person standing upright in the optical frame (y down), 3 m ahead.
UPRIGHT = {'nose': (0, -0.6, 2.9), 'neck': (0, -0.4, 3), 'right_shoulder': (-0.2, -0.4, 3),
           'left_shoulder': (0.2, -0.4, 3), 'right_hip': (-0.1, 0.2, 3), 'left_hip': (0.1, 0.2, 3)}


def people(persons, inferred=()):
    """People by id, each a mapping from joint to position; `inferred` names joints."""
    xyz = np.full((len(persons), K, 3), np.nan)
    for row, joints in zip(xyz, persons.values()):
        for joint, position in joints.items():
            row[INDEX[joint]] = position
    found = np.isfinite(xyz).all(axis=2)
    status = np.where(found, MEASURED, MISSING)
    for joint in inferred:
        status[found[:, INDEX[joint]], INDEX[joint]] = INFERRED
    return People3D(COCO_18, xyz, found * 0.9, status, np.full(found.shape, np.nan), list(persons))


def landmarks(number, status):
    """Points in a row, 2 cm apart, of one hand or face."""
    xyz = np.column_stack([0.02 * np.arange(number), np.zeros(number), np.ones(number)])[np.newaxis]
    status = np.resize(status, number)[np.newaxis]
    xyz[status == MISSING] = np.nan
    return Points3D(xyz, np.ones((1, number)), status, np.full((1, number), 0.01))


def hand(person, left, status=(MEASURED,)):
    return Hands3D(landmarks(21, status), np.ones(1), np.array([person]), np.array([left]))


def face(turn):
    return Faces3D(landmarks(70, (MEASURED,)), np.ones(1), np.array([4]), np.array([turn], np.float32), np.ones(1))


def shown(markers):
    """Those that are published, by namespace."""
    return {marker.ns: marker for marker in markers if len(marker.points)}


def names(markers):
    return [(marker.action, marker.ns, marker.id) for marker in markers]


@pytest.mark.parametrize('persons', [{}, {3: {}}], ids=['no people', 'a person without a position'])
def test_no_people_have_no_markers(persons):
    assert shown(people_markers(people(persons), MarkerParams(label=True))) == {}
    assert hand_markers(Hands3D.empty(), MarkerParams()) == face_markers(Faces3D.empty(), MarkerParams()) == []


def test_joints_and_limbs_look_as_in_the_original():
    markers = shown(people_markers(people({7: UPRIGHT}), MarkerParams()))
    assert set(markers) == {'joints', 'skeleton'} and {marker.id for marker in markers.values()} == {7}
    joints, skeleton = markers.values()
    assert (joints.kind, joints.scale, joints.rgba) == ('sphere_list', 0.05, (1, 0, 0, 1))
    np.testing.assert_allclose(joints.points, [UPRIGHT[joint] for joint in COCO_18.joints if joint in UPRIGHT])
    assert (skeleton.kind, skeleton.scale, skeleton.rgba) == ('line_list', 0.03, (0, 0, 1, 1))


# An arm from z = 1 m on, whose wrist is INFERRED, and the ends of its dashes; dashes and gaps have one length.
@pytest.mark.parametrize('length, ends', [
    (0.05, [0, 0.05]), (0.25, [0, 0.05, 0.1, 0.15, 0.2, 0.25]), (0.16, [0, 0.16 / 3, 0.32 / 3, 0.16]), (0.0, [0, 0]),
], ids=['too short', 'as long as said', 'fitted', 'no length'])
def test_inferred_joints_and_their_limbs_are_apart_paler_and_dashed(length, ends):
    arm = {'right_elbow': (0.3, -0.2, 1), 'right_wrist': (0.3, -0.2, 1 + length)}
    markers = shown(people_markers(people({0: arm}, inferred=['right_wrist']), MarkerParams()))
    assert set(markers) == {'joints', 'joints_inferred', 'skeleton_inferred'}
    assert markers['joints_inferred'].rgba == (1, 0.6, 0.6, 0.6)
    np.testing.assert_allclose(markers['joints_inferred'].points, [arm['right_wrist']])
    dashed = markers['skeleton_inferred']
    assert (dashed.kind, dashed.scale, dashed.rgba) == ('line_list', 0.03, (0.6, 0.6, 1, 0.6))
    np.testing.assert_allclose(dashed.points, [(0.3, -0.2, 1 + end) for end in ends], atol=1e-6)


def test_fingers_with_an_inferred_end_are_dashed_and_those_without_an_end_are_not_drawn():
    status = [MEASURED] * 4 + [INFERRED] + [MEASURED] * 15 + [MISSING]
    lines, dashed = hand_markers(hand(4, True, status), MarkerParams())
    assert (lines.ns, lines.id, dashed.ns) == ('hand', 9, 'hand_inferred')
    assert len(lines.points) == 2 * (len(HAND_21.drawn_limbs) - 2)
    assert len(dashed.points) >= 4
    assert dashed.points[:, 0].min() >= 0.06 - 1e-6 and dashed.points[:, 0].max() <= 0.08 + 1e-6
    assert hand_markers(hand(4, False), MarkerParams())[0].id == 8


def test_a_head_has_contours_and_an_arrow_where_it_is_directed():
    markers = shown(face_markers(face((0, 0, np.sqrt(0.5), np.sqrt(0.5))), MarkerParams()))
    contour, arrow = markers['face'], markers['head_direction']
    assert (contour.id, len(contour.points), arrow.kind) == (4, 2 * len(FACE_70.drawn_limbs), 'arrow')
    np.testing.assert_allclose(arrow.points, [(0.02 * 34.5, 0, 1), (0.02 * 34.5, 0.25, 1)], atol=1e-5)
    for unknown in (4 * [np.nan], (0, 0, 0, 0)):
        assert 'head_direction' not in shown(face_markers(face(unknown), MarkerParams()))


def test_markers_of_people_who_left_are_deleted_once():
    kept = ShownMarkers()

    def replaced(persons):
        return names(kept.replaced(people_markers(people(persons), MarkerParams()), 0.0, 0.15))

    assert replaced({1: UPRIGHT, 2: UPRIGHT}) == [('add', 'joints', 1), ('add', 'skeleton', 1), ('add', 'joints', 2),
                                                  ('add', 'skeleton', 2)]
    # 1 leaves; of 2 one joint remains
    assert replaced({2: {'nose': (0, 0, 1)}}) == [('delete', 'joints', 1), ('delete', 'skeleton', 1),
                                                  ('delete', 'skeleton', 2), ('add', 'joints', 2)]
    # 2 is seen in the image, but has no position: no empty list, which RViz complains about
    assert replaced({2: {}}) == [('delete', 'joints', 2)]
    assert replaced({}) == []
    assert replaced({1: {'nose': (0, 0, 1)}}) == [('add', 'joints', 1)]


# Optical frame, an upright world frame (x right, y ahead, z up), and a person who stands on the head.
@pytest.mark.parametrize('turn', [np.eye(3), [[1, 0, 0], [0, 0, 1], [0, -1, 0]], np.diag([-1, -1, 1])],
                         ids=['optical frame', 'world frame', 'upside down'])
def test_the_label_stands_above_the_head_in_any_frame(turn):
    turned = {joint: np.dot(turn, position) for joint, position in UPRIGHT.items()}
    label = shown(people_markers(people({31: turned}), MarkerParams(label=True)))['label']
    assert (label.id, label.kind, label.text) == (31, 'text', '31')
    np.testing.assert_allclose(label.points, [np.dot(turn, (0, -0.6 - 0.3, 2.9))], atol=1e-6)
    inferred = people({31: turned}, inferred=list(UPRIGHT))
    for person, text in ((inferred, '31'), (replace(inferred, confidence=np.zeros((1, K))), '31 (hidden)')):
        assert shown(people_markers(person, MarkerParams(label=True)))['label'].text == text


@pytest.mark.parametrize('rate, expected', [(30, 0.15), (15, 0.2), (5, 0.6)])
def test_the_lifetime_covers_three_frames(rate, expected):
    kept, markers = ShownMarkers(), people_markers(people({1: UPRIGHT}), MarkerParams())
    lifetimes = [kept.replaced(markers, 100.0 + i / rate, 0.15)[0].lifetime for i in range(20)]
    assert lifetimes[0] == 0.15 and lifetimes[-1] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize('values', [{'joint_colour': 'red'}, {'joint_colour': '1 0 0'}, {'skeleton_colour': '0 0 2 1'},
                                    {'skeleton_colour': '0 0 nan 1'}, {'joint_scale': 0.0}, {'label': 1}], ids=str)
def test_bad_parameters_are_refused_by_name(values):
    (key, value), = values.items()
    with pytest.raises(ParameterError, match=f"parameter '{key}' = {value!r}"):
        MarkerParams(**values)


def test_parameters_that_are_gone_are_without_effect(caplog):
    assert build(MarkerParams, {'trail_seconds': 5.0, 'label': True}) == MarkerParams(label=True)
    assert 'trail_seconds' in caplog.text

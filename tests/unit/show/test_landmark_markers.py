"""Markers of hands and faces: fingers as lines, what is inferred apart from what was seen, where heads are directed."""
import numpy as np
import pytest

from openpose_ros_pkg.skeletons import FACE_70, HAND_21
from skeleton_extract_3d.landmarks import Faces3D, Hands3D, Points3D
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING
from skeleton_extract_3d.show.landmark_markers import LandmarkMarkers
from skeleton_extract_3d.show.markers import MarkerParams


def points(number, status):
    """Points in a row, 2 cm apart, of one hand or face."""
    xyz = np.column_stack([0.02 * np.arange(number), np.zeros(number), np.ones(number)])[np.newaxis]
    status = np.resize(status, number)[np.newaxis]
    xyz[status == MISSING] = np.nan
    return Points3D(xyz, np.ones((1, number)), status, np.full((1, number), 0.01))


def hand(person, left, status=(MEASURED,)):
    return Hands3D(points(21, status), np.ones(1), np.array([person]), np.array([left]))


def face(turn, status=(MEASURED,)):
    return Faces3D(points(70, status), np.ones(1), np.array([4]), np.array([turn], np.float32), np.ones(1))


def names(markers):
    return [(marker.action, marker.ns, marker.id) for marker in markers]


def test_no_people_have_no_markers():
    markers = LandmarkMarkers(MarkerParams())
    assert markers.hands(Hands3D.empty(), 0.0) == markers.faces(Faces3D.empty(), 0.0) == []


def test_fingers_are_lines_of_each_hand_and_vanish_with_it():
    markers = LandmarkMarkers(MarkerParams())
    shown, = markers.hands(hand(4, left=True), 0.0)
    assert (shown.ns, shown.id, shown.kind, len(shown.points)) == ('hand', 9, 'line_list', 2 * len(HAND_21.drawn_limbs))
    assert names(markers.hands(hand(4, left=False), 0.1)) == [('delete', 'hand', 9), ('add', 'hand', 8)]
    assert names(markers.hands(Hands3D.empty(), 0.2)) == [('delete', 'hand', 8)]


def test_fingers_with_an_inferred_end_are_dashed_and_those_without_an_end_are_not_drawn():
    seen, dashed = LandmarkMarkers(MarkerParams()).hands(
        hand(4, True, [MEASURED] * 4 + [INFERRED] + [MEASURED] * 15 + [MISSING]), 0.0)
    assert (seen.ns, dashed.ns) == ('hand', 'hand_inferred')
    assert len(seen.points) == 2 * (len(HAND_21.drawn_limbs) - 2)
    assert len(dashed.points) >= 4 and dashed.points[:, 0].min() >= 0.02 * 3 - 1e-6
    assert dashed.points[:, 0].max() <= 0.02 * 4 + 1e-6


def test_a_head_has_contours_and_an_arrow_where_it_is_directed():
    contour, arrow = LandmarkMarkers(MarkerParams(head_arrow=0.3)).faces(face((0, 0, np.sqrt(0.5), np.sqrt(0.5))), 0.0)
    assert (contour.ns, contour.id, len(contour.points)) == ('face', 4, 2 * len(FACE_70.drawn_limbs))
    assert (arrow.ns, arrow.kind) == ('head_direction', 'arrow')
    np.testing.assert_allclose(arrow.points[1] - arrow.points[0], (0, 0.3, 0), atol=1e-6)  # x turned by 90 deg about z
    np.testing.assert_allclose(arrow.points[0], (0.02 * 34.5, 0, 1), atol=1e-5)


@pytest.mark.parametrize('params, turn', [(MarkerParams(), 4 * [np.nan]), (MarkerParams(), (0, 0, 0, 0)),
                                          (MarkerParams(head_arrow=0.0), (0, 0, 0, 1))])
def test_without_a_direction_there_is_no_arrow(params, turn):
    assert names(LandmarkMarkers(params).faces(face(turn), 0.0)) == [('add', 'face', 4)]

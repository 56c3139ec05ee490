"""What RViz shows of signals."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_signals.records import Facing, Fall, Gesture, Hit, PersonSignals, Pointing, Posture, Ray, Walk
from openpose_ros_signals.show.markers import SignalMarkers, cone_lines, text_of

UP, AHEAD = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
EYE_RAY = Ray(np.array([0.0, 0.0, 1.5]), np.array([0.6, 0.0, -0.8]), 0.05)
ARM_RAY = Ray(np.array([0.0, 0.0, 1.3]), np.array([0.6, 0.0, 0.8]), 0.05)
RAY = Pointing(np.array([0.0, 0.0, 1.4]), np.array([1.0, 0.0, 0.0]), 0.1, EYE_RAY, ARM_RAY)
LAMP = replace(RAY, hit=Hit(np.array([3.0, 0.0, 1.4]), 'lamp', 0.0))


def person(*gestures, **values):
    values.setdefault('posture', Posture('standing', 0.0, 1.0))
    return PersonSignals(1, np.array([0.0, 0.0, 1.1]), gestures=gestures, **values)


def pointing(ray=RAY, arm='left'):
    return Gesture('point', arm, 0.0, 1.0, ray)


def shown(*persons):
    return {(marker.ns, marker.id): marker for marker in SignalMarkers().markers(persons, 0.0, UP)}


def test_no_person_and_a_hidden_one_have_none():
    assert shown() == shown(PersonSignals(1, np.full(3, np.nan))) == {}


def test_text_is_over_the_person():
    walks = person(Gesture('raise_hand', 'right', 0.0, 1.0), pointing(LAMP),
                   walk=Walk(True, 1.23, np.array([1.0, 0, 0])))
    assert text_of(walks) == 'standing, 1.2 m/s\nraise hand (right)\npoint (left) -> lamp'
    assert text_of(person(posture=Posture('lying'), fall=Fall(1.0, 0.5, 2.0))) == 'fallen, lying'
    assert text_of(person(posture=Posture(), walk=Walk(False, 0.02, np.zeros(3)))) == 'unknown'
    np.testing.assert_allclose(shown(person())['signals', 1].points[0], [0, 0, 2.05], atol=1e-6)
    assert shown(person(pointing()))['signals', 1].points[0, 2] > 2.1  # its last line stays there


def test_arrows_and_lines_end_where_they_meet_something():
    markers = shown(person(pointing(LAMP), body=Facing(AHEAD, 0.1), head=Facing(AHEAD, 0.1, np.array([0.4, 0.0, 0.3]))))
    for name, points in {('body_facing', 1): [[0, 0, 1.1], [0, 0.5, 1.1]],
                         ('head_facing', 1): [[0.4, 0, 0.3], [0.4, 0.25, 0.3]],
                         ('pointing', 2): [[0, 0, 1.4], [3, 0, 1.4]],
                         ('pointing_rays', 2): [[0, 0, 1.5], [0.9, 0, 0.3], [0, 0, 1.3], [0.9, 0, 2.5]]}.items():
        np.testing.assert_allclose(markers[name].points, points, atol=1e-6)
    np.testing.assert_allclose(shown(person(pointing()))['pointing', 2].points[1], [1.5, 0, 1.4], atol=1e-6)


@pytest.mark.parametrize('direction', [(1, 0, 0), (0, 0, -1), (0.6, 0.0, 0.8)])
def test_cone_is_two_sigma_wide(direction):
    lines = cone_lines(Ray(np.zeros(3), np.array(direction, float), 0.1), 2.0)
    ends = lines[np.linalg.norm(lines, axis=1) > 0]
    np.testing.assert_allclose(np.arccos(ends @ direction / np.linalg.norm(ends, axis=1)), 0.2, atol=1e-5)
    np.testing.assert_allclose(ends @ np.array(direction), 2.0, atol=1e-5)


def test_markers_of_an_ended_gesture_are_deleted():
    markers = SignalMarkers()
    markers.markers([person(pointing())], 0.0, UP)
    assert [(marker.ns, marker.id, marker.action) for marker in markers.markers([person()], 0.1, UP)] == [
        ('pointing', 2, 'delete'), ('pointing_cone', 2, 'delete'), ('pointing_rays', 2, 'delete'),
        ('signals', 1, 'add')]

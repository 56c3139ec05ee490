"""What RViz shows of signals."""
from dataclasses import replace

import numpy as np
import pytest

from openpose_ros_signals.records import Facing, Fall, Gesture, Hit, PersonSignals, Pointing, Posture, Ray, Walk
from openpose_ros_signals.show.markers import SignalMarkerParams, SignalMarkers, cone_lines, text_of

UP = np.array([0.0, 0.0, 1.0])
EYE_RAY = Ray(np.array([0.0, 0.0, 1.5]), np.array([0.6, 0.0, -0.8]), 0.05, None)
ARM_RAY = Ray(np.array([0.0, 0.0, 1.3]), np.array([0.6, 0.0, 0.8]), 0.05, None)
RAY = Pointing(np.array([0.0, 0.0, 1.4]), np.array([1.0, 0.0, 0.0]), 0.1, None, EYE_RAY, ARM_RAY)


def person(*gestures, name=1, **values):
    values.setdefault('posture', Posture('standing', 0.0, 1.0))
    return PersonSignals(name, np.array([0.0, 0.0, 1.1]), gestures=gestures, **values)


def pointing(ray=RAY, arm='left'):
    return Gesture('point', arm, 0.0, 1.0, ray)


def shown(*persons, stamp=0.0, **params):
    return {(marker.ns, marker.id): marker for marker in
            SignalMarkers(SignalMarkerParams(**params)).markers(persons, stamp, UP)}


def test_no_person_and_a_hidden_one_have_none():
    assert shown() == shown(PersonSignals(1, np.full(3, np.nan))) == {}


def test_text():
    lamp = replace(RAY, hit=Hit(np.array([3.0, 0.0, 1.4]), 'lamp'))
    walks = person(Gesture('raise_hand', 'right', 0.0, 1.0), pointing(lamp),
                   walk=Walk(True, 1.23, np.array([1.0, 0, 0])))
    assert text_of(walks) == 'standing, 1.2 m/s\nraise hand (right)\npoint (left) -> lamp'
    assert text_of(person(posture=Posture('lying'), fall=Fall(1.0, 0.5, 2.0))) == 'fallen, lying'
    assert text_of(person(posture=Posture(), walk=Walk(False, 0.02, np.zeros(3)))) == 'unknown'


def test_text_is_over_the_person():
    np.testing.assert_allclose(shown(person())['signals', 1].points[0], [0, 0, 2.05], atol=1e-6)
    # its last line stays there
    height = shown(person(pointing()), text_scale=0.2)['signals', 1].points[0, 2]
    assert height == pytest.approx(2.05 + 0.1, abs=1e-6)


def test_facing_arrows_have_their_lengths_and_that_of_a_head_begins_at_the_face():
    ahead, face = np.array([0.0, 1.0, 0.0]), np.array([0.4, 0.0, 0.3])
    markers = shown(person(body=Facing(ahead, 0.1), head=Facing(ahead, 0.1, face)), facing_length=0.6)
    for name, begin, length in (('body_facing', (0, 0, 1.1), 0.6), ('head_facing', face, 0.3)):
        np.testing.assert_allclose(markers[name, 1].points, [begin, begin + length * ahead], atol=1e-6)
    assert {ns for ns, _ in shown(person(body=Facing(ahead, 0.1)), facing_length=0.0)} == {'signals'}


def test_pointing_arrow_ends_where_it_meets_something():
    hit = replace(RAY, hit=Hit(np.array([3.0, 0.0, 1.4])))
    for ray, length in ((RAY, 1.5), (hit, 3.0)):
        np.testing.assert_allclose(shown(person(pointing(ray)))['pointing', 2].points, [[0, 0, 1.4], [length, 0, 1.4]],
                                   atol=1e-6)


def test_lines_from_eyes_and_shoulder_end_where_they_meet_something():
    wall = replace(RAY, eye_ray=replace(EYE_RAY, hit=Hit(np.array([1.8, 0.0, -0.9]))))
    np.testing.assert_allclose(shown(person(pointing(wall)), pointing_length=1.0)['pointing_rays', 2].points, [
        EYE_RAY.origin, [1.8, 0.0, -0.9], ARM_RAY.origin, [0.6, 0.0, 2.1]], atol=1e-6)


@pytest.mark.parametrize('direction', [(1, 0, 0), (0, 1, 0), (0, 0, -1), (0.6, 0.0, 0.8)])
def test_cone_is_two_sigma_wide(direction):
    lines = cone_lines(Ray(np.zeros(3), np.array(direction, float), 0.1, None), 2.0)
    ends = lines[np.linalg.norm(lines, axis=1) > 0]
    angles = np.arccos(ends @ np.array(direction) / np.linalg.norm(ends, axis=1))
    np.testing.assert_allclose(angles, 0.2, atol=1e-5)
    np.testing.assert_allclose(ends @ np.array(direction), 2.0, atol=1e-5)


def test_markers_of_an_ended_gesture_are_deleted():
    markers = SignalMarkers(SignalMarkerParams())
    markers.markers([person(pointing())], 0.0, UP)
    after = markers.markers([person()], 0.1, UP)
    assert [(marker.ns, marker.id, marker.action) for marker in after] == [
        ('pointing', 2, 'delete'), ('pointing_cone', 2, 'delete'), ('pointing_rays', 2, 'delete'),
        ('signals', 1, 'add')]

"""Scores of hands, gestures and pointing: the truth itself, and the truth changed in one way."""
import json

import numpy as np
import pytest

from scoring import hands, signals
from scoring.figures import figures

FRAMES, RATE = 20, 10.0
SIDES = ('left', 'right')
# Points of each finger in the order from the thumb to the little one: reversed.
OTHER_WAY = [0, *(4 * finger + joint for finger in (4, 3, 2, 1, 0) for joint in (1, 2, 3, 4))]


def hand_of(side, number):
    """Return a hand of 0.18 m and 100 px; hands are 0.5 m and 300 px apart."""
    random = np.random.RandomState(SIDES.index(side))
    xyz = random.uniform(-0.09, 0.09, (21, 3)) + np.array((0.5 * SIDES.index(side) + 0.01 * number, 0.0, 1.3))
    uv = random.uniform(0, 100, (21, 2)) + np.array((300.0 * SIDES.index(side) + 100, 200.0))
    return hands.Hand(side == 'left', uv, xyz)


@pytest.fixture
def hand_scene(tmp_path):
    frames = [{'i': number, 't': number / RATE, 'people': [{'id': 1, 'hands': [
        {'side': side, 'uv': hand_of(side, number).uv.tolist(), 'xyz': hand_of(side, number).xyz.tolist(),
         'vis': [2] * 18 + [1] * 3} for side in SIDES]}]} for number in range(FRAMES)]
    (tmp_path / 'gt.json').write_text(json.dumps({'joints': [], 'frames': frames}))
    return tmp_path


def scored_hands(scene, change):
    """Return the figures of the true hands as `change(hand) -> [hand, ...]` makes them."""
    frames = [(number / RATE, ([each for side in SIDES for each in change(hand_of(side, number))], []))
              for number in range(FRAMES)]
    return figures([hands.score_hands(scene, frames)], hands.STATISTICS, 0)


@pytest.mark.parametrize('change, expected', [
    (lambda hand: [], {'recall': 0, 'precision': None, 'visible_20': 0, 'visible_median': None}),
    (lambda hand: [hand], {'recall': 1, 'precision': 1, 'side': 1, 'visible_10': 1, 'hidden_20': 1, 'image_01': 1,
                           'visible_median': 0}),
    (lambda hand: [hand._replace(xyz=hand.xyz + np.array((0, 0, 0.015)))],
     {'visible_10': 0, 'visible_20': 1, 'visible_median': 15, 'image_01': 1}),
    (lambda hand: [hand._replace(left=not hand.left)], {'side': 0, 'visible_10': 1}),
    (lambda hand: [hand._replace(xyz=np.full((21, 3), np.nan))], {'visible_20': 0, 'image_01': 1}),
    (lambda hand: [hand] if hand.left else [], {'recall': 0.5, 'precision': 1, 'visible_20': 0.5}),
    (lambda hand: [hand, hand._replace(uv=hand.uv + 600)], {'precision': 0.5, 'recall': 1})])
def test_hands(hand_scene, change, expected):
    result = scored_hands(hand_scene, change)
    assert {name: result[name].value for name in expected} == pytest.approx(expected, abs=1e-9)


def test_sigma_of_hands_counts_by_status(hand_scene):
    status, sigma = np.array([1] * 11 + [2] * 10), np.array([0.01] * 16 + [0.001] * 5)
    result = scored_hands(hand_scene, lambda hand: [hand._replace(
        xyz=hand.xyz + np.array((0, 0, 0.015)), status=status, sigma=sigma)] if hand.left else [])
    assert (result['measured_within_2_sigma'].value, result['inferred_within_2_sigma'].value) == (1, 0.5)


def test_fingers_in_the_wrong_order_are_wrong(hand_scene):
    result = scored_hands(hand_scene, lambda hand: [hand._replace(xyz=hand.xyz[OTHER_WAY])])
    assert result['visible_20'].value < 0.5


def test_directions_of_faces(tmp_path):
    names = ('left_eye_inner', 'left_eye_outer', 'right_eye_inner', 'right_eye_outer', 'mouth_left', 'mouth_right')
    # looks at the camera: z away from it, y down, the left side of the face to the right
    xyz = np.array([(0.02, 0, 2), (0.05, 0, 2), (-0.02, 0, 2), (-0.05, 0, 2), (0.03, 0.08, 2), (-0.03, 0.08, 2)])
    (tmp_path / 'gt.json').write_text(json.dumps({'joints': [], 'face_points': names, 'frames': [
        {'i': 0, 't': 0.0, 'people': [{'id': 1, 'face': {'xyz': xyz.tolist()}}]}]}))
    angle = np.radians(20)
    faces = [hands.Face(xyz, np.array((np.sin(angle), 0, -np.cos(angle))), angle / 1.5),
             hands.Face(xyz + 1, np.array((1.0, 0, 0)), 0.1)]
    result = figures([hands.score_hands(tmp_path, [(0.0, ([], faces))])], hands.STATISTICS, 0)
    assert (result['head_median'].value, result['head_median'].n) == (pytest.approx(20), 1)
    assert (result['head_within_1_sigma'].value, result['head_within_2_sigma'].value) == (0, 1)


TARGET, SHOULDER = np.array((2.0, -0.5, 3.0)), np.array((0.2, 0.0, 2.5))


def labels_at(person, number):
    """Person 1 waves, from the tenth frame on points with the right arm; person 2 raises a hand, then sits."""
    if person == 1:
        return ['stand', 'wave' if number < 10 else 'point']
    return ['stand', 'raise_hand'] if number < 10 else ['sit']


def neck_of(person):
    return np.array((2.0 * person, 0.0, 3.0))


@pytest.fixture
def signal_scene(tmp_path):
    frames = [{'i': number, 't': number / RATE, 'people': [
        {'id': person, 'xyz': [neck_of(person).tolist()], 'labels': labels_at(person, number), 'detail': [
            {'label': label, **({} if label in ('sit', 'stand') else {'arm': 'right'}),
             **({'target': TARGET.tolist(), 'style': 'eye'} if label == 'point' else {})}
            for label in labels_at(person, number)]}
        for person in (1, 2)]} for number in range(FRAMES)]
    (tmp_path / 'gt.json').write_text(json.dumps({'joints': ['neck'], 'frames': frames}))
    return tmp_path


def true_labels(person, number):
    """Return the true labels, with a ray to the target."""
    return {label: signals.Label('right', SHOULDER, TARGET - SHOULDER) if label == 'point' else signals.Label('right')
            for label in labels_at(person, number)}


def scored(scene, change=lambda labels: labels, late=0, margin=0.0, away=0.0):
    frames = [(number / RATE, [
        signals.Person(neck_of(person) + away, change(true_labels(person, max(number - late, 0))))
        for person in (1, 2)]) for number in range(FRAMES)]
    counts = signals.score_signals(scene, frames, margin)
    return {name: figure.value for name, figure in figures([counts], signals.STATISTICS, 0).items()}


@pytest.mark.parametrize('change, how, expected', [
    (lambda labels: {}, {}, {'f1': 0, 'point_given': 0, 'point_15': 0, 'arm': None}),
    (lambda labels: labels, {}, {'f1': 1, 'arm': 1, 'point_given': 1, 'point_10': 1, 'point_median': 0,
                                 'f1_arms_crossed': None}),  # neither made nor reported
    (lambda labels: {{'wave': 'arms_crossed'}.get(name, name): each for name, each in labels.items()}, {},
     {'f1_wave': 0, 'f1_arms_crossed': 0, 'f1_point': 1}),
    (lambda labels: {**labels, 'wave': signals.Label()}, {}, {'f1_wave': 2 * 10 / (2 * 10 + 30)}),
    (lambda labels: labels, {'away': 9.0}, {'f1': 0, 'point_given': 0}),
    (lambda labels: labels, {'late': 2, 'margin': 0.25}, {'f1': 1})])
def test_labels(signal_scene, change, how, expected):
    result = scored(signal_scene, change, **how)
    assert {name: result[name] for name in expected} == pytest.approx(expected, abs=1e-5)


def test_late_labels_without_a_margin_are_wrong(signal_scene):
    assert 0.5 < scored(signal_scene, late=2)['f1'] < 1


def test_the_angle_of_a_ray(signal_scene):
    def turned(labels):
        ray = labels.get('point')
        if ray is None:
            return labels
        side = np.cross(ray.direction, (0.0, 1.0, 0.0))
        side *= np.linalg.norm(ray.direction) / np.linalg.norm(side) * np.tan(np.radians(12))
        return {**labels, 'point': ray._replace(direction=ray.direction + side)}
    result = scored(signal_scene, turned)
    assert result['point_median'] == pytest.approx(12)
    assert (result['point_10'], result['point_15']) == (0, 1)


def test_coverage_of_the_ray_and_of_that_of_the_true_style(signal_scene):
    side = np.cross(TARGET - SHOULDER, (0.0, 1.0, 0.0))
    side *= np.linalg.norm(TARGET - SHOULDER) / np.linalg.norm(side)

    def rays(labels):
        """Return the labels with rays that are off by 11, 3 and 9 deg, each with a sigma of 6 deg."""
        middle, eye, shoulder = (signals.Label('right', SHOULDER, TARGET - SHOULDER + np.tan(np.radians(off)) * side,
                                              np.radians(6)) for off in (11, 3, 9))
        return {name: middle._replace(styles={'eye': eye, 'shoulder': shoulder}) if name == 'point' else each
                for name, each in labels.items()}
    result = scored(signal_scene, rays)
    assert (result['eye_sigmas_1'], result['eye_sigmas_2']) == (0, 1)
    assert result['eye_own_sigmas_1'] == 1
    assert result['shoulder_sigmas_2'] is None

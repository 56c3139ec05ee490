"""Scores of bounds below distances: of the true people none is broken, of people elsewhere they are."""
from dataclasses import replace

import numpy as np
import pytest

from development import ROOT
from ground_truth import true_frames
from openpose_ros_bridges.moving_parts import Links
from openpose_ros_signals.capsules import Capsules
from scoring import separation
from scoring.figures import figures
from scoring.separation import STATISTICS, Delivery, score_separation, true_distance

SCENE = ROOT / 'development/benchmark_data/scenes/10_lie'


@pytest.fixture(autouse=True)
def one_robot(monkeypatch):
    monkeypatch.setattr(separation, 'ROBOTS', 1)


def moved_people(beside):
    return [(true.time, replace(true.people, xyz=true.people.xyz + np.float32([beside, 0, 0]),
                                velocity=np.zeros(true.xyz.shape))) for true in true_frames(SCENE)]


def scored(delivery, beside=0.0):
    return {name: figure.value for name, figure in figures([score_separation(
        SCENE, moved_people(beside), delivery)], STATISTICS, 0).items()}


def test_the_truth_breaks_no_bound_people_elsewhere_do():
    found = scored(Delivery(late=0.0))
    assert found['broken'] == 0 and 0 < found['slack'] < 0.2
    assert scored(Delivery(late=0.2))['slack'] > found['slack']
    assert max(scored(Delivery(), beside)['broken'] for beside in (-2.0, 2.0)) > 0.1


def test_after_the_last_people_the_bound_goes_to_zero():
    found = scored(Delivery(end=0.5))
    assert found['zero'] > 0.1
    assert found['until_zero'] <= 1.0


def test_true_distance():
    capsule = Capsules(np.array([4]), np.zeros(1, int), np.zeros((1, 2), int), np.array([[[0.0, 0, 0], [1.0, 0, 0]]]),
                       np.array([0.1]), np.zeros((1, 2)), np.zeros((1, 2, 3)), np.ones(1, bool))
    links = Links(['a', 'b'], np.array([[0.5, 2.0, 0.0], [3.0, 0.0, 0.0]]), np.array([0.2, 0.5]), np.zeros(2))
    assert true_distance(capsule, links) == (pytest.approx(1.4), 4)
    assert true_distance(replace(capsule, radii=np.array([5.0])), links)[0] == 0.0

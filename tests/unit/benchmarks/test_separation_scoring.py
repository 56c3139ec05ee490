"""Scores of bounds below distances: of the true people none is broken, of people elsewhere they are."""
from dataclasses import replace

import numpy as np
import pytest

from chain_runs import read_truth
from development import ROOT
from openpose_ros_bridges.capsules import Capsules
from openpose_ros_bridges.moving_parts import Links
from openpose_ros_pkg.skeletons import COCO_18
from scoring import separation
from scoring.figures import figures
from scoring.separation import STATISTICS, Delivery, score_separation, true_distance
from skeleton_extract_3d.people import MEASURED, People3D

SCENE = ROOT / 'development/benchmark_data/scenes/10_lie'


@pytest.fixture(autouse=True)
def one_robot(monkeypatch):
    monkeypatch.setattr(separation, 'ROBOTS', 1)


def true_people(beside=0.0, sigma=0.01):
    truth, order = read_truth(SCENE)
    for frame in truth['frames']:
        xyz = np.array([person['xyz'] for person in frame['people']]).reshape(-1, 18, 3)[:, order]
        shape = xyz.shape[:2]
        ids = [person['id'] for person in frame['people']]
        yield frame['t'], People3D(COCO_18, xyz + np.array([beside, 0.0, 0.0]), np.ones(shape),
                                   np.full(shape, MEASURED), np.full(shape, sigma), ids, np.zeros((*shape, 3)))


def scored(delivery, **how):
    return {name: figure.value for name, figure in figures([score_separation(
        SCENE, list(true_people(**how)), delivery)], STATISTICS, 0).items()}


def test_the_truth_breaks_no_bound():
    found = scored(Delivery(late=0.0))
    assert found['broken'] == 0
    assert 0 < found['slack'] < 0.2
    assert scored(Delivery(late=0.2))['slack'] > found['slack']


def test_people_who_are_elsewhere_break_it():
    assert max(scored(Delivery(), beside=beside)['broken'] for beside in (-2.0, 2.0)) > 0.1


def test_after_the_last_people_the_bound_goes_to_zero():
    found = scored(Delivery(end=0.5))
    assert found['zero'] > 0.1
    assert found['until_zero'] <= 1.0


def test_deliveries():
    times = np.arange(20) / 10
    comes = {name: [delivery.comes(number, time, number / 20) for number, time in enumerate(times)]
             for name, delivery in {'half': Delivery(every=2), 'pause': Delivery(pause=0.5),
                                    'end': Delivery(end=0.5)}.items()}
    assert comes['half'] == [True, False] * 10
    assert comes['pause'] == ([True] * 5 + [False] * 5) * 2
    assert comes['end'] == [True] * 10 + [False] * 10


def test_true_distance():
    capsule = Capsules(np.array([4]), np.zeros(1, int), np.zeros((1, 2), int), np.array([[[0.0, 0, 0], [1.0, 0, 0]]]),
                       np.array([0.1]), np.zeros((1, 2)), np.zeros((1, 2, 3)), np.ones(1, bool))
    links = Links(['a', 'b'], np.array([[0.5, 2.0, 0.0], [3.0, 0.0, 0.0]]), np.array([0.2, 0.5]), np.zeros(2))
    assert true_distance(capsule, links) == (pytest.approx(1.4), 4)
    assert true_distance(replace(capsule, radii=np.array([5.0])), links)[0] == 0.0

"""The Bernoulli filter by hand: posterior probabilities of detections, misses and time."""
import numpy as np
import pytest

from openpose_ros_pkg.detect.existence import EXISTENCE, decayed, of_detection, of_emptiness, of_miss, with_evidence

PRIORS = np.array([0.05, 0.3, 0.5, 0.9])
FOUND = EXISTENCE.detection  # probability that a look finds a person in free view


@pytest.mark.parametrize('ratio', [0.1, 1.0, 3.0, 20.0])
def test_evidence_multiplies_the_odds(ratio):
    expected = PRIORS * ratio / (1 - PRIORS + PRIORS * ratio)
    np.testing.assert_allclose(with_evidence(PRIORS, np.log(ratio)), np.minimum(expected, EXISTENCE.most))


def test_no_evidence_makes_certain():
    assert with_evidence(0.5, 50.0) == EXISTENCE.most
    assert 0 < with_evidence(1.0, -50.0) < EXISTENCE.ended


@pytest.mark.parametrize('of, share, time', [(of_miss, 0.25, EXISTENCE.independent), (
    of_miss, 1.0, EXISTENCE.independent), (of_emptiness, 0.5, EXISTENCE.independent_depth)])
def test_an_independent_look_in_vain_has_bayes_posterior(of, share, time):
    seen = FOUND * (share ** 2 if of is of_miss else share)
    expected = PRIORS * (1 - seen) / (1 - PRIORS * seen)
    np.testing.assert_allclose(with_evidence(PRIORS, of(share, time)), expected)
    assert of(share, 100 * time) == of(share, time)


@pytest.mark.parametrize('of', [of_miss, of_emptiness])
def test_where_no_person_could_be_seen_a_look_in_vain_tells_nothing(of):
    assert of(0.0, 1.0) == 0
    assert with_evidence(0.7, of(0.0, 1.0)) == pytest.approx(0.7)


@pytest.mark.parametrize('looks', [4, 6, 9, 60])
def test_looks_in_vain_tell_the_same_however_often_they_are_in_a_time(looks):
    """0.6 s at 7 to 100 Hz."""
    existence = 0.9
    for since in np.full(looks, 0.6 / looks):
        existence = with_evidence(existence, of_miss(0.5, since))
    odds = 9 * (1 - FOUND * 0.5 ** 2) ** (0.6 / EXISTENCE.independent)
    assert existence == pytest.approx(odds / (1 + odds))


def test_two_looks_at_one_image_are_one():
    assert of_miss(1.0, 0.0) == of_miss(1.0, -0.1) == 0


def test_a_detection_tells_by_its_score():
    even, few = EXISTENCE.even_score, EXISTENCE.least_evidence
    np.testing.assert_allclose(of_detection(even + EXISTENCE.score_scale * np.array([-2, 0, 1, 9])), [few, few, 1, 9])
    assert with_evidence(0.5, of_detection(even)) > EXISTENCE.reported  # a new person, just accepted


def test_time_alone_fades_a_person():
    assert decayed(0.8, 2.0, 2.0) == pytest.approx(0.8 / np.e)
    assert decayed(decayed(0.8, 0.4, 2.0), 0.6, 2.0) == pytest.approx(decayed(0.8, 1.0, 2.0))
    assert decayed(0.8, -1.0, 2.0) == 0.8  # an image that comes late

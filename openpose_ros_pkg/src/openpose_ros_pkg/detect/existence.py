"""Probability that a tracked person is there: a Bernoulli filter, one step for each kind of evidence.

A track exists with a probability r (Musicki, Evans and Stankovic 1994, integrated probabilistic data association;
Ristic, Vo, Vo and Farina 2013, A tutorial on Bernoulli filters). Between frames r decays; a detection multiplies the
odds r / (1 - r) by its likelihood ratio, a look that finds no person by 1 - p_D v^2, where v is the share of the body
that the camera would see. Looks that follow each other closely repeat their errors: each counts for the time since the
last one.
"""
from dataclasses import dataclass
from typing import Union

import numpy as np

from openpose_ros_pkg.params.constants import constant

Value = Union[float, np.ndarray]


@dataclass(frozen=True)
class ExistenceConstants:
    """What looks tell of the existence of a person."""

    detection: float = constant(0.9, 'Probability that a look finds a person in free view, p_D.')
    independent: float = constant(
        0.25, 'Looks this far apart err independently; of closer ones each counts for its share of this time.',
        unit='s')
    independent_depth: float = constant(0.08, 'The same of the points, which show that a place is empty.', unit='s')
    even_score: float = constant(
        0.3, 'Score of a detection that tells nothing: as frequent without a person.',
        source='scores below 0.35: 43 people and 31 others in 80 photographs and five dark rendered rooms; above 0.45: '
               'all but 4 of 556 are people')
    score_scale: float = constant(0.08, 'A score higher by this multiplies the odds by e.')
    least_evidence: float = constant(0.1, 'Least logarithm of the likelihood ratio of an accepted detection.')
    unseen: float = constant(
        0.4, 'Probability before the first detection: one that tells little is not reported until the next.',
        source='trials.md, PP-TinyPose')
    born: float = constant(0.8, 'Greatest probability after one detection.')
    most: float = constant(0.995, 'Greatest probability: every track may be wrong.')
    leaving: float = constant(
        1.0, 'Time in which the probability of a person outside of the image falls to 1/e.', unit='s')
    reported: float = constant(0.5, 'People are reported from this probability on.')
    ended: float = constant(0.05, 'Tracks end below this probability.')
    free_view: float = constant(0.5, 'People with a smaller visible share count as hidden.')


EXISTENCE = ExistenceConstants()


def with_evidence(existence: Value, log_ratio: Value, constants: ExistenceConstants = EXISTENCE) -> np.ndarray:
    """Return probabilities after evidence with a logarithm of the likelihood ratio of person to no person."""
    existence = np.minimum(existence, constants.most)
    odds = existence / (1 - existence) * np.exp(log_ratio)
    return np.minimum(odds / (1 + odds), constants.most)


def decayed(existence: Value, elapsed: Value, lasting: Value) -> np.ndarray:
    """Return probabilities after a time [s] without a look, with time constants `lasting` [s]."""
    return existence * np.exp(-np.maximum(elapsed, 0.0) / lasting)


def of_detection(scores: Value, constants: ExistenceConstants = EXISTENCE) -> np.ndarray:
    """Return the logarithms of the likelihood ratios of detections with scores of people [0..1]."""
    ratio = (np.asarray(scores, np.float64) - constants.even_score) / constants.score_scale
    return np.maximum(ratio, constants.least_evidence)


def of_miss(visibility: Value, since: Value, constants: ExistenceConstants = EXISTENCE) -> np.ndarray:
    """Return the logarithms of the likelihood ratios of looks that found no person.

    Args:
        visibility: share of the body that the camera would see [0..1]; of half a body, networks find a quarter.
        since: time since the look before [s].
    """
    weight = np.minimum(np.maximum(since, 0.0) / constants.independent, 1.0)
    return weight * np.log1p(-constants.detection * np.clip(visibility, 0.0, 1.0) ** 2)


def of_emptiness(empty: Value, since: Value, constants: ExistenceConstants = EXISTENCE) -> np.ndarray:
    """Return the logarithms of the likelihood ratios of points that show something behind a person.

    Args:
        empty: probability that they would, if no person were there [0..1].
        since: time since the points before [s].
    """
    weight = np.minimum(np.maximum(since, 0.0) / constants.independent_depth, 1.0)
    return weight * np.log1p(-constants.detection * np.clip(empty, 0.0, 1.0))

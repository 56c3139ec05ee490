"""Many simulated people: gestures are told of all of them, motions that are nearly gestures are not."""
import numpy as np
import pytest

from simulated_population import BEGIN, END, GESTURES, NEARLY, found, gestures, nearly, told_of

PEOPLE = 6
# What is told after this time since the arm is where the gesture begins, and a period of the frames [s].
PROMPT = {'point': 0.3, 'raise_hand': 0.3, 'arms_crossed': 0.3, 'stop': 0.45, 'wave': 1.1, 'beckon': 1.1}


@pytest.mark.parametrize('name', GESTURES)
def test_gestures(name):
    random, shares = np.random.RandomState(7), []
    for _ in range(PEOPLE):
        signals = told_of(gestures(name, random), random)
        stamps = [stamp for stamp, person in signals if person.gesture(name)]
        assert stamps and stamps[0] <= BEGIN + PROMPT[name] + np.diff([stamp for stamp, _ in signals]).max()
        shares += [person.gesture(name) is not None for stamp, person in signals if BEGIN + 0.8 < stamp < END]
    assert np.mean(shares) > 0.85


@pytest.mark.parametrize('name', NEARLY)
def test_nearly_a_gesture(name):
    random, told = np.random.RandomState(7), []
    for _ in range(PEOPLE):
        signals = told_of(nearly(name, random), random, 5.0)
        told += found(signals)
        assert not any(person.fall for _, person in signals)
    assert len(told) <= 1  # the noise of a small child's joints can be as large as a small wave

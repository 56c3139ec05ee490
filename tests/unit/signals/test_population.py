"""Many simulated people: each gesture is told of the right arm and alone, what is nearly a gesture is not."""
import numpy as np
import pytest

from simulated_population import BEGIN, END, GESTURES, NEARLY, arm_of, found, gestures, nearly, told_of

PEOPLE = 6
# What is told after this time since the arm is where the gesture begins, and a period of the frames [s].
PROMPT = {'stop': 0.45, 'wave': 1.1}  # others: 0.3


@pytest.mark.parametrize('name', GESTURES)
def test_gestures(name):
    random, shares = np.random.RandomState(7), []
    for _ in range(PEOPLE):
        motion = gestures(name, random)
        signals = told_of(motion, random)
        told = [(stamp, gesture) for stamp, person in signals for gesture in person.gestures]
        period = np.diff([stamp for stamp, _ in signals]).max()
        assert told[0][0] <= BEGIN + PROMPT.get(name, 0.3) + period and told[-1][0] <= END + 0.4
        arm = 'both' if name == 'arms_crossed' else arm_of(motion)
        assert {(gesture.name, gesture.arm) for _, gesture in told} == {(name, arm)}
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

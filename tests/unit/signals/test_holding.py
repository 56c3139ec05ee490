"""Hysteresis and least durations."""
import numpy as np
import pytest

from openpose_ros_signals.constants import SIGNALS
from openpose_ros_signals.holding import Held

RATES = (5, 10, 30)


def play(held, degrees, rate):
    """Return when it is on, by stamp [s]; degrees are a function of time."""
    stamps = np.arange(0, 3, 1 / rate)
    on = []
    for stamp in stamps:
        held.take(stamp, degrees(stamp))
        on.append(held.on)
    return stamps, np.array(on)


@pytest.mark.parametrize('rate', RATES)
def test_it_begins_and_ends_a_least_time_later(rate):
    held = Held(SIGNALS.hold)
    stamps, on = play(held, lambda stamp: 0.8 if 0.995 < stamp < 1.995 else 0.0, rate)
    assert 1.1 <= stamps[on][0] + 0.01 <= 1.12 + 1 / rate
    assert 2.0 <= stamps[on][-1] + 1 / rate + 0.01 <= 2.12 + 1 / rate
    assert held.since == pytest.approx(1.0, abs=0.01)


def test_the_confidence_is_the_mean_degree_of_late():
    held = Held(SIGNALS.hold)
    play(held, lambda stamp: 0.8, 10)
    assert held.confidence == pytest.approx(0.8)
    held.take(3.0, 0.6)
    assert 0.7 < held.confidence < 0.8


def test_between_the_thresholds_it_stays_as_it_is():
    assert not play(Held(SIGNALS.hold), lambda stamp: 0.5, 10)[1].any()
    assert play(Held(SIGNALS.hold), lambda stamp: 0.9 if stamp < 0.5 else 0.5, 10)[1][2:].all()


def test_a_moment_neither_begins_nor_ends_it():
    assert not play(Held(SIGNALS.hold), lambda stamp: float(0.98 < stamp < 1.05), 30)[1].any()
    assert play(Held(SIGNALS.hold), lambda stamp: float(not 0.98 < stamp < 1.05), 30)[1][5:].all()


def test_what_holds_wholly_may_begin_at_once():
    assert play(Held(SIGNALS.hold, at_once=True), lambda stamp: 1.0, 10)[1].all()
    assert not play(Held(SIGNALS.hold, at_once=True), lambda stamp: 0.61, 10)[1][0]


def test_it_goes_on_for_a_while_when_hidden_and_then_ends():
    stamps, on = play(Held(SIGNALS.hold), lambda stamp: 1.0 if stamp < 1 else np.nan, 10)
    assert stamps[on][-1] == pytest.approx(1.3, abs=0.06)
    assert not play(Held(SIGNALS.hold), lambda stamp: np.nan, 10)[1].any()


def test_what_holds_no_more_after_a_while_without_the_person_ends_at_once():
    held = Held(SIGNALS.hold)
    play(held, lambda stamp: 1.0, 10)
    held.take(3.8, 0.0)
    assert not held.on


def test_what_was_sure_before_it_was_hidden_does_not_count_after():
    held = Held(SIGNALS.hold)
    for stamp, degree in ((0.0, 1.0), (0.05, np.nan), (1.0, np.nan), (1.1, 1.0)):
        held.take(stamp, degree)
    assert not held.on

"""Less is computed where the processor is too slow, and never more."""
import dataclasses

import pytest

from openpose_ros_pkg.detect import target_rate
from openpose_ros_pkg.detect.recipes import FASTER, MODES, DetectorParams, NetworkPass, Recipe, recipe_of
from openpose_ros_pkg.detect.target_rate import fitted_to_rate, foreseen_seconds
from openpose_ros_pkg.networks.models import MOBILENET_THIN, MODELS, MOVENET_MULTIPOSE, MOVENET_THUNDER

THIN = 656 * 368  # pixels of the input that a 960 x 540 image gives
MOVENET, CLOSER = 512 * 288, 256 * 256
# Seconds per pixel: about those of two cores of a laptop.
PACE = {'mobilenet_thin': 1.5e-7, 'movenet_multipose': 2e-7, 'movenet_thunder': 1e-7}


class Clock:
    """Time that passes only while a network computes, and a processor on which other programs run as well.

    Args:
        threads: that compute the network.
        others: wall time per time that the network needs.
    """

    def __init__(self, threads=1, others=1.0):
        self.seconds, self._threads, self._others = 0.0, threads, others

    def perf_counter(self):
        return self.seconds * self._others

    def process_time(self):
        return self.seconds * self._threads


class TimedNetwork:
    """Takes so many seconds per pixel of its input, and longer the first time."""

    def __init__(self, clock, pace):
        self._clock, self._pace, self.runs = clock, pace, 0

    def infer(self, images):
        self._clock.seconds += images.shape[1] * images.shape[2] * self._pace * (100 if self.runs == 0 else 1)
        self.runs += 1
        return ()


def fitted(recipe, rate, monkeypatch, pace=PACE, threads=1, others=1.0):
    clock = Clock(threads, others)
    monkeypatch.setattr(target_rate, 'time', clock)
    networks = {model.name: TimedNetwork(clock, pace.get(model.name, PACE['mobilenet_thin']))
                for model in recipe.models}
    return fitted_to_rate(recipe, networks, rate, threads)


def rate_for(seconds):
    """Rate at which the networks may take just so long: half of a frame's time."""
    return 0.5 / (seconds * 1.0001)


def for_two(recipe):
    """The recipe where there is just time to refine two people."""
    return dataclasses.replace(recipe, max_refined=2)


def alone(name='mobilenet_thin', **params):
    return recipe_of(DetectorParams(pose_model=name, **params))


# --- how long it takes ----------------------------------------------------------------------------------------------

def test_time_goes_with_the_pixels_of_all_inputs():
    """Two people are refined."""
    recipe = MODES['balanced']
    assert [one.box for one in recipe.passes] == [(656, 368), (512, 512)] and len(recipe.refinements) == 1
    for network, pixels in (('mobilenet_thin', THIN), ('movenet_multipose', MOVENET), ('movenet_thunder', 2 * CLOSER)):
        assert foreseen_seconds(recipe, {**dict.fromkeys(PACE, 0.0), network: 1.0}) == pixels


def test_fewer_refinements_take_less():
    pace = {'mobilenet_thin': 0.0, 'movenet_multipose': 1.0, 'movenet_thunder': 1.0}
    assert foreseen_seconds(recipe_of(DetectorParams(look_closer=1)), pace) == MOVENET + CLOSER
    assert foreseen_seconds(recipe_of(DetectorParams(look_closer=0)), pace) == MOVENET


def test_scales_and_mirror_images_count():
    once = foreseen_seconds(alone(), {'mobilenet_thin': 1.0})
    assert foreseen_seconds(alone(mirror='always'), {'mobilenet_thin': 1.0}) == 2 * once
    assert foreseen_seconds(alone(num_scales=2, scale_gap=0.5), {'mobilenet_thin': 1.0}) == pytest.approx(
        1.25 * once, rel=0.03)


# --- several networks -----------------------------------------------------------------------------------------------

@pytest.mark.parametrize('mode', MODES)
def test_a_fast_machine_computes_what_is_wanted(mode, monkeypatch):
    assert fitted(MODES[mode], 0.01, monkeypatch) == MODES[mode]


def test_the_mode_that_just_fits_stays(monkeypatch):
    recipe = MODES['balanced']
    seconds = foreseen_seconds(recipe, PACE)
    assert fitted(recipe, rate_for(seconds), monkeypatch) == for_two(recipe)
    assert fitted(recipe, rate_for(0.99 * seconds), monkeypatch).passes != recipe.passes


@pytest.mark.parametrize('step', range(len(FASTER)))
def test_the_most_accurate_that_fits_is_taken(step, monkeypatch):
    rate = rate_for(foreseen_seconds(FASTER[step], PACE))
    assert fitted(MODES['balanced'], rate, monkeypatch) == for_two(FASTER[step])


def test_each_step_down_is_faster():
    seconds = [foreseen_seconds(recipe, PACE) for recipe in FASTER]
    assert seconds == sorted(seconds, reverse=True) and len(set(seconds)) == len(seconds)


def test_the_last_step_is_taken_where_nothing_is_fast_enough(monkeypatch):
    assert fitted(MODES['balanced'], 1000.0, monkeypatch) == for_two(FASTER[-1])


def test_a_network_that_is_not_wanted_is_not_put_in(monkeypatch):
    """The mode fast has no mobilenet_thin."""
    for rate in (20.0, 1000.0):
        assert fitted(MODES['fast'], rate, monkeypatch).models == (MOVENET_MULTIPOSE, MOVENET_THUNDER)


@pytest.mark.parametrize('rate', [10.0, 20.0, 1000.0])
def test_a_network_that_is_missing_is_not_put_in(rate, monkeypatch):
    for missing in (MOVENET_THUNDER, MOVENET_MULTIPOSE):
        wanted = MODES['balanced'].without([missing])
        assert set(fitted(wanted, rate, monkeypatch).models) <= set(wanted.models)


@pytest.mark.parametrize('people, refined', [(2.0, 2), (3.5, 3), (6.5, 6), (50.0, 20)])
def test_no_more_people_are_refined_than_there_is_time_for(people, refined, monkeypatch):
    """And no more than the mode has."""
    recipe = MODES['fast']
    seconds = PACE['movenet_multipose'] * 384 * 224 + PACE['movenet_thunder'] * people * CLOSER
    assert fitted(recipe, rate_for(seconds), monkeypatch) == dataclasses.replace(recipe, max_refined=refined)


def test_no_more_people_are_refined_than_was_wanted(monkeypatch):
    for rate in (0.01, 1000.0):
        assert fitted(recipe_of(DetectorParams(look_closer=1)), rate, monkeypatch).max_refined == 1


@pytest.mark.parametrize('mode', ['balanced', 'fast'])
def test_who_wants_no_refinement_gets_none(mode, monkeypatch):
    recipe = recipe_of(DetectorParams(mode=mode, look_closer=0))
    seconds = foreseen_seconds(recipe, PACE)
    for rate in (rate_for(0.9 * seconds), 1000.0):
        less = fitted(recipe, rate, monkeypatch)
        assert less.refinements == () and foreseen_seconds(less, PACE) < seconds


def test_of_two_networks_both_stay_as_long_as_they_fit(monkeypatch):
    recipe = recipe_of(DetectorParams(look_closer=0))
    less = fitted(recipe, rate_for(0.9 * foreseen_seconds(recipe, PACE)), monkeypatch)
    assert less.models == (MOBILENET_THIN, MOVENET_MULTIPOSE)


def test_never_more_than_what_was_wanted(monkeypatch):
    """Inputs that the user made small already."""
    for mode in ('fast', 'balanced'):
        recipe = recipe_of(DetectorParams(mode=mode, net_input_height=64))
        less = fitted(recipe, 1000.0, monkeypatch)
        assert foreseen_seconds(less, PACE) <= foreseen_seconds(recipe, PACE)


# --- one network ----------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('seconds, box', [
    # 10 Hz leave the network 50 ms of each 100
    (0.030, (656, 368)), (0.0499, (656, 368)),
    # 128 ms are too long: the area shrinks by 50 / 128, the sides by 0.625, to multiples of 8
    (0.128, (408, 224)),
    # never below half the sides
    (2.0, (328, 184))])
def test_the_input_shrinks_as_far_as_the_target_rate_needs(seconds, box, monkeypatch):
    recipe = alone()
    less = fitted(recipe, 10.0, monkeypatch, pace={'mobilenet_thin': seconds / THIN})
    assert less == dataclasses.replace(recipe, passes=(dataclasses.replace(recipe.passes[0], box=box),))


def test_a_free_side_stays_free(monkeypatch):
    less = fitted(alone(net_input_height=368), 1000.0, monkeypatch)
    assert less.passes[0].box == (-1, 184)


def test_sides_are_multiples_of_what_the_network_takes(monkeypatch):
    less = fitted(alone('BODY_25', net_input_width=640, net_input_height=352), 10.0, monkeypatch,
                  pace={'body_25': 0.0979 / (626 * 352)})
    assert less.passes[0].box == (448, 240)  # 0.714 of 640 and 352 is 457 and 251


def test_a_network_of_one_size_stays(monkeypatch):
    """Its box has no effect."""
    recipe = alone('rtmo_s')
    pace = {'rtmo_s': 1e-3}
    less = fitted(recipe, 10.0, monkeypatch, pace)
    assert foreseen_seconds(less, pace) == foreseen_seconds(recipe, pace) == 640 * 640 * 1e-3


def test_scales_and_the_mirror_stay(monkeypatch):
    less = fitted(alone(num_scales=2, mirror='always'), 10.0, monkeypatch, pace={'mobilenet_thin': 1e-6})
    assert less.passes[0].mirror and less.passes[0].zooms == (1.0, 0.7)


# --- measuring ------------------------------------------------------------------------------------------------------

def test_the_first_run_does_not_count(monkeypatch):
    """It compiles the network."""
    recipe = Recipe((NetworkPass(MOBILENET_THIN, (656, 368)),))
    assert fitted(recipe, 10.0, monkeypatch, pace={'mobilenet_thin': 0.049 / THIN}) is recipe


@pytest.mark.parametrize('threads', [1, 2, 8])
def test_other_programs_do_not_make_the_network_look_slow(threads, monkeypatch):
    """The wall clock shows three times what the threads of the network took."""
    recipe = MODES['balanced']
    rate = rate_for(foreseen_seconds(recipe, PACE))
    assert fitted(recipe, rate, monkeypatch, threads=threads, others=3.0) == for_two(recipe)


def test_networks_are_timed_once_each(monkeypatch):
    """MoveNet may see the image in several sizes."""
    clock = Clock()
    monkeypatch.setattr(target_rate, 'time', clock)
    network = TimedNetwork(clock, 1e-9)
    fitted_to_rate(Recipe((NetworkPass(MODELS['movenet_multipose'], (512, 512), (1.0, 0.5)),)),
                   {'movenet_multipose': network}, 10.0, 1)
    assert network.runs == 4

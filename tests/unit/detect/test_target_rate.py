"""Less is computed where the processor is too slow, and never more."""
import dataclasses

import pytest

from openpose_ros_pkg.detect import recipe_choice
from openpose_ros_pkg.detect.recipe_choice import fitted_to_rate, foreseen_seconds, recipe_of
from openpose_ros_pkg.detect.recipes import MODES, DetectorParams

THIN = 656 * 368  # pixels of the input that a 960 x 540 image gives
CLOSER = 256 * 256
# Seconds per pixel: about those of two cores of a laptop.
PACE = {'mobilenet_thin': 1.5e-7, 'movenet_multipose': 2e-7, 'movenet_thunder': 1e-7}


class Clock:
    """Time that passes only while a network computes, in one thread of two; other programs run three times as long."""

    def __init__(self):
        self.seconds = 0.0

    def perf_counter(self):
        return self.seconds * 3

    def process_time(self):
        return self.seconds * 2


class TimedNetwork:
    """Takes so many seconds per pixel of its input, and longer the first time."""

    def __init__(self, clock, pace):
        self._clock, self._pace, self.runs = clock, pace, 0

    def infer(self, images):
        self._clock.seconds += images.shape[1] * images.shape[2] * self._pace * (100 if self.runs == 0 else 1)
        self.runs += 1
        return ()


def fitted(recipe, rate, monkeypatch, pace=PACE):
    clock = Clock()
    monkeypatch.setattr(recipe_choice, 'time', clock)
    networks = {model.name: TimedNetwork(clock, pace.get(model.name, PACE['mobilenet_thin']))
                for model in recipe.models}
    return fitted_to_rate(recipe, networks, rate, 2)


def rate_for(seconds):
    """Rate at which the networks may take just so long: half of a frame's time."""
    return 0.5 / (seconds * 1.0001)


@pytest.mark.parametrize('scale, boxes', [(1.0, [(656, 368), (512, 512)]), (0.75, [(488, 272), (384, 384)]),
                                          (0.1, [(328, 184), (256, 256)])])
def test_all_inputs_shrink_alike_as_far_as_two_people_can_be_refined(scale, boxes, monkeypatch):
    recipe = MODES['balanced']
    of_people = 2 * PACE['movenet_thunder'] * CLOSER
    of_passes = foreseen_seconds(recipe, PACE) - of_people
    less = fitted(recipe, rate_for(scale ** 2 * of_passes + of_people), monkeypatch)
    assert [one.box for one in less.passes] == boxes and less.max_refined == 2


@pytest.mark.parametrize('people, refined', [(2.0, 2), (3.5, 3), (6.5, 6), (50.0, 20)])
def test_no_more_people_are_refined_than_there_is_time_for(people, refined, monkeypatch):
    """And no more than the mode has."""
    recipe = MODES['fast']
    seconds = PACE['movenet_multipose'] * 384 * 224 + PACE['movenet_thunder'] * people * CLOSER
    assert fitted(recipe, rate_for(seconds), monkeypatch) == dataclasses.replace(recipe, max_refined=refined)


@pytest.mark.parametrize('seconds, box', [
    # 10 Hz leave the network 50 ms of each 100
    (0.030, (656, 368)), (0.0499, (656, 368)),
    # 128 ms are too long: the area shrinks by 50 / 128, the sides by 0.625, to multiples of 8
    (0.128, (408, 224)),
    # never below half the sides
    (2.0, (328, 184))])
def test_the_input_shrinks_as_far_as_the_target_rate_needs(seconds, box, monkeypatch):
    recipe = recipe_of(DetectorParams(pose_model='mobilenet_thin'))
    less = fitted(recipe, 10.0, monkeypatch, pace={'mobilenet_thin': seconds / THIN})
    assert less == dataclasses.replace(recipe, passes=(dataclasses.replace(recipe.passes[0], box=box),))

"""The best networks that are installed by name, and of these the best that a processor computes at a rate."""
import logging
from dataclasses import replace

import pytest

from openpose_ros_pkg.detect import recipe_choice
from openpose_ros_pkg.detect.detector import Detector, Networks
from openpose_ros_pkg.detect.following import FollowingParams
from openpose_ros_pkg.detect.recipe_choice import (
    RATE,
    chosen_for_rate,
    recipe_of,
    recipes_of,
    time_share,
)
from openpose_ros_pkg.detect.recipes import MODES, SMALL_MODES, DetectorParams, DetectorSettings, crop_of
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.backends import BackendParams
from openpose_ros_pkg.networks.model_registry import MODELS
from openpose_ros_pkg.networks.model_types import SIMCC_INPUT, YOLO_INPUT, YOLOX_INPUT, Decoder, Model, UserFiles
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import BODY_25, COCO_18
from stand_in_networks import MovenetNetwork, PafNetwork, ThunderNetwork, Together


def network(name, decoder, recipe, size, skeleton=COCO_18):
    return Model(name, skeleton, (), 'ours', UserFiles('here'), replace(recipe, fixed_size=size), (), decoder)


LARGE = network('large', Decoder.SIMCC, SIMCC_INPUT, (192, 256))
SMALL = network('small', Decoder.SIMCC, SIMCC_INPUT, (192, 256))
FEET = network('feet', Decoder.SIMCC, SIMCC_INPUT, (192, 256), BODY_25)
BOXES = network('boxes', Decoder.BOXES, YOLOX_INPUT, (416, 416))
WHOLE = MODELS['rtmo_s']


@pytest.fixture
def installed(monkeypatch):
    """Return a function that says which networks by name are there, the best first."""
    def install(*models):
        monkeypatch.setattr(recipe_choice, 'installed_by_name', lambda folder='': models)
    install()
    return install


def chosen(**values):
    """Return searcher and network for crops of all recipes of the mode best."""
    return [(one.passes[0].model.name, one.refinements[0].model.name if one.refinements else '')
            for one in recipes_of(DetectorParams(mode='best', **values))]


def test_where_no_network_by_name_is_there_best_is_balanced_and_one_line_says_what_would_be_gained(installed, caplog):
    caplog.set_level(logging.INFO)
    assert recipes_of(DetectorParams(mode='best')) == (SMALL_MODES['balanced'], MODES['balanced'])
    networks = Together(mobilenet_thin=PafNetwork(), movenet_multipose=MovenetNetwork(),
                        movenet_thunder=ThunderNetwork())
    assert Detector(build(DetectorSettings, {'mode': 'best'}), networks).recipe == MODES['balanced']
    lines = [record.message for record in caplog.records if 'mode best' in record.message]
    assert len(lines) == 1 and './run model list' in lines[0]


def test_the_network_for_crops_counts_first_then_what_searches(installed):
    installed(LARGE, SMALL, WHOLE, BOXES)
    assert chosen() == [
        ('rtmo_s', 'large'), ('boxes', 'large'), ('mobilenet_thin', 'large'),
        ('rtmo_s', 'small'), ('boxes', 'small'), ('mobilenet_thin', 'small'), ('rtmo_s', ''),
        ('picodet', 'tinypose'), ('mobilenet_thin', 'movenet_thunder')]
    assert ('rtmo_s', 'movenet_thunder') in chosen(target_rate=30.0)
    assert recipe_of(DetectorParams(mode='best')).refinements[0] == replace(
        crop_of(LARGE), place_weight=crop_of(LARGE).place_weight / 4)


@pytest.mark.parametrize('models, first', [
    ((SMALL,), ('mobilenet_thin', 'small')), ((WHOLE,), ('rtmo_s', '')), ((SMALL, BOXES), ('boxes', 'small')),
    ((BOXES,), ('picodet', 'tinypose'))], ids=['crops', 'whole image', 'boxes', 'boxes alone'])
def test_what_is_there_is_used(installed, models, first):
    installed(*models)
    assert chosen()[0] == first


class Failing(Networks):
    """Networks of which some can not be loaded."""

    def __init__(self, *fail):
        super().__init__(BackendParams(threads=1))
        self.fail = fail

    def _network(self, model):
        if model.name in self.fail:
            raise ModelError(f'{model.name} is refused')
        return self._loaded.setdefault(model.name, MovenetNetwork())


@pytest.mark.parametrize('rate', [0.0, 0.01])
@pytest.mark.parametrize('fail, names', [
    ((), ('rtmo_s', 'large')), (('rtmo_s',), ('boxes', 'large')), (('rtmo_s', 'large'), ('boxes', 'small')),
    (('rtmo_s', 'large', 'boxes'), ('mobilenet_thin', 'small')),
    (('rtmo_s', 'large', 'boxes', 'small'), ('picodet', 'tinypose')),
    (('rtmo_s', 'large', 'boxes', 'small', 'picodet'), ('mobilenet_thin', 'movenet_thunder'))], ids=str)
def test_where_a_network_by_name_fails_the_next_best_takes_its_place(installed, monkeypatch, fail, names, rate):
    monkeypatch.setattr(recipe_choice, 'seconds_per_pixel', lambda recipe, networks, threads: (
        dict.fromkeys(networks, 1e-9)))
    installed(LARGE, SMALL, WHOLE, BOXES)
    networks = Failing(*fail)
    unit = Detector(build(DetectorSettings, {'mode': 'best', 'target_rate': rate}), networks, FollowingParams())
    assert (unit.recipe.passes[0].model.name, unit.recipe.refinements[0].model.name) == names
    assert set(networks.faults) == set(fail) and all(f'{name} is refused' in unit.faults for name in fail)


def test_a_network_for_crops_that_fails_ends_it_where_the_user_names_it(installed):
    installed(WHOLE)
    with pytest.raises(ModelError, match='movenet_thunder is refused'):
        Detector(build(DetectorSettings, {'mode': 'best', 'crop_model': 'movenet_thunder'}), Failing('movenet_thunder'))


def test_an_image_that_fills_the_input_has_one_size(installed, monkeypatch):
    stretched = network('stretched', Decoder.YOLO_POSE, replace(YOLO_INPUT, stretched=True), (640, 640))
    monkeypatch.setattr(recipe_choice, 'find_model', lambda name, folder='': stretched)
    for values in ({'num_scales': 2}, {'mode': 'accurate'}):
        first, = recipe_of(DetectorParams(pose_model='stretched', **values)).passes
        assert first.zooms == (1.0,) and first.opinions == 1


def test_a_network_for_crops_that_the_user_names_stays(installed):
    installed(LARGE, WHOLE, BOXES)
    assert {crop for _, crop in chosen(crop_model='movenet_thunder')} == {'movenet_thunder'}
    assert chosen(crop_model='movenet_thunder')[:3] == [
        (name, 'movenet_thunder') for name in ('rtmo_s', 'boxes', 'mobilenet_thin')]


@pytest.mark.parametrize('models, skeleton', [((FEET, SMALL), BODY_25), ((SMALL, FEET), COCO_18)])
def test_the_joint_set_is_that_of_the_best_whatever_the_processor_reaches(installed, models, skeleton):
    installed(*models, WHOLE)
    assert {one.skeleton for one in recipes_of(DetectorParams(mode='best', target_rate=30.0))} == {skeleton}


# --- at a rate --------------------------------------------------------------------------------------------------------

# Seconds for an input of each network.
INPUTS = {'large': 192 * 256, 'small': 192 * 256, 'rtmo_s': 640 * 640, 'boxes': 416 * 416, 'movenet_thunder': 256 * 256,
          'picodet': 320 * 320, 'tinypose': 192 * 256}
SECONDS = {'large': 0.02, 'small': 0.008, 'rtmo_s': 0.1, 'boxes': 0.02, 'movenet_thunder': 0.01, 'picodet': 0.01,
           'tinypose': 0.012}
PACE = {**{name: seconds / INPUTS[name] for name, seconds in SECONDS.items()},
        'mobilenet_thin': 3e-7, 'movenet_multipose': 3e-7}


@pytest.fixture
def measured(monkeypatch):
    """The names of the networks that were measured; each has its pace."""
    names = []
    monkeypatch.setattr(recipe_choice, 'seconds_per_pixel', lambda recipe, networks, threads: (
        names.extend(networks), {name: PACE[name] for name in networks})[1])
    yield names
    assert len(names) == len(set(names))


def candidates(rate):
    return recipes_of(DetectorParams(mode='best', target_rate=rate))[:-1]  # the last: where no other can be loaded


def chosen_at(rate, follows=False):
    """Return the choice among all recipes at a rate [Hz]."""
    return chosen_for_rate(candidates(rate),
                           lambda recipe: (recipe, dict.fromkeys(model.name for model in recipe.models)), rate, follows,
                           1)[0]


def names_of(recipe):
    return recipe.passes[0].model.name, recipe.refinements[0].model.name


@pytest.mark.parametrize('rate, names', [
    # half of a frame's time is allowed; in boxes, people are seen twice
    (3.0, ('rtmo_s', 'large')), (4.5, ('boxes', 'large')), (9.0, ('boxes', 'small'))])
def test_the_most_accurate_set_that_reaches_the_rate_is_taken(installed, measured, rate, names):
    installed(LARGE, SMALL, WHOLE, BOXES)
    recipe = chosen_at(rate)
    assert names_of(recipe) == names and time_share(recipe, PACE, rate, False) <= 1


def test_where_none_reaches_the_rate_the_fastest_is_taken(installed, measured):
    installed(LARGE, SMALL, WHOLE, BOXES)
    shares = [time_share(one, PACE, 1000.0, False) for one in candidates(1000.0)]
    assert time_share(chosen_at(1000.0), PACE, 1000.0, False) == min(shares) > 1
    assert set(measured) == set(PACE)


def test_networks_that_are_not_needed_are_not_measured(installed, measured):
    installed(LARGE, SMALL, WHOLE, BOXES)
    chosen_at(0.5)
    assert set(measured) == {'large', 'rtmo_s'}


@pytest.mark.parametrize('rate, names', [(10.0, ('boxes', 'large')), (16.0, ('boxes', 'small'))])
def test_where_people_are_followed_the_search_is_spread(installed, measured, rate, names):
    """Each frame has the crops of two people, each 0.2 s a search."""
    installed(LARGE, SMALL, WHOLE, BOXES)
    assert names_of(chosen_at(rate, follows=True)) == names
    share = time_share(recipe_of(DetectorParams(mode='best')), PACE, rate, True)
    assert share == pytest.approx((2 * 0.02 * rate + 0.1 / max(1 / rate, RATE.search_time)) / 0.5)


def test_what_stands_in_for_missing_networks_is_neither_loaded_nor_timed_where_they_are_there(installed, measured):
    everything = Together(**{name: MovenetNetwork() for name in PACE})
    unit = Detector(build(DetectorSettings, {'target_rate': 1000.0}), everything, FollowingParams())
    assert unit.recipe.passes == SMALL_MODES['fast'].passes and 'mobilenet_thin' not in measured


def test_a_detector_takes_the_set_that_its_networks_reach(installed, measured):
    installed(LARGE, SMALL, WHOLE, BOXES)
    everything = Together(**{name: MovenetNetwork() for name in PACE})
    settings = build(DetectorSettings, {'mode': 'best', 'target_rate': 16.0})
    unit = Detector(settings, everything, FollowingParams())
    assert [model.name for model in unit.recipe.models] == ['boxes', 'small']

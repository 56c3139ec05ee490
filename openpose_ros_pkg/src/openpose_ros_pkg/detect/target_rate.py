"""Compute less for a picture where the processor does not reach the wanted rate."""
import logging
import os
import time
from dataclasses import replace
from typing import Dict, Tuple

import numpy as np

from openpose_ros_pkg.detect.looks import plans_of, views_of
from openpose_ros_pkg.detect.recipes import CLOSE_MODEL, FASTER, Look, Recipe
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.models import MOBILENET_THIN

_log = logging.getLogger(__name__)

# Share of a frame's time that the networks may take on all cores; the rest is for messages (a cloud of 960 x 540 points
# takes 17 MB through the loopback), decoding, lifting and other programs.
_NETWORK_SHARE = 0.5
# A single network's input does not become smaller than this share of its sides: people would no longer be found.
_LEAST_SCALE = 0.5
# People that are looked at again in the pictures that the time is foreseen for.
_EXPECTED_PEOPLE = 2
# Shape of the pictures that the time is foreseen for [px].
_PICTURE = (960, 540)
_TIMED_RUNS = 3


def fitted_to_rate(recipe: Recipe, networks: Dict[str, Backend], target_rate: float, threads: int) -> Recipe:
    """Return the most accurate recipe, from the given one down, that this processor computes fast enough.

    Of several networks, what they see is made smaller, then the slower one is left out (`recipes.FASTER`); of one
    network, its input is made smaller.

    Args:
        recipe: what is wanted.
        networks: of the recipe, by the models' names.
        target_rate: [Hz].
        threads: that compute a network; 0 for as many as there are cores.
    """
    allowed = _NETWORK_SHARE / target_rate
    pace = {name: _seconds_per_pixel(look, networks[name], threads or os.cpu_count() or 1)
            for name, look in {look.model.name: look for look in recipe.looks}.items()}
    needed = foreseen_seconds(recipe, pace)
    if needed <= allowed:
        fitted = recipe
    elif recipe.closer or len(recipe.looks) > 1:
        less = [faster for faster in _faster(recipe) if foreseen_seconds(faster, pace) < needed]
        fitted = next((faster for faster in less if foreseen_seconds(faster, pace) <= allowed), [recipe, *less][-1])
    else:
        fitted = _smaller(recipe, max(np.sqrt(allowed / needed), _LEAST_SCALE))
    fitted = _bounded(fitted, pace, allowed)
    instead = f', so it is {fitted.description}, {1000 * foreseen_seconds(fitted, pace):.0f} ms'
    _log.info('for %g Hz the networks may take %.0f ms: %s takes %.0f ms%s', target_rate, 1000 * allowed,
              recipe.description, 1000 * needed, '' if fitted == recipe else instead)
    return fitted


def foreseen_seconds(recipe: Recipe, pace: Dict[str, float]) -> float:
    """Return what the networks will take for a picture with two people [s]; time goes with the area of the input.

    Args:
        pace: seconds per pixel of the input, by the models' names.
    """
    whole, close = _parts(recipe, pace)
    return whole + close * min(_EXPECTED_PEOPLE, recipe.most_people)


def _parts(recipe: Recipe, pace: Dict[str, float]) -> Tuple[float, float]:
    """Return what the whole looks will take, and the closer ones for each person [s]."""
    whole = sum(pace[look.model.name] * _pixels(look) for look in recipe.looks)
    close = pace[CLOSE_MODEL.name] * recipe.close_side ** 2 if recipe.closer else 0.0
    return whole, close * len(recipe.closer)


def _bounded(recipe: Recipe, pace: Dict[str, float], allowed: float) -> Recipe:
    """Return a recipe that looks closer at no more people than there is time for, but at the expected ones."""
    whole, close = _parts(recipe, pace)
    if close == 0:
        return recipe
    people = max(int((allowed - whole) / close), _EXPECTED_PEOPLE)
    return replace(recipe, most_people=min(people, recipe.most_people))


def _faster(recipe: Recipe) -> Tuple[Recipe, ...]:
    """Return what computes less than a recipe of several networks and may take its place."""
    first = recipe.looks[0].model
    return tuple(replace(faster, most_people=recipe.most_people, closer=faster.closer if recipe.closer else ())
                 for faster in FASTER
                 if first is MOBILENET_THIN or faster.looks[0].model is first)


def _smaller(recipe: Recipe, scale: float) -> Recipe:
    """Return a recipe of one network with its input made smaller by a factor on the sides."""
    look = recipe.looks[0]
    multiple = look.model.input.multiple_of
    width, height = (side if side < 0 else max(int(side * scale) // multiple, 1) * multiple for side in look.box)
    return replace(recipe, looks=(replace(look, box=(width, height)),))


def _pixels(look: Look) -> int:
    """Return the number of pixels of all inputs of a look at one picture."""
    pixels = sum(plan.net_size[0] * plan.net_size[1] for plan in plans_of(_PICTURE, look))
    return 2 * pixels if look.mirror else pixels


def _seconds_per_pixel(look: Look, network: Backend, threads: int) -> float:
    """Return what a network takes for a pixel of its input when this process has its cores to itself [s].

    Other nodes start at the same moment, so the wall clock alone would make the network look slow: the processor time
    of its threads tells what it needs, and the least of a few runs leaves out what disturbs even that.
    """
    view = views_of(np.zeros((_PICTURE[1], _PICTURE[0], 3), np.uint8), look)[0]
    view.compute(network)  # compiles the network for this size
    seconds = []
    for _ in range(_TIMED_RUNS):
        wall, processor = time.perf_counter(), time.process_time()
        view.compute(network)
        seconds += [time.perf_counter() - wall, (time.process_time() - processor) / threads]
    return min(seconds) / (view.image.shape[0] * view.image.shape[1])

"""Compute less for an image where the processor does not reach the wanted rate."""
import logging
import os
import time
from dataclasses import dataclass, replace
from typing import Dict, Optional, Tuple

import numpy as np

from openpose_ros_pkg.detect.recipes import FASTER, NetworkPass, Recipe
from openpose_ros_pkg.detect.views import full_image_plans, prepare_views
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.params.constants import constant

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class TargetRateConstants:
    """How the time of the networks is foreseen, and how much of it they may take."""

    full_search_share: float = constant(
        0.5, "Share of a frame's time that the networks may take on all cores; the rest is for messages (a cloud of "
             '960 x 540 points takes 17 MB through the loopback), decoding, lifting and other programs.')
    least_scale: float = constant(
        0.5, 'Least scale of the input of a single network: with smaller ones people are not found.')
    expected_people: int = constant(2, 'Number of people in an image whose crop refinement is foreseen.')
    image_size: Tuple[int, int] = constant(
        (960, 540), 'Width and height of a foreseen image, for whose ratio the networks are compiled before the first '
                    'one; for another ratio that takes 0.3 to 1.6 s then.', unit='px')
    timed_runs: int = constant(3, 'Runs of a network that are timed; the quickest counts.')


RATE = TargetRateConstants()


def fitted_to_rate(recipe: Recipe, networks: Dict[str, Backend], target_rate: float, threads: int,
                   constants: TargetRateConstants = RATE) -> Recipe:
    """Return the most accurate recipe, from the given one down, that this processor computes fast enough.

    Several networks get smaller inputs, then the slower one is left out (`recipes.FASTER`). A single network gets a
    smaller input.

    Args:
        networks: of the recipe, by the models' names.
        target_rate: [Hz].
        threads: that compute a network; 0 for as many as there are cores.
    """
    allowed = constants.full_search_share / target_rate
    pace = seconds_per_pixel(recipe, networks, threads, constants=constants)
    needed = foreseen_seconds(recipe, pace, constants)
    less = [faster for faster in _faster(recipe) if foreseen_seconds(faster, pace, constants) < needed]
    if needed <= allowed:
        fitted = recipe
    elif less or len(recipe.passes) > 1:
        fitted = next((faster for faster in less if foreseen_seconds(faster, pace, constants) <= allowed),
                      [recipe, *less][-1])
    else:
        fitted = _smaller(recipe, max(np.sqrt(allowed / needed), constants.least_scale))
    fitted = _bounded(fitted, pace, allowed, constants)
    instead = f', so it is {fitted.description}, {1000 * foreseen_seconds(fitted, pace, constants):.0f} ms'
    _log.info('for %g Hz the networks may take %.0f ms: %s takes %.0f ms%s', target_rate, 1000 * allowed,
              recipe.description, 1000 * needed, '' if fitted == recipe else instead)
    return fitted


def seconds_per_pixel(recipe: Recipe, networks: Dict[str, Backend], threads: int,
                      columns: Optional[Tuple[int, int]] = None, constants: TargetRateConstants = RATE
                      ) -> Dict[str, float]:
    """Measure what the networks of a recipe take for a pixel of their inputs [s], by the models' names.

    Args:
        threads: that compute a network; 0 for as many as there are cores.
        columns: left and right end of the part of the image that the passes see [px]; None: all of it.
    """
    return {name: _seconds_per_pixel(image, networks[name], threads or os.cpu_count() or 1, constants.timed_runs)
            for name, image in _inputs(recipe, constants.image_size, columns).items()}


def foreseen_seconds(recipe: Recipe, pace: Dict[str, float], constants: TargetRateConstants = RATE) -> float:
    """Return what the networks will take for an image with the expected people [s]; pace: [s] per pixel."""
    of_passes, of_person = _parts(recipe, pace, constants.image_size)
    return of_passes + of_person * min(constants.expected_people, recipe.max_refined)


def _parts(recipe: Recipe, pace: Dict[str, float], size: Tuple[int, int]) -> Tuple[float, float]:
    """Return seconds of the passes over the full image, and of the refinement of each person."""
    of_passes = sum(pace[one.model.name] * _pixels(one, size) for one in recipe.passes)
    return of_passes, sum(pace[one.model.name] * one.side ** 2 for one in recipe.refinements)


def _bounded(recipe: Recipe, pace: Dict[str, float], allowed: float, constants: TargetRateConstants) -> Recipe:
    """Return a recipe that refines no more people than there is time for, but at least the expected number."""
    of_passes, of_person = _parts(recipe, pace, constants.image_size)
    if of_person == 0:
        return recipe
    people = max(int((allowed - of_passes) / of_person), constants.expected_people)
    return replace(recipe, max_refined=min(people, recipe.max_refined))


def _faster(recipe: Recipe) -> Tuple[Recipe, ...]:
    """Return what computes less than a recipe of several networks with some of them and may take its place."""
    if len(recipe.models) == 1:
        return ()
    less = [replace(faster, max_refined=recipe.max_refined, refinements=recipe.refinements) for faster in FASTER]
    return tuple(faster for faster in less if set(faster.models) <= set(recipe.models))


def _smaller(recipe: Recipe, scale: float) -> Recipe:
    """Return a recipe of one network with its input made smaller by a factor on the sides."""
    first, = recipe.passes
    multiple = first.model.input.multiple_of
    width, height = (side if side < 0 else max(int(side * scale) // multiple, 1) * multiple for side in first.box)
    return replace(recipe, passes=(replace(first, box=(width, height)),))


def _pixels(network_pass: NetworkPass, size: Tuple[int, int]) -> int:
    pixels = sum(plan.net_size[0] * plan.net_size[1] for plan in full_image_plans(size, network_pass))
    return 2 * pixels if network_pass.mirror else pixels


def _inputs(recipe: Recipe, size: Tuple[int, int], columns: Optional[Tuple[int, int]]) -> Dict[str, np.ndarray]:
    """Return an input of each network, (1, H, W, 3) uint8, by the models' names."""
    width, height = size
    crops = {one.model.name: np.zeros((1, one.side, one.side, 3), np.uint8) for one in recipe.refinements}
    image = np.zeros((height, width, 3), np.uint8)
    return {**crops, **{one.model.name: prepare_views(
        image, one, None if one.model.input.fixed_size else columns)[0].input[np.newaxis] for one in recipe.passes}}


def _seconds_per_pixel(image: np.ndarray, network: Backend, threads: int, runs: int) -> float:
    """Return what a network takes for a pixel of its input when this process has its cores to itself [s].

    By the wall clock a network would seem slow while other nodes start: processor time counts, and the quickest run.
    """
    network.infer(image)  # compiles the network for this size
    seconds = []
    for _ in range(runs):
        wall, processor = time.perf_counter(), time.process_time()
        network.infer(image)
        seconds += [time.perf_counter() - wall, (time.process_time() - processor) / threads]
    return min(seconds) / (image.shape[1] * image.shape[2])

"""Which recipe is computed: what the parameters ask for, and as much of it as the processor reaches at a rate."""
import logging
import os
import time
from dataclasses import dataclass, replace
from typing import Callable, Dict, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.detect.recipes import (
    BEST,
    MODES,
    SMALL_MODES,
    THUNDER_CROP,
    WHOLE_IMAGE,
    CropRefinement,
    DetectorParams,
    NetworkPass,
    Recipe,
    crop_of,
    mode_of,
    wanted_zooms,
)
from openpose_ros_pkg.detect.views import prepare_views, views_of
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.model_registry import AUTO, MOVENET_THUNDER
from openpose_ros_pkg.networks.model_types import BOX_DECODERS, CROP_DECODERS, Decoder, Model
from openpose_ros_pkg.networks.models import find_model, installed_by_name
from openpose_ros_pkg.params.constants import constant

_log = logging.getLogger(__name__)

# Longer side of the input of YOLO-pose and YOLOX by mode [px], where their files leave it free.
_SIDES = {'fast': 480, 'balanced': 640, 'accurate': 960, BEST: 640}
# With crop refinement, a single network counts twice for the scores of joints, and as much as Thunder for places.
_SEARCH_WEIGHT, _SEARCH_ACCEPTANCE = 2.0, 0.8


@dataclass(frozen=True)
class TargetRateConstants:
    """How the time of the networks is foreseen, and how much of it they may take."""

    networks_share: float = constant(
        0.5, "Share of a frame's time that the networks may take on all cores; the rest is for messages (a cloud of "
             '960 x 540 points takes 17 MB through the loopback), decoding, lifting and other programs.')
    least_scale: float = constant(
        0.5, 'Least scale of the inputs of networks that see the whole image: with smaller ones people are not found.')
    expected_people: int = constant(2, 'Number of people in an image whose crop refinement is foreseen.')
    image_size: Tuple[int, int] = constant(
        (960, 540), 'Width and height of a foreseen image, for whose ratio the networks are compiled before the first '
                    'one; for another ratio that takes 0.3 to 1.6 s then.', unit='px')
    search_time: float = constant(
        0.2, 'Where people are followed, each image is searched once in this time, or in that of a frame.', unit='s')
    timed_runs: int = constant(3, 'Runs of a network that are timed; the quickest counts.')


RATE = TargetRateConstants()


def recipe_of(params: DetectorParams) -> Recipe:
    """Return the recipe that the parameters ask for.

    Raises:
        ParameterError: no such network.
        ModelError: its description is wrong.
    """
    return recipes_of(params)[0]


def recipes_of(params: DetectorParams) -> Tuple[Recipe, ...]:
    """Return the recipe that the parameters ask for, and those that may take its place where it is too slow.

    The last is for where no other can be loaded. All have one joint set: what is published does not depend on the
    processor.
    """
    first, *others = [_adjusted(recipe, params) for recipe in _networks_of(params)]
    return (first, *(other if other.skeleton == first.skeleton else replace(other, joint_set=first.skeleton)
                     for other in others))


def _adjusted(recipe: Recipe, params: DetectorParams) -> Recipe:
    """Return a recipe with the sizes and the number of people that the parameters ask for."""
    first = recipe.passes[0]
    mirror = first.mirror
    if params.mirror != 'auto':
        mirror = params.mirror == 'always' and (first.model.decoder == Decoder.PAF or first.crop is not None)
    zooms = wanted_zooms(params, first.zooms)
    if first.model.input.stretched and first.model.input.fixed_size:
        zooms = (1.0,)  # the image fills the input
    width, height = params.net_input_width, params.net_input_height
    box = width or (-1 if height > 0 else first.box[0]), height or (-1 if width > 0 else first.box[1])
    first = replace(first, box=box, zooms=zooms, mirror=mirror)
    recipe = replace(recipe, passes=(first, *recipe.passes[1:]))
    if params.look_closer == 0:
        return replace(recipe, refinements=())
    return recipe if params.look_closer < 0 else replace(recipe, max_refined=params.look_closer)


def _networks_of(params: DetectorParams) -> Sequence[Recipe]:
    """Return the recipes of the networks that the parameters name, the most accurate first."""
    crop = crop_of(_model(params, 'crop_model')) if params.crop_model else None
    model = None if params.pose_model in (AUTO, 'COCO') else _model(params, 'pose_model')
    unused = 'pose_model' if model and model.decoder in CROP_DECODERS else 'crop_model' if crop else ''
    if params.look_closer == 0 and unused and not (model and model.decoder in BOX_DECODERS):
        raise ParameterError(f"parameters '{unused}', 'look_closer' = {getattr(params, unused)!r}, 0 are not allowed: "
                             'a network for crops would see none; set look_closer to -1, or to a number of people',
                             'look_closer')
    if model is None:
        return _of_mode(params, crop)
    if model.decoder not in CROP_DECODERS:
        return [_searched_by(model, crop, params)]
    if crop is not None and crop.model != model:
        raise ParameterError(f"parameters 'pose_model', 'crop_model' = {params.pose_model!r}, {params.crop_model!r} "
                             'are not allowed: both are networks for crops; leave crop_model empty, or set pose_model '
                             f'to {AUTO} or to a network that sees the whole image', 'crop_model')
    return _of_mode(params, crop_of(model))


def _of_mode(params: DetectorParams, crop: Optional[CropRefinement]) -> Sequence[Recipe]:
    """Return the recipes of a mode, the most accurate first.

    Args:
        crop: that the user wants in place of the mode's; None: the mode's.
    """
    if params.mode == BEST:
        return _best(params, crop)
    if crop is not None:
        return [_refined_by(crop, MODES[params.mode])]
    if params.net_input_width or params.net_input_height or params.num_scales or params.scale_gap:  # not PicoDet's
        return [MODES[params.mode]]
    fast = [SMALL_MODES['fast']] if params.mode == 'balanced' and params.target_rate > 0 else []
    return [SMALL_MODES[params.mode], *fast, MODES[params.mode]]


def _best(params: DetectorParams, named: Optional[CropRefinement]) -> Sequence[Recipe]:
    """Return the recipes of the networks that are installed by name, the most accurate first.

    The published AP of networks for crops falls by 0.02 behind the smallest network of boxes (mmpose, projects/rtmpose,
    RTMPose-m: 0.753 and 0.732), and that of RTMPose-m and RTMPose-s differ by more: the network for crops counts first,
    then what searches the image, those by name before the balanced mode's. Last comes that mode. The networks have the
    order of `BY_NAME`, whose AP are of several sets of images.

    Args:
        named: the crop that the user wants; None: the best ones.
    """
    installed = installed_by_name(params.model_folder)
    searchers = [one for one in installed if one.decoder not in CROP_DECODERS]
    crops = [crop_of(one) for one in installed if one.decoder in CROP_DECODERS] if named is None else [named]
    recipes = [recipe for crop in crops for recipe in (
        *(_searched_by(one, crop, params) for one in searchers), _refined_by(crop, MODES['balanced']))]
    if named is None:  # Thunder brings nothing to boxes and to people of better networks; there it only follows
        recipes += [replace(_searched_by(one, THUNDER_CROP if params.target_rate > 0 else None, params), named=())
                    for one in searchers if one.decoder not in BOX_DECODERS]
        recipes += _of_mode(replace(params, mode='balanced'), None)
    return recipes


def _model(params: DetectorParams, name: str) -> Model:
    """Return the network that a parameter names."""
    try:
        return find_model(getattr(params, name), params.model_folder)
    except ParameterError as error:  # it speaks of pose_model
        raise ParameterError(str(error).replace('pose_model', name, 1), name) from error


def _refined_by(crop: CropRefinement, recipe: Recipe) -> Recipe:
    """Return a recipe of a mode with another network in place of MoveNet Thunder."""
    crops = tuple(replace(crop, mirror=one.mirror, margin=crop.margin * one.margin / THUNDER_CROP.margin)
                  if one.model == MOVENET_THUNDER else one for one in recipe.refinements)
    return replace(recipe, refinements=crops, named=(crop.model,))


def _searched_by(model: Model, crop: Optional[CropRefinement], params: DetectorParams) -> Recipe:
    """Return the recipe of one network in place of a mode's; with `look_closer`, its people are refined on crops.

    It sees the image at the size of OpenPose's input, a larger one, or a smaller one; others at those of `_SIDES`.

    Args:
        crop: that the user wants; None: MoveNet Thunder, where crops are wanted or needed.
    """
    first = next((one for one in mode_of(params.mode).passes if one.model.decoder == Decoder.PAF),
                 replace(WHOLE_IMAGE, box=(328, 184)))
    first = replace(first, model=model, mirror=first.mirror and model.decoder == Decoder.PAF)
    if model.decoder in (Decoder.YOLO_POSE, *BOX_DECODERS):
        first = NetworkPass(model, (_SIDES[params.mode], _SIDES[params.mode]))
    named = () if crop is None else (crop.model,)
    if model.decoder in BOX_DECODERS:
        crop = crop or THUNDER_CROP
        if not crop.one_person:
            raise ParameterError(f"parameters 'pose_model', 'crop_model' = {params.pose_model!r}, "
                                 f'{params.crop_model!r} are not allowed: behind a network of boxes, a network for '
                                 f'crops of one person is needed: {Decoder.SIMCC} (RTMPose) or '
                                 f'{Decoder.MOVENET_SINGLEPOSE}', 'crop_model')
        return Recipe((replace(first, crop=crop),), (crop,), named=named)
    if crop is None and params.look_closer <= 0:
        return Recipe((first,))
    crop = crop or THUNDER_CROP
    # Thunder and a network that is trained for whole images are about as accurate; in units of Thunder's weight
    place_weight = _SEARCH_WEIGHT * crop.place_weight / THUNDER_CROP.place_weight
    return Recipe((replace(first, weight=_SEARCH_WEIGHT),), (replace(crop, place_weight=place_weight),),
                  acceptance=_SEARCH_ACCEPTANCE, named=named)


def chosen_for_rate(recipes: Sequence[Recipe], load: Callable[[Recipe], Optional[Tuple[Recipe, Dict[str, Backend]]]],
                    rate: float, follows: bool, threads: int) -> Optional[Tuple[Recipe, Dict[str, Backend]]]:
    """Return the first recipe that is computed fast enough, else the fastest, and its networks.

    Args:
        recipes: the most accurate first.
        load: the networks of a recipe, which may become another one, see `Networks.load_any`.
        rate: [Hz].
        follows: whether a frame is published before the search.
        threads: that compute a network; 0 for as many as there are cores.

    Returns:
        None where no recipe can be loaded.
    """
    pace: Dict[str, float] = {}
    tried = []
    for wanted in recipes:
        loaded = load(wanted)
        if loaded is None:
            continue
        recipe, networks = loaded
        unknown = {name: network for name, network in networks.items() if name not in pace}
        if unknown:
            pace.update(seconds_per_pixel(recipe, unknown, threads))
        tried.append((max(time_share(recipe, pace, rate, follows), 1.0), recipe, networks))
        if tried[-1][0] <= 1:
            break
    if not tried:
        return None
    share, recipe, networks = min(tried, key=lambda one: one[0])
    _log.info('of %d sets of networks %s is the most accurate that reaches the rate%s', len(recipes),
              recipe.description, '' if share <= 1 else
              f', or the fastest: it takes {share:.1f} times the time that it may take')
    return recipe, networks


def time_share(recipe: Recipe, pace: Dict[str, float], rate: float, follows: bool,
               constants: TargetRateConstants = RATE) -> float:
    """Return the share of the allowed time that a recipe takes with the expected people at a rate [Hz].

    Where people are followed, each image has their crops, and is searched as often as beside other cameras; else each
    is searched in full.
    """
    of_passes, of_person = _parts(recipe, pace, constants.image_size)
    people, searches = min(constants.expected_people, recipe.max_refined), rate
    if follows:
        of_person, searches = _of_person(recipe.refinements, pace), 1 / max(1 / rate, constants.search_time)
    return (people * of_person * rate + of_passes * searches) / constants.networks_share


def fitted_to_rate(recipe: Recipe, networks: Dict[str, Backend], target_rate: float, threads: int,
                   constants: TargetRateConstants = RATE) -> Recipe:
    """Return a recipe with smaller inputs and fewer refined people, as far as this processor needs to be fast enough.

    Args:
        networks: of the recipe, by the models' names.
        target_rate: [Hz].
        threads: that compute a network; 0 for as many as there are cores.
    """
    allowed = constants.networks_share / target_rate
    pace = seconds_per_pixel(recipe, networks, threads, constants=constants)
    needed = foreseen_seconds(recipe, pace, constants)
    of_passes, of_person = _parts(recipe, pace, constants.image_size)
    for_passes, fitted = max(allowed - needed + of_passes, 0.0), recipe
    if for_passes < of_passes:
        fitted = _smaller(recipe, max(np.sqrt(for_passes / of_passes), constants.least_scale))
        of_passes, _ = _parts(fitted, pace, constants.image_size)
    if of_person > 0:  # as many people as there is time for
        people = max(int((allowed - of_passes) / of_person), constants.expected_people)
        fitted = replace(fitted, max_refined=min(people, fitted.max_refined))
    instead = f', so it is {fitted.description}, {1000 * foreseen_seconds(fitted, pace, constants):.0f} ms'
    _log.info('for %g Hz the networks may take %.0f ms: %s takes %.0f ms%s', target_rate, 1000 * allowed,
              recipe.description, 1000 * needed, '' if fitted == recipe else instead)
    return fitted


def seconds_per_pixel(recipe: Recipe, networks: Dict[str, Backend], threads: int,
                      columns: Optional[Tuple[int, int]] = None, constants: TargetRateConstants = RATE
                      ) -> Dict[str, float]:
    """Measure what the networks of a recipe take for a pixel of their inputs [s], by the models' names.

    Args:
        networks: that are measured.
        threads: that compute a network; 0 for as many as there are cores.
        columns: left and right end of the part of the image that the passes see [px]; None: all of it.
    """
    return {name: _seconds_per_pixel(image, networks[name], threads or os.cpu_count() or 1, constants.timed_runs)
            for name, image in _inputs(recipe, constants.image_size, columns).items() if name in networks}


def foreseen_seconds(recipe: Recipe, pace: Dict[str, float], constants: TargetRateConstants = RATE) -> float:
    """Return what the networks will take for an image with the expected people [s]; pace: [s] per pixel."""
    of_passes, of_person = _parts(recipe, pace, constants.image_size)
    return of_passes + of_person * min(constants.expected_people, recipe.max_refined)


def _parts(recipe: Recipe, pace: Dict[str, float], size: Tuple[int, int]) -> Tuple[float, float]:
    """Return seconds of the passes over the full image, and of the refinement of each person."""
    of_passes = sum(pace[one.model.name] * _pixels(one, size) for one in recipe.passes)
    return of_passes, _of_person(recipe.crops, pace)


def _of_person(crops: Sequence[CropRefinement], pace: Dict[str, float]) -> float:
    """Return seconds of the crops of a person."""
    return sum(pace[one.model.name] * one.size[0] * one.size[1] for one in crops)


def _smaller(recipe: Recipe, scale: float) -> Recipe:
    """Return a recipe whose networks see the image smaller, by a factor on the sides, where their inputs are free."""
    return replace(recipe, passes=tuple(
        one if one.model.input.fixed_size else replace(one, box=_scaled(one.box, scale, one.model.input.multiple_of))
        for one in recipe.passes))


def _scaled(box: Tuple[int, int], scale: float, multiple: int) -> Tuple[int, int]:
    """Return a box made smaller to multiples of a number of pixels; free sides, -1, stay so."""
    width, height = (side if side < 0 else max(int(side * scale) // multiple, 1) * multiple for side in box)
    return width, height


def _pixels(network_pass: NetworkPass, size: Tuple[int, int]) -> int:
    return sum(view.net_size[0] * view.net_size[1] for view in views_of(size, network_pass))


def _inputs(recipe: Recipe, size: Tuple[int, int], columns: Optional[Tuple[int, int]]) -> Dict[str, np.ndarray]:
    """Return an input of each network, (1, H, W, 3) uint8, by the models' names."""
    width, height = size
    crops = {one.model.name: np.zeros((1, *one.size[::-1], 3), np.uint8) for one in recipe.crops}
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

"""What the detector computes for an image: which networks, at which sizes, and how people are refined on crops."""
import functools
from dataclasses import dataclass, replace
from typing import Collection, Dict, Tuple, cast

import numpy as np

from openpose_ros_pkg.decode.direct import DirectDecodeParams
from openpose_ros_pkg.decode.paf import DecodeParams
from openpose_ros_pkg.ensemble import Sources, sigmas
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.networks.backends import BackendParams, LiveBackendParams
from openpose_ros_pkg.networks.model_registry import AUTO, MOBILENET_THIN, MOVENET_MULTIPOSE, MOVENET_THUNDER
from openpose_ros_pkg.networks.model_types import Decoder, Model
from openpose_ros_pkg.networks.models import find_model
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import keypoints_in
from openpose_ros_pkg.skeletons import SkeletonModel


def _target_rate(default: float) -> float:
    doc = ('Compute less per image, as far as this processor needs to reach this rate: people are followed, and the '
           'search for others is spread over several images (following); networks that can not follow, such as one '
           'network alone, get smaller inputs. 0: never, so that results do not depend on the machine. Not with the '
           'mode accurate. The default is 30 in nodes, and 0 in programs for files and recordings.')
    return cast(float, parameter(default, doc, unit='Hz', minimum=0.0, maximum=1000.0))


@dataclass(frozen=True)
class DetectorParams(Parameters):
    """Which networks see an image, at which sizes, and how often. Names of sizes and scales are OpenPose's.

    Raises:
        ParameterError: the scales reach zero, or the box has no side.
    """

    mode: str = parameter(
        'balanced', 'How much is computed for an image: fast, for weak machines, finds six people at most; balanced; '
                    'accurate, for image files and recordings, takes about ten times as long as balanced.',
        choices=('fast', 'balanced', 'accurate'))
    pose_model: str = parameter(
        AUTO, 'Network: auto, the networks that the mode puts together (COCO, the joint set that OpenPose calls so, '
              'means the same); or one network alone: mobilenet_thin, movenet_multipose, body_25, ... (`./run model '
              'list`), or one of your own: a file (.onnx, .xml) of YOLO-pose or RTMO, or a .yaml file that describes '
              'it. With look_closer, MoveNet Thunder refines its people on crops.')
    model_folder: str = parameter(
        '', 'Folder with the weights (<folder>/<network>/<file> or <folder>/<file>); empty: where setup puts them.')
    net_input_width: int = parameter(
        0, 'Width of the box that the image is fitted into for the first network, aspect kept; -1: as the height makes '
           "it; 0: the mode's, or -1 where the height is given. Time goes with width times height. Smaller is faster, "
           'larger finds smaller people.', unit='px', minimum=-1, maximum=4096)
    net_input_height: int = parameter(
        0, "Height of that box; -1: as the width makes it; 0: the mode's, or -1 where the width is given.", unit='px',
        minimum=-1, maximum=4096)
    num_scales: int = parameter(
        0, 'Number of sizes at which the first network sees the image, averaged; each costs time, more of them find '
           "more people of very different size. 0: the mode's.", minimum=0, maximum=8)
    scale_gap: float = parameter(
        0.0, "Each size is smaller than the one before by this share of the first. 0: the mode's, or 0.3 where "
             'num_scales is given.', minimum=0.0, maximum=0.99)
    mirror: str = parameter(
        'auto', 'Average also over the mirror image, which doubles the time and makes joints more accurate; auto: as '
                'the mode has it.', choices=('auto', 'always', 'never'))
    look_closer: int = parameter(
        -1, 'Crop refinement: maximum number of people that a network sees a second time, each on a crop of the '
            "image, the surest first; -1: the mode's number, 0 with one network alone.", minimum=-1, maximum=100)
    target_rate: float = _target_rate(0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.net_input_width < 0 and self.net_input_height < 0:
            raise ParameterError("parameters 'net_input_width', 'net_input_height' = -1, -1 are not allowed: -1 for "
                                 'one of them')
        zooms = _wanted_zooms(self, MODES[self.mode].passes[0].zooms)
        if zooms[-1] <= 0:
            raise ParameterError(f"parameters 'num_scales', 'scale_gap' = {self.num_scales}, {self.scale_gap} are not "
                                 f'allowed: the last of {len(zooms)} scales would be {zooms[-1]:g}, expected above 0')


@dataclass(frozen=True)
class EnsembleParams(Parameters):
    """Thresholds where several opinions become one."""

    joint_min_score: float = parameter(
        0.15, 'Score that a joint needs where several opinions were put together (mode accurate: 0.8 of it). '
             'Raise it (0.5) where only joints count that are surely right.', minimum=0.0, maximum=1.0)


@dataclass(frozen=True)
class DetectorSettings:
    """All parameters of the detector."""

    detector: DetectorParams
    backend: BackendParams
    decode: DecodeParams
    direct: DirectDecodeParams
    ensemble: EnsembleParams


@dataclass(frozen=True)
class LiveDetectorParams(DetectorParams):
    """Which networks see an image, at which sizes, and how often. Names of sizes and scales are OpenPose's."""

    target_rate: float = _target_rate(30.0)


@dataclass(frozen=True)
class LiveDetectorSettings(DetectorSettings):
    """All parameters of the detector, with the defaults of nodes."""

    detector: LiveDetectorParams
    backend: LiveBackendParams


@dataclass(frozen=True)
class NetworkPass:
    """One network on the full image, at one or more sizes."""

    model: Model  # the network
    box: Tuple[int, int]  # (width, height) that the image is fitted into [px]; one of them -1: as the other makes it
    # factors on the box: part affinity fields are averaged over them, any other network gives an opinion for each
    zooms: Tuple[float, ...] = (1.0,)
    mirror: bool = False  # also average over the mirror image; only of networks with part affinity fields
    weight: float = 1.0  # of this opinion where several are put together

    @property
    def opinions(self) -> int:
        """Number of opinions on a person that it gives."""
        return 1 if self.model.decoder == Decoder.PAF else len(self.zooms)

    @property
    def description(self) -> str:
        """What is computed, for the log."""
        scales = f' at {len(self.zooms)} scales' if len(self.zooms) > 1 else ''
        return f"{self.model.name} {self.box[0]}x{self.box[1]}{scales}{' mirrored too' if self.mirror else ''}"


@dataclass(frozen=True)
class CropRefinement:
    """A network that sees each person a second time, on a square crop of the image."""

    model: Model  # the network
    margin: float  # side of the crop, in units of the longer side of the bounding box of the person's joints
    mirror: bool = False  # the network sees the mirror image of the crop
    side: int = 256  # of the network's input [px]
    # the person is in the middle also at the border of the image, which is repeated beyond; else the crop ends there
    centred: bool = False
    place_weight: float = 1.0  # of this opinion on the places of joints; on their scores it has a weight of 1


# OpenPose's default, flags.hpp.
_SCALE_GAP = 0.3
# MoveNet Thunder was trained for crops; where it is not there, MoveNet MultiPose refines fewer people, less accurately.
THUNDER_CROP = CropRefinement(MOVENET_THUNDER, 1.3, centred=True, place_weight=8.0)
MULTIPOSE_CROP = CropRefinement(MOVENET_MULTIPOSE, 1.6)


@dataclass(frozen=True)
class Recipe:
    """All that is computed for an image."""

    passes: Tuple[NetworkPass, ...]  # the networks that see the full image
    refinements: Tuple[CropRefinement, ...] = ()  # how each person is refined on crops
    max_refined: int = 20  # greatest number of people who are refined, the surest first; bounds the time
    # factor on the scores that joints and people need: of more opinions, more miss a person who is there
    acceptance: float = 1.0
    spare: Tuple[CropRefinement, ...] = (MULTIPOSE_CROP,)  # where the network of one of the refinements is missing
    spare_refined: int = 6  # greatest number of people who are refined then

    @property
    def models(self) -> Tuple[Model, ...]:
        """The networks that it takes, each once."""
        models = [network_pass.model for network_pass in self.passes] + [one.model for one in self.refinements]
        return tuple({model.name: model for model in models}.values())

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people, that of the first network."""
        return self.passes[0].model.skeleton

    @functools.cached_property
    def weights(self) -> Tuple[float, ...]:
        """Weights of the opinions on a person: those of the passes in their order, then one of each refinement."""
        of_passes = tuple(network_pass.weight for network_pass in self.passes for _ in range(network_pass.opinions))
        return of_passes + (1.0,) * len(self.refinements)

    @property
    def place_weights(self) -> Tuple[float, ...]:
        """Weights of the same opinions on the places of joints."""
        return self.weights[:self.pass_opinions] + tuple(one.place_weight for one in self.refinements)

    @functools.cached_property
    def pass_opinions(self) -> int:
        """Number of opinions that the passes over the full image give."""
        return sum(network_pass.opinions for network_pass in self.passes)

    @functools.cached_property
    def sources(self) -> Sources:
        """The sources of the opinions. A crop tells of the joints that its skeleton has, or makes, of the recipe's."""
        joint_sigmas = sigmas(self.skeleton)
        in_passes = [np.ones(len(joint_sigmas), bool)] * self.pass_opinions
        of_crops = [one.model.skeleton for one in self.refinements]
        in_crops = [keypoints_in(np.zeros((1, len(one.joints), 3)), one, self.skeleton)[0, :, 0] for one in of_crops]
        return Sources(joint_sigmas, np.array(self.weights), np.array(self.place_weights),
                       np.array(in_passes + [np.isfinite(one) for one in in_crops]))

    @property
    def is_ensemble(self) -> bool:
        """Whether there are several opinions on a person."""
        return len(self.weights) > 1

    @property
    def description(self) -> str:
        """What is computed, for the log."""
        parts = [network_pass.description for network_pass in self.passes]
        for model in dict.fromkeys(one.model.name for one in self.refinements):
            sides = [one.side for one in self.refinements if one.model.name == model]
            parts.append(f'{len(sides)} crop refinement{"s" * (len(sides) > 1)} by {model} at {sides[0]} px for up to '
                         f'{self.max_refined} people')
        return ' + '.join(parts)

    def without(self, missing: Collection[Model]) -> 'Recipe':
        """Return what is left of it without networks that are not the first."""
        passes = tuple(one for one in self.passes if one.model not in missing)
        refinements = tuple(one for one in self.refinements if one.model not in missing)
        spare = tuple(one for one in self.spare if one.model not in missing)
        if len(refinements) < len(self.refinements) and spare:
            return replace(self, passes=passes, refinements=spare,
                           max_refined=min(self.max_refined, self.spare_refined))
        return replace(self, passes=passes, refinements=refinements)


def _thin(scale: float, weight: float = 1.5) -> NetworkPass:
    return NetworkPass(MOBILENET_THIN, _box(656 * scale, 368 * scale), weight=weight)


def _movenet(*sides: int) -> NetworkPass:
    return NetworkPass(MOVENET_MULTIPOSE, (sides[0], sides[0]), tuple(side / sides[0] for side in sides))


def _box(width: float, height: float) -> Tuple[int, int]:
    """Return a box whose sides are multiples of 8, the stride of the networks with part affinity fields."""
    return int(width) // 8 * 8, int(height) // 8 * 8


# MoveNet finds large people well, six at most; mobilenet_thin finds small people and crowds. Each finds people that the
# other misses, and where both see a joint its place is surer. Crop refinement improves accuracy most for its time; the
# mirror image and other sizes come next. Accuracy and time of each: docs/results.md.
MODES: Dict[str, Recipe] = {
    'fast': Recipe((_movenet(384),), (THUNDER_CROP,)),
    'balanced': Recipe((_thin(1.0), _movenet(512)), (THUNDER_CROP,)),
    'accurate': Recipe(
        (NetworkPass(MOBILENET_THIN, _box(984, 552), (1.0, 2 / 3, 1 / 3), mirror=True, weight=3.0), _movenet(512, 256)),
        (MULTIPOSE_CROP, replace(MULTIPOSE_CROP, mirror=True), THUNDER_CROP,
         replace(THUNDER_CROP, margin=1.6, mirror=True)), acceptance=0.8,
        spare=tuple(replace(MULTIPOSE_CROP, margin=margin, mirror=mirror) for margin in (1.6, 2.0)
                    for mirror in (False, True)), spare_refined=20),
}

# Longer side of YOLO-pose's input by mode [px].
_SIDES = {'fast': 480, 'balanced': 640, 'accurate': 960}
# With crop refinement, a single network counts twice for the scores of joints, and as much as the crop for places.
_SEARCH_WEIGHT, _SEARCH_ACCEPTANCE = 2.0, 0.8

# From the mode balanced down: less accurate and faster recipes, for processors that do not reach the wanted rate.
FASTER: Tuple[Recipe, ...] = (
    MODES['balanced'],
    Recipe((_thin(1.0), _movenet(384)), (THUNDER_CROP,)),
    Recipe((_thin(0.75), _movenet(384)), (THUNDER_CROP,)),
    Recipe((_thin(0.5, weight=1.0), _movenet(384)), (THUNDER_CROP,)),
    MODES['fast'],
    Recipe((_movenet(320),), (THUNDER_CROP,)),
    Recipe((_movenet(256),), (THUNDER_CROP,)),
)


def recipe_of(params: DetectorParams) -> Recipe:
    """Return the recipe that the parameters ask for.

    Raises:
        ParameterError: no such network.
        ModelError: its description is wrong.
    """
    recipe = MODES[params.mode]
    if params.pose_model not in (AUTO, 'COCO'):
        recipe = _searched_by(find_model(params.pose_model, params.model_folder), params)
    first = recipe.passes[0]
    mirror = first.mirror
    if params.mirror != 'auto':
        mirror = params.mirror == 'always' and first.model.decoder == Decoder.PAF
    first = replace(first, box=_wanted_box(params, first.box), zooms=_wanted_zooms(params, first.zooms), mirror=mirror)
    recipe = replace(recipe, passes=(first, *recipe.passes[1:]))
    if params.look_closer == 0:
        return replace(recipe, refinements=())
    return recipe if params.look_closer < 0 else replace(recipe, max_refined=params.look_closer)


def _searched_by(model: Model, params: DetectorParams) -> Recipe:
    """Return the recipe of one network in place of a mode's; with `look_closer`, MoveNet Thunder refines its people.

    It sees the image at the size of OpenPose's input, a larger one, or a smaller one; YOLO-pose at those of `_SIDES`.
    """
    first = next((one for one in MODES[params.mode].passes if one.model.decoder == Decoder.PAF), _thin(0.5))
    first = replace(first, model=model, mirror=first.mirror and model.decoder == Decoder.PAF)
    if model.decoder == Decoder.YOLO_POSE:
        first = NetworkPass(model, (_SIDES[params.mode], _SIDES[params.mode]))
    if params.look_closer <= 0:
        return Recipe((first,))
    return Recipe((replace(first, weight=_SEARCH_WEIGHT),), (replace(THUNDER_CROP, place_weight=_SEARCH_WEIGHT),),
                  acceptance=_SEARCH_ACCEPTANCE)


def _wanted_box(params: DetectorParams, box: Tuple[int, int]) -> Tuple[int, int]:
    width, height = params.net_input_width, params.net_input_height
    return width or (-1 if height > 0 else box[0]), height or (-1 if width > 0 else box[1])


def _wanted_zooms(params: DetectorParams, zooms: Tuple[float, ...]) -> Tuple[float, ...]:
    if params.num_scales == 0 and params.scale_gap == 0:
        return zooms
    gap = params.scale_gap or _SCALE_GAP
    return tuple(1 - i * gap for i in range(params.num_scales or len(zooms)))

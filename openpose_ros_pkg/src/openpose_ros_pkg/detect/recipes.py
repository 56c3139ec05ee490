"""What the detector computes for an image: which networks, at which sizes, and how people are refined on crops."""
import functools
from dataclasses import dataclass, replace
from typing import Collection, Dict, Optional, Tuple, cast

import numpy as np

from openpose_ros_pkg.decode.paf import DecodeParams
from openpose_ros_pkg.ensemble import Sources, sigmas
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.networks.backends import BackendParams, LiveBackendParams
from openpose_ros_pkg.networks.model_registry import (
    AUTO,
    MOBILENET_THIN,
    MOVENET_MULTIPOSE,
    MOVENET_THUNDER,
    PICODET,
    TINYPOSE,
)
from openpose_ros_pkg.networks.model_types import CROP_DECODERS, Decoder, Model
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import WHOLE_BODY_POINTS, keypoints_in
from openpose_ros_pkg.skeletons import BODY_25, COCO_18, SkeletonModel

BEST = 'best'  # the mode whose networks are those that are installed by name


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
        'balanced', 'How much is computed for an image: fast, for weak machines; balanced; accurate, for image files '
                    'and recordings, takes up to ten times as long as balanced; best, the best networks that are '
                    'installed by name (`./run model get`) and, with target_rate, fast enough, or balanced where there '
                    'are none.', choices=('fast', 'balanced', 'accurate', BEST))
    pose_model: str = parameter(
        AUTO, 'auto: the networks of the mode, with toes and heels (BODY_25); COCO: the same without toes and heels '
              '(COCO_18); or one network alone: mobilenet_thin, movenet_multipose, body_25, ... (`./run model list`), '
              'or one of your own: a file (.onnx, .xml), or a .yaml file that describes it. With look_closer, '
              'the network for crops refines its people. A network for crops (SimCC, '
              "such as RTMPose) takes the place of the mode's; one that finds boxes (YOLOX) leaves the joints to the "
              'network for crops.')
    crop_model: str = parameter(
        '', "Network that sees each person on a crop, when people are refined and followed: empty, the mode's; or "
            'movenet_thunder, movenet_multipose, tinypose, one of your own as for pose_model, of the kinds SimCC '
            '(RTMPose), heat maps (PP-TinyPose) or MoveNet for one person. One that knows feet makes them joints of '
            'all people (BODY_25).')
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
            "image, the surest first; -1: the mode's number, and with one network alone 0 unless there is a "
            'crop_model.', minimum=-1, maximum=100)
    target_rate: float = _target_rate(0.0)

    @property
    def feet(self) -> bool:
        """Whether people who are seen on crops get toes and heels of a network for landmarks of bodies."""
        return self.pose_model == AUTO and self.look_closer != 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.net_input_width < 0 and self.net_input_height < 0:
            raise ParameterError("parameters 'net_input_width', 'net_input_height' = -1, -1 are not allowed: -1 for "
                                 'one of them')
        zooms = wanted_zooms(self, mode_of(self.mode).passes[0].zooms)
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
    # factors on the box: fields are averaged over them, boxes put together, another network gives an opinion for each
    zooms: Tuple[float, ...] = (1.0,)
    # also over the mirror image: part affinity fields are averaged, boxes put together; no other network has it
    mirror: bool = False
    weight: float = 1.0  # of this opinion where several are put together
    # Of a network that gives boxes: what finds the person in a box, so that this is a pass like any other. Refinement
    # sees the people again, now upright, with the others covered and, where people are followed, without any box.
    crop: Optional['CropRefinement'] = None

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people that it finds."""
        return self.model.skeleton if self.crop is None else self.crop.model.skeleton

    @property
    def opinions(self) -> int:
        """Number of opinions on a person that it gives."""
        return 1 if self.model.decoder == Decoder.PAF or self.crop else len(self.zooms)

    @property
    def description(self) -> str:
        """What is computed, for the log."""
        width, height = self.model.input.fixed_size or self.box
        scales = f' at {len(self.zooms)} scales' if len(self.zooms) > 1 else ''
        boxes = f', {self.crop.model.name} in its boxes' if self.crop else ''
        return f"{self.model.name} {width}x{height}{scales}{' mirrored too' if self.mirror else ''}{boxes}"


@dataclass(frozen=True)
class CropRefinement:
    """A network that sees each person a second time, on a crop of the image with the aspect of its input."""

    model: Model  # the network
    margin: float  # sides of the crop per side of the bounding box of the person's joints, brought to that aspect
    mirror: bool = False  # the network sees the mirror image of the crop
    size: Tuple[int, int] = (256, 256)  # width and height of the network's input [px]
    # the person is in the middle also at the border of the image, which is repeated beyond; else the crop ends there
    centred: bool = False
    place_weight: float = 1.0  # of this opinion on the places of joints; on their scores it has a weight of 1

    @property
    def one_person(self) -> bool:
        """Whether the network takes for granted that it sees one person, upright."""
        return self.model.decoder in (Decoder.MOVENET_SINGLEPOSE, *CROP_DECODERS)


# OpenPose's default, flags.hpp.
_SCALE_GAP = 0.3
# MoveNet Thunder was trained for crops; where it is not there, MoveNet MultiPose refines fewer people, less accurately.
THUNDER_CROP = CropRefinement(MOVENET_THUNDER, 1.3, centred=True, place_weight=8.0)
MULTIPOSE_CROP = CropRefinement(MOVENET_MULTIPOSE, 1.6)
_REFINED_BY_MULTIPOSE = 6
# Sides of the box of a person per side of the box of the joints: rtmlib, pose_tracker.py, pose_to_bbox; the median of
# 51 annotated people is 1.23.
PERSON_BOX = 1.25
# SimCC networks see the box of a person enlarged by 1.25 (mmpose, GetBBoxCenterScale; rtmlib, rtmpose.py). Opinions on
# places count by the inverse of their variance: with normal errors, the AP of 0.70 of RTMPose-s and that of 0.38 of
# Thunder mean variances of 1 to 2.5.
_SIMCC_SIZE = 192, 256
_SIMCC_MARGIN, _SIMCC_PLACE_WEIGHT = 1.25 * PERSON_BOX, 2.5 * THUNDER_CROP.place_weight


def crop_of(model: Model) -> CropRefinement:
    """Return how a network sees people on crops.

    Raises:
        ParameterError: it is none for crops.
    """
    if model.decoder in CROP_DECODERS:
        weight = _SIMCC_PLACE_WEIGHT if model.decoder == Decoder.SIMCC else THUNDER_CROP.place_weight
        return CropRefinement(model, _SIMCC_MARGIN, size=model.input.fixed_size or _SIMCC_SIZE, centred=True,
                              place_weight=weight)
    if model.decoder == Decoder.MOVENET_SINGLEPOSE:
        return replace(THUNDER_CROP, model=model, size=model.input.fixed_size or THUNDER_CROP.size)
    if model.decoder == Decoder.MOVENET_MULTIPOSE:
        return replace(MULTIPOSE_CROP, model=model)
    raise ParameterError(f"parameter 'crop_model' = {model.name!r} is not allowed: its decoder is {model.decoder}, "
                         f'expected a network for crops: {", ".join(CROP_DECODERS)}, {Decoder.MOVENET_SINGLEPOSE} '
                         f'or {Decoder.MOVENET_MULTIPOSE}', 'crop_model')


@dataclass(frozen=True)
class Recipe:
    """All that is computed for an image."""

    passes: Tuple[NetworkPass, ...]  # the networks that see the full image
    refinements: Tuple[CropRefinement, ...] = ()  # how each person is refined on crops
    max_refined: int = 20  # greatest number of people who are refined, the surest first; bounds the time
    # factor on the scores that joints and people need: of more opinions, more miss a person who is there
    acceptance: float = 1.0
    named: Tuple[Model, ...] = ()  # networks that the user named, beside the first
    joint_set: Optional[SkeletonModel] = None  # of the people; None: that of the networks

    @property
    def models(self) -> Tuple[Model, ...]:
        """The networks that it takes, each once."""
        models = [network_pass.model for network_pass in self.passes] + [one.model for one in self.crops]
        return tuple({model.name: model for model in models}.values())

    @property
    def needed(self) -> Tuple[Model, ...]:
        """The networks without which nothing is computed: the first, what sees people in its boxes, and named ones."""
        first = self.passes[0]
        return (first.model, *((first.crop.model,) if first.crop else ()), *self.named)

    @property
    def crops(self) -> Tuple[CropRefinement, ...]:
        """How networks see people on crops: in boxes, and when they are refined."""
        return (*(one.crop for one in self.passes if one.crop), *self.refinements)

    @property
    def whole_body(self) -> bool:
        """Whether a network for crops gives hands and faces as well, see `Poses.points`."""
        return any(one.model.points == WHOLE_BODY_POINTS for one in self.refinements)

    @functools.cached_property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people, that of the first network, and feet where a network for crops knows them."""
        first = self.passes[0].skeleton
        if self.joint_set is not None:
            return self.joint_set
        return BODY_25 if first == COCO_18 and BODY_25 in [one.model.skeleton for one in self.refinements] else first

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
        """The sources of the opinions. Each tells of the joints that its skeleton has, or makes, of the recipe's."""
        skeletons = [one.skeleton for one in self.passes for _ in range(one.opinions)]
        skeletons += [one.model.skeleton for one in self.refinements]
        known = [keypoints_in(np.zeros((1, len(one.joints), 3)), one, self.skeleton)[0, :, 0] for one in skeletons]
        return Sources(sigmas(self.skeleton), np.array(self.weights), np.array(self.place_weights),
                       np.isfinite(np.array(known)))

    def box_pass(self, refinement: CropRefinement) -> int:
        """Return the number of the opinion of what a refinement sees in boxes; -1: there is none."""
        boxes = [number for number, one in enumerate(self.passes) if one.crop == refinement
                 and refinement.model.points != WHOLE_BODY_POINTS]  # opinions of boxes have no hands and faces
        return sum(one.opinions for one in self.passes[:boxes[0]]) if boxes else -1

    @property
    def is_ensemble(self) -> bool:
        """Whether there are several opinions on a person."""
        return len(self.weights) > 1

    @property
    def description(self) -> str:
        """What is computed, for the log."""
        parts = [network_pass.description for network_pass in self.passes]
        for model in dict.fromkeys(one.model.name for one in self.refinements):
            sizes = [one.size for one in self.refinements if one.model.name == model]
            parts.append(f'{len(sizes)} crop refinement{"s" * (len(sizes) > 1)} by {model} at '
                         f'{sizes[0][0]}x{sizes[0][1]} px for up to {self.max_refined} people')
        return ' + '.join(parts)

    def without(self, missing: Collection[Model]) -> 'Recipe':
        """Return what is left without some networks; where no network for crops is left, MultiPose refines people."""
        passes = tuple(one for one in self.passes if one.model not in missing)
        refinements = tuple(one for one in self.refinements if one.model not in missing)
        if self.refinements and not refinements and MOVENET_MULTIPOSE not in missing:
            return replace(self, passes=passes, refinements=(MULTIPOSE_CROP,),
                           max_refined=min(self.max_refined, _REFINED_BY_MULTIPOSE))
        return replace(self, passes=passes, refinements=refinements)


WHOLE_IMAGE = NetworkPass(MOBILENET_THIN, (656, 368), weight=1.5)
"""A network with part affinity fields at the size of OpenPose's input."""


# MoveNet finds large people well, six at most; mobilenet_thin finds small people and crowds. Each finds people that the
# other misses, and where both see a joint its place is surer. Crop refinement improves accuracy most for its time; the
# mirror image and other sizes come next. Accuracy and time of each: docs/results.md.
MODES: Dict[str, Recipe] = {
    'fast': Recipe((NetworkPass(MOVENET_MULTIPOSE, (384, 384)),), (THUNDER_CROP,)),
    'balanced': Recipe((WHOLE_IMAGE, NetworkPass(MOVENET_MULTIPOSE, (512, 512))), (THUNDER_CROP,)),
    'accurate': Recipe(
        (NetworkPass(MOBILENET_THIN, (984, 552), (1.0, 2 / 3, 1 / 3), mirror=True, weight=3.0),
         NetworkPass(MOVENET_MULTIPOSE, (512, 512), (1.0, 0.5))),
        (MULTIPOSE_CROP, replace(MULTIPOSE_CROP, mirror=True), THUNDER_CROP,
         replace(THUNDER_CROP, margin=1.6, mirror=True)), acceptance=0.8),
}


# The same modes where the networks of `people-small` are: PicoDet finds boxes of people, also in the mirror image,
# PP-TinyPose their joints; Thunder is the second opinion on each. mobilenet_thin and MoveNet MultiPose bring nothing
# beside them.
_TINY_CROP = crop_of(TINYPOSE)
_IN_BOXES = NetworkPass(PICODET, (320, 320), mirror=True, crop=_TINY_CROP)
SMALL_MODES: Dict[str, Recipe] = {name: Recipe((_IN_BOXES,), crops, acceptance=0.6) for name, crops in {
    'fast': (_TINY_CROP,),
    'balanced': (_TINY_CROP, THUNDER_CROP),
    'accurate': (_TINY_CROP, replace(_TINY_CROP, mirror=True), THUNDER_CROP,
                 replace(THUNDER_CROP, margin=1.6, mirror=True)),
}.items()}


def mode_of(name: str) -> Recipe:
    """Return the recipe of a mode; of the best one, that where no better networks are there."""
    return MODES.get(name, MODES['balanced'])


def wanted_zooms(params: DetectorParams, zooms: Tuple[float, ...]) -> Tuple[float, ...]:
    """Return the factors on the sizes at which the first network sees the image, by the parameters or its recipe."""
    if params.num_scales == 0 and params.scale_gap == 0:
        return zooms
    gap = params.scale_gap or _SCALE_GAP
    return tuple(1 - i * gap for i in range(params.num_scales or len(zooms)))

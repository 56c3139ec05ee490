"""Networks that users describe in a YAML file; docs/networks.md shows the format."""
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple, Optional, Tuple

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.model_registry import ALIASES, MODELS
from openpose_ros_pkg.networks.model_types import (
    CROP_DECODERS,
    SIMCC_INPUT,
    YOLO_INPUT,
    YOLOX_INPUT,
    Decoder,
    InputRecipe,
    Model,
    UserFiles,
    WeightsFile,
    skeleton_of,
)
from openpose_ros_pkg.params.records import to_record
from openpose_ros_pkg.skeletons import (
    COLOURS,
    MESSAGE_JOINTS,
    POINT_SETS,
    SKELETONS,
    Limb,
    SkeletonModel,
    starting_limbs,
)
from openpose_ros_pkg.structured_text import file_values

# Number of outputs that each decoder takes.
_OUTPUTS = {Decoder.PAF: (1, 2), Decoder.MOVENET_MULTIPOSE: (1,), Decoder.MOVENET_SINGLEPOSE: (1,), Decoder.RTMO: (2,),
            Decoder.YOLO_POSE: (0, 1), Decoder.SIMCC: (2,), Decoder.BOXES: (1, 2),
            Decoder.HEAT_MAPS: (1,), Decoder.PICODET: (2,)}
# Inputs of networks that look alike whatever their maker.
_INPUTS = {Decoder.YOLO_POSE: YOLO_INPUT, Decoder.SIMCC: SIMCC_INPUT, Decoder.BOXES: YOLOX_INPUT,
           Decoder.HEAT_MAPS: SIMCC_INPUT, Decoder.PICODET: SIMCC_INPUT}


class _Skeleton(NamedTuple):
    """The keys of a joint set of its own."""

    joints: Tuple[str, ...]
    limbs: Tuple[Limb, ...]
    drawn_limbs: Optional[Tuple[Tuple[str, str], ...]] = None


@dataclass(frozen=True)
class _Description:
    """The keys of a file; `skeleton` and `input` are read apart."""

    files: Tuple[WeightsFile, ...]
    decoder: Literal['paf', 'movenet_multipose', 'movenet_singlepose', 'rtmo', 'yolo_pose', 'simcc', 'yolox',
                     'heat_maps', 'picodet']
    outputs: Tuple[str, ...] = ()
    licence: str = 'not stated'
    source: str = ''
    output_layout: Literal['NCHW', 'NHWC'] = 'NCHW'
    points: int = 17
    output_scale: float = 1.0
    stride: Optional[int] = None
    heatmaps: Optional[int] = None
    peak_threshold: float = 0.0

    def __post_init__(self) -> None:
        points = POINT_SETS if self.decoder == Decoder.SIMCC else (17,)
        counts = _OUTPUTS[self.decoder]
        for name, right, expected in (
                ('points', self.points in points, f'one of {", ".join(map(str, points))}'),
                ('outputs', len(self.outputs) in counts,
                 f'{" or ".join(map(str, counts))} names for decoder {self.decoder}'),
                ('stride', self.stride is None or 1 <= self.stride <= 64, 'a number in 1 .. 64')):
            if not right:
                raise ValueError(f'{name} = {getattr(self, name)!r}, expected {expected}')
        if not self.files or any(Path(file.name).name != file.name for file in self.files):
            raise ValueError('files: expected names of files that lie beside the description')


def read_description(path: Path) -> Model:
    """Return the network that a YAML file describes, named like the file; the weights need not be there.

    Raises:
        ModelError: the file can not be read, or a key is unknown, missing or has a value that is not allowed.
    """
    if not re.fullmatch(r'[A-Za-z0-9_-]+', path.stem) or path.stem in {**MODELS, **ALIASES, **SKELETONS}:
        raise ModelError(f'{path}: a network can not have the name {path.stem!r}: letters, digits, _ and -, and none '
                         f'of {", ".join([*MODELS, *ALIASES, *SKELETONS])}')
    content = file_values(path, str(path), ModelError)
    if not isinstance(content, dict):
        raise ModelError(f'{path}: expected keys with values, got {content!r:.80}')
    values = {key: value for key, value in content.items() if key not in ('skeleton', 'input')}
    if isinstance(values.get('files'), list):
        values['files'] = [{'name': file} if isinstance(file, str) else file for file in values['files']]
    described = to_record(values, _Description, str(path), ModelError)
    is_paf = described.decoder == Decoder.PAF
    stride = described.stride or (8 if is_paf else 32)
    try:
        skeleton = _skeleton(content.get('skeleton'), path, described)
        recipe = _input(content.get('input', {}), described.decoder, stride, str(path))
    except ValueError as error:
        raise ModelError(f'{path}: {error}') from error
    files = tuple(replace(file, sha256=file.sha256.lower(), md5=file.md5.lower()) for file in described.files)
    heatmaps = described.heatmaps or len(skeleton.joints) + 1
    if is_paf and heatmaps < len(skeleton.joints):
        raise ModelError(f'{path}: heatmaps = {heatmaps}, expected {len(skeleton.joints)} or more')
    return Model(
        name=path.stem, skeleton=skeleton, files=files, licence=described.licence,
        source=UserFiles(described.source or f'the maker of {path}'), input=recipe, outputs=described.outputs,
        decoder=described.decoder, points=described.points, stride=stride, output_scale=described.output_scale,
        output_layout=described.output_layout, heatmaps=heatmaps if is_paf else 0,
        peak_threshold=described.peak_threshold, description=path)


def _input(values: Any, decoder: str, stride: int, where: str) -> InputRecipe:
    """Return the network's input; missing keys are those of `InputRecipe`, or of the decoder's networks."""
    recipe = to_record(values, InputRecipe, f'{where}: input', ModelError, replace(
        _INPUTS.get(decoder, InputRecipe()), multiple_of=stride))
    for key, value in (('mean', recipe.mean), ('scale', recipe.scale)):
        if isinstance(value, tuple) and len(value) != 3:
            raise ValueError(f'input: {key} = {list(value)}, expected a number, or three, of the colours')
    if recipe.multiple_of % stride or any(side % stride for side in recipe.fixed_size or ()):
        raise ValueError(f'input: multiple_of and fixed_size, expected multiples of stride, which is {stride}')
    if decoder in CROP_DECODERS and not recipe.fixed_size:  # what they give has places for the pixels of the input
        raise ValueError(f'input: fixed_size is missing, expected width and height for decoder {decoder}')
    return recipe


def _skeleton(value: Any, path: Path, described: _Description) -> SkeletonModel:
    """Return the joint set: a known one by its name, or the description's own."""
    if isinstance(value, dict):
        skeleton = _own_skeleton(to_record(value, _Skeleton, f'{path}: skeleton', ModelError), path.stem)
    elif value is None and described.decoder != Decoder.PAF:
        skeleton = skeleton_of(described.points)
    elif isinstance(value, str) and value in SKELETONS:
        skeleton = SKELETONS[value]
    else:
        raise ValueError(f'skeleton = {value!r}, expected keys, or one of {", ".join(SKELETONS)}')
    if described.decoder == Decoder.PAF and not skeleton.limbs:
        raise ValueError(f'skeleton = {value!r}, expected one with limbs, for decoder paf')
    if described.decoder != Decoder.PAF and skeleton is not skeleton_of(described.points):
        raise ValueError(f'skeleton = {value!r}, expected {skeleton_of(described.points).name}, which is what decoder '
                         f'{described.decoder} gives')
    return skeleton


def _own_skeleton(read: _Skeleton, name: str) -> SkeletonModel:
    """Return a joint set that a description spells out, with OpenPose's colours."""
    joints, limbs = read.joints, read.limbs
    if not set(joints) <= set(MESSAGE_JOINTS) or len(set(joints)) != len(joints):
        raise ValueError(f'skeleton: joints = {list(joints)}, expected each once, of {", ".join(MESSAGE_JOINTS)}')
    drawn = starting_limbs(limbs) if read.drawn_limbs is None else read.drawn_limbs
    ends = [*((limb.start, limb.end) for limb in limbs), *drawn]
    unknown = [pair for pair in ends if not set(pair) <= set(joints)]
    if unknown:
        raise ValueError(f'skeleton: limb {" - ".join(unknown[0])}, expected two of {", ".join(joints)}')
    channels = sorted(channel for limb in limbs for channel in limb.paf)
    if channels != list(range(2 * len(limbs))):
        raise ValueError(f'skeleton: limbs: paf = {channels} in all, expected each channel of 0 .. '
                         f'{2 * len(limbs) - 1} once')
    return SkeletonModel(name, joints, limbs, drawn, tuple(COLOURS[joint] for joint in joints))

"""Networks that users describe in a YAML file; docs/networks.md shows the format."""
import difflib
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, List, Mapping, Sequence, Tuple, Union

from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.networks.model_registry import ALIASES, MODELS
from openpose_ros_pkg.networks.model_types import (
    DETR_POSE_INPUT,
    RF_DETR_INPUT,
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
            Decoder.YOLO_POSE: (0, 1), Decoder.SIMCC: (2,), Decoder.DETR_POSE: (2, 3), Decoder.RF_DETR: (3,),
            Decoder.BOXES: (1, 2)}
# Inputs of networks that look alike whatever their maker.
_INPUTS = {Decoder.YOLO_POSE: YOLO_INPUT, Decoder.SIMCC: SIMCC_INPUT, Decoder.DETR_POSE: DETR_POSE_INPUT,
           Decoder.RF_DETR: RF_DETR_INPUT, Decoder.BOXES: YOLOX_INPUT}
# Which need a size of their own: what they give has places for its pixels, or was trained for it alone.
_SIZED = (Decoder.SIMCC, Decoder.RF_DETR)
_HASH_DIGITS = {'md5': 32, 'sha256': 64}
_REQUIRED = object()


def read_description(path: Path) -> Model:
    """Return the network that a YAML file describes, named like the file; the weights need not be there.

    Raises:
        ModelError: the file can not be read, or a key is unknown, missing or has a value that is not allowed.
    """
    if not re.fullmatch(r'[A-Za-z0-9_-]+', path.stem) or path.stem in {**MODELS, **ALIASES, **SKELETONS}:
        raise ModelError(f'{path}: a network can not have the name {path.stem!r}: letters, digits, _ and -, and none '
                         f'of {", ".join([*MODELS, *ALIASES, *SKELETONS])}')
    content = file_values(path, str(path), ModelError)
    top = _Section(path, '', content, ('skeleton', 'files', 'licence', 'source', 'input', 'outputs', 'output_layout',
                                       'decoder', 'stride', 'heatmaps', 'peak_threshold', 'points', 'output_scale'))
    decoder = top.choice('decoder', tuple(_OUTPUTS))
    points = top.number_among('points', tuple(POINT_SETS) if decoder == Decoder.SIMCC else (17,), 17)
    skeleton = _skeleton(top, path.stem, decoder, points)
    joints = len(skeleton.joints)
    stride = top.integer('stride', 1, 64, 8 if decoder == Decoder.PAF else 32)
    outputs = top.texts('outputs', () if decoder == Decoder.YOLO_POSE else _REQUIRED)
    if len(outputs) not in _OUTPUTS[decoder]:
        counts = ' or '.join(str(count) for count in _OUTPUTS[decoder])
        raise top.error('outputs', f'{counts} names for decoder {decoder}')
    return Model(
        name=path.stem, skeleton=skeleton, files=_files(top), licence=top.text('licence', 'not stated'),
        source=UserFiles(top.text('source', f'the maker of {path}')), input=_input(top, decoder, stride),
        outputs=outputs, decoder=decoder, points=points, stride=stride,
        output_scale=top.number('output_scale', 1e-6, 1e6, 1.0),
        output_layout=top.choice('output_layout', ('NCHW', 'NHWC'), 'NCHW'),
        heatmaps=top.integer('heatmaps', joints, 1000, joints + 1) if decoder == Decoder.PAF else 0,
        peak_threshold=top.number('peak_threshold', 0.0, 1.0, 0.0), description=path)


class _Section:
    """One mapping of a description, with checked values and error texts that name its place.

    Args:
        where: its key, as 'input'; empty for the file itself.
        keys: the allowed ones.

    Raises:
        ModelError: not a mapping, or an unknown key.
    """

    def __init__(self, path: Path, where: str, values: Any, keys: Sequence[str]) -> None:
        if not isinstance(values, dict):
            raise ModelError(f'{path}: {where or "the file"} = {values!r} is not allowed: a mapping with keys among '
                             f'{", ".join(keys)}')
        self.path, self.where, self.values = path, where, values
        for key in values:
            if key not in keys:
                near = difflib.get_close_matches(str(key), keys, n=1)
                hint = f" (did you mean '{near[0]}'?)" if near else ''
                raise ModelError(f"{path}: unknown key '{self._full(key)}' = {values[key]!r}{hint}; allowed: "
                                 f'{", ".join(keys)}')

    def _full(self, key: Any) -> str:
        return f'{self.where}.{key}' if self.where else str(key)

    def error(self, key: str, allowed: str) -> ModelError:
        """Return the error for a missing key or a value that is not allowed."""
        if key not in self.values:
            return ModelError(f"{self.path}: the key '{self._full(key)}' is missing: {allowed}")
        return self.refused(key, self.values[key], allowed)

    def refused(self, key: str, value: Any, allowed: str) -> ModelError:
        """Return the error for a value of a key, or of a part of it, that is not allowed."""
        return ModelError(f"{self.path}: '{self._full(key)}' = {value!r} is not allowed: {allowed}")

    def _given(self, key: str, default: Any, right: Callable[[Any], Any], allowed: str) -> Any:
        """Return the value of a key, or its default; `right` returns whether a value is allowed."""
        if key not in self.values and default is not _REQUIRED:
            return default
        if key not in self.values or not right(self.values[key]):
            raise self.error(key, allowed)
        return self.values[key]

    def text(self, key: str, default: Any = _REQUIRED) -> str:
        return self._given(key, default, lambda value: isinstance(value, str) and value.strip(), 'a text')

    def choice(self, key: str, choices: Sequence[str], default: Any = _REQUIRED) -> str:
        return self._given(key, default, lambda value: isinstance(value, str) and value in choices,
                           f'one of {", ".join(choices)}')

    def texts(self, key: str, default: Any = _REQUIRED) -> Tuple[str, ...]:
        return tuple(self._given(key, default, lambda value: isinstance(value, list) and value and all(
            isinstance(item, str) and item for item in value), 'a list of texts'))

    def flag(self, key: str, default: bool) -> bool:
        return self._given(key, default, lambda value: isinstance(value, bool), 'true or false')

    def integer(self, key: str, minimum: int, maximum: int, default: Any = _REQUIRED) -> int:
        return self._given(key, default, lambda value: type(value) is int and minimum <= value <= maximum,
                           f'a whole number in {minimum} .. {maximum}')

    def number_among(self, key: str, choices: Sequence[int], default: int) -> int:
        return self._given(key, default, lambda value: type(value) is int and value in choices,
                           f'one of {", ".join(map(str, choices))}')

    def number(self, key: str, minimum: float, maximum: float, default: float) -> float:
        return float(self._given(key, default, lambda value: _is_number(value, minimum, maximum),
                                 f'a number in {minimum:g} .. {maximum:g}'))

    def of_colours(self, key: str, minimum: float, maximum: float, default: Union[float, Tuple[float, ...]]
                   ) -> Union[float, Tuple[float, ...]]:
        value = self._given(key, default, lambda value: _is_number(value, minimum, maximum) or (
            isinstance(value, list) and len(value) == 3 and all(_is_number(item, minimum, maximum) for item in value)),
            f'a number in {minimum:g} .. {maximum:g}, or three, of the colours')
        return tuple(map(float, value)) if isinstance(value, (list, tuple)) else float(value)

    def pair(self, key: str, minimum: int, maximum: int, default: Any = _REQUIRED) -> Any:
        value = self._given(key, default, lambda value: isinstance(value, list) and len(value) == 2 and all(
            type(item) is int and minimum <= item <= maximum for item in value),
            f'two whole numbers in {minimum} .. {maximum}')
        return value if value is None else (value[0], value[1])

    def items(self, key: str, default: Any = _REQUIRED) -> List[Any]:
        return self._given(key, default, lambda value: isinstance(value, list) and value, 'a list')


def _is_number(value: Any, minimum: float, maximum: float) -> bool:
    return type(value) in (int, float) and minimum <= value <= maximum


def _input(top: _Section, decoder: str, stride: int) -> InputRecipe:
    """Return the network's input; missing keys are those of `InputRecipe`, or of the decoder's networks."""
    standard = replace(_INPUTS.get(decoder, InputRecipe()), multiple_of=stride)
    section = _Section(top.path, 'input', top.values.get('input', {}), tuple(vars(standard)))
    recipe = InputRecipe(
        channels=section.choice('channels', ('BGR', 'RGB'), standard.channels),
        layout=section.choice('layout', ('NCHW', 'NHWC'), standard.layout),
        dtype=section.choice('dtype', ('float32', 'uint8'), standard.dtype),
        mean=section.of_colours('mean', 0.0, 255.0, standard.mean),
        scale=section.of_colours('scale', 1e-6, 1e3, standard.scale),
        multiple_of=section.integer('multiple_of', stride, 1024, standard.multiple_of),
        padding=section.integer('padding', 0, 255, standard.padding),
        fixed_size=section.pair('fixed_size', stride, 8192, _REQUIRED if decoder in _SIZED else None),
        centred=section.flag('centred', standard.centred), stretched=section.flag('stretched', standard.stretched))
    if recipe.multiple_of % stride:
        raise section.error('multiple_of', f'a multiple of stride, which is {stride}')
    if recipe.fixed_size and any(side % stride for side in recipe.fixed_size):
        raise section.error('fixed_size', f'width and height that are multiples of stride, which is {stride}')
    return recipe


def _files(top: _Section) -> Tuple[WeightsFile, ...]:
    """Return the files, each given by its name or as a mapping with checksums."""
    files = []
    for i, item in enumerate(top.items('files')):
        section = _Section(top.path, f'files[{i}]', {'name': item} if isinstance(item, str) else item,
                           ('name', 'size', 'sha256', 'md5'))
        name = section.text('name')
        if Path(name).name != name:
            raise section.error('name', 'the name of a file that lies beside the description')
        hashes = {kind: section.text(kind, '').lower() for kind in _HASH_DIGITS}
        for kind, digits in _HASH_DIGITS.items():
            if not re.fullmatch(f'([0-9a-f]{{{digits}}})?', hashes[kind]):
                raise section.error(kind, f'{digits} hexadecimal digits')
        files.append(WeightsFile(name, section.integer('size', 0, 1 << 40, 0), hashes['sha256'], hashes['md5']))
    return tuple(files)


def _skeleton(top: _Section, name: str, decoder: str, points: int) -> SkeletonModel:
    """Return the joint set: a known one by its name, or the description's own."""
    value = top.values.get('skeleton')
    if not isinstance(value, dict):
        default = _REQUIRED if decoder == Decoder.PAF else skeleton_of(points).name
        skeleton = SKELETONS[top.choice('skeleton', tuple(SKELETONS), default)]
    else:
        skeleton = _own_skeleton(_Section(top.path, 'skeleton', value, ('joints', 'limbs', 'drawn_limbs')), name)
    if decoder == Decoder.PAF and not skeleton.limbs:
        raise top.error('skeleton', 'one with limbs, for decoder paf')
    if decoder != Decoder.PAF and skeleton is not skeleton_of(points):
        raise top.error('skeleton', f'{skeleton_of(points).name}, which is what decoder {decoder} gives')
    return skeleton


def _own_skeleton(section: _Section, name: str) -> SkeletonModel:
    """Return a joint set that a description spells out, with OpenPose's colours."""
    joints = section.texts('joints')
    for i, joint in enumerate(joints):
        if joint not in MESSAGE_JOINTS or joint in joints[:i]:
            raise section.refused(f'joints[{i}]', joint,
                                  f'each once, of those that messages hold: {", ".join(MESSAGE_JOINTS)}')
    items = section.items('limbs')
    limbs = tuple(_limb(section.path, i, item, joints, len(items)) for i, item in enumerate(items))
    channels = sorted(channel for limb in limbs for channel in limb.paf)
    if channels != list(range(2 * len(limbs))):
        raise ModelError(f"{section.path}: 'paf' of 'skeleton.limbs' = {channels} in all is not allowed: each channel "
                         f'of 0 .. {2 * len(limbs) - 1} once')
    drawn = starting_limbs(limbs)
    if 'drawn_limbs' in section.values:
        drawn = tuple(section.items('drawn_limbs'))
        for i, ends in enumerate(drawn):
            if not isinstance(ends, list) or len(ends) != 2 or any(joint not in joints for joint in ends):
                raise section.refused(f'drawn_limbs[{i}]', ends, f'two of {", ".join(joints)}')
        drawn = tuple((start, end) for start, end in drawn)
    try:
        return SkeletonModel(name, joints, limbs, drawn, tuple(COLOURS[joint] for joint in joints))
    except ValueError as error:
        raise ModelError(f"{section.path}: 'skeleton' is not allowed: {error}") from error


def _limb(path: Path, number: int, value: Mapping[str, Any], joints: Sequence[str], limbs: int) -> Limb:
    section = _Section(path, f'skeleton.limbs[{number}]', value, ('start', 'end', 'paf', 'starts_person'))
    return Limb(section.choice('start', joints), section.choice('end', joints), section.pair('paf', 0, 2 * limbs - 1),
                section.flag('starts_person', True))

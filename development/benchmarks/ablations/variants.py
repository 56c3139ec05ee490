"""What an ablation varies: each constant at half and at twice its value, and mechanisms that are off.

Half and twice: arrays and tuples as a whole; integers are rounded, at least 1, and odd where the value is odd and above
9; shares and likelihoods (0..1, without a unit of their own) are at most 1. Words in tuples, such as joints, stay.
"""
import contextlib
from dataclasses import fields, is_dataclass, replace
from types import MappingProxyType
from typing import Any, Dict, Iterable, Iterator, List, Mapping, NamedTuple, Tuple

import numpy as np

from openpose_ros_pkg import ensemble
from openpose_ros_pkg.decode import direct, paf
from openpose_ros_pkg.detect import (
    crops,
    detector,
    following,
    head_recovery,
    occlusion_masks,
    schedule,
    target_rate,
    tracking,
)
from skeleton_extract_3d.constants import METHOD, MethodConstants

# Shared instances of the constants of detection, by the names of their modules.
DETECTION: Dict[str, Any] = {
    'ensemble.area': ensemble.AREA, 'ensemble': ensemble.ENSEMBLE, 'decode.paf': paf.DECODE,
    'decode.direct': direct.DIRECT, 'detect.candidates': detector.CANDIDATES, 'detect.crops': crops.CROP,
    'detect.cover': occlusion_masks.COVER, 'detect.layers': occlusion_masks.LAYERS,
    'detect.head_recovery': head_recovery.HEADS}
FOLLOWING: Dict[str, Any] = {
    'detect.following': following.FOLLOWING, 'detect.schedule': schedule.SCHEDULE,
    'detect.target_rate': target_rate.RATE, 'detect.tracking': tracking.TRACKING}
# Parts of the method that the people of these scenes do not show: guards against bad input, hands and faces, joints
# that COCO_18 does not have.
NOT_SHOWN = ('camera_fit', 'camera_limits', 'plausibility', 'landmarks', 'extra_joints', 'joint_frames', 'track.memory')

PARTS = ('estimator', 'floor', 'detection', 'following')

Values = Mapping[str, Any]
"""Values of constants by their paths, such as track.identity.same_depth."""


class Variant(NamedTuple):
    """Values that differ from the present ones: constants by path, and parameters of the chain by name."""

    name: str
    constants: Values
    parameters: Values = MappingProxyType({})


def constant_paths(values: Any, path: str = '') -> Iterator[Tuple[str, Any]]:
    """Return path and value of each constant in a record of records."""
    for field in fields(values):
        name, value = f'{path}.{field.name}' if path else field.name, getattr(values, field.name)
        if name in NOT_SHOWN:
            continue
        if is_dataclass(value):
            yield from constant_paths(value, name)
        else:
            yield name, (value, field.metadata)


def scaled(value: Any, factor: float, at_most: float = np.inf) -> Any:
    """Return a value times a factor; see the module."""
    if isinstance(value, np.ndarray):
        return value * factor
    if isinstance(value, (tuple, list)):
        return tuple(scaled(one, factor, at_most) for one in value)
    if isinstance(value, (str, bool)):
        return value
    if isinstance(value, int):
        rounded = round(value * factor)
        if value > 9 and value % 2:
            rounded += 1 - rounded % 2
        return max(rounded, 1) if value > 0 else rounded
    return min(value * factor, at_most)


def half_and_twice(paths: Iterable[Tuple[str, Any]]) -> List[Variant]:
    """Return two variants of each constant that is not 0."""
    variants = []
    for path, (value, metadata) in paths:
        is_share = isinstance(value, float) and 0 < value <= 1 and metadata['unit'] in ('', 'share')
        for word, factor in (('half', 0.5), ('twice', 2.0)):
            changed = scaled(value, factor, 1.0 if is_share else np.inf)
            if not np.array_equal(np.asarray(changed, object), np.asarray(value, object)):
                variants.append(Variant(f'{path} {word}', {path: changed}))
    return variants


def with_values(method: MethodConstants, values: Values) -> MethodConstants:
    """Return the constants of the method with other values by path."""
    for path, value in values.items():
        method = _with_value(method, path.split('.'), value)
    return method


def _with_value(record: Any, names: List[str], value: Any) -> Any:
    first, rest = names[0], names[1:]
    return replace(record, **{first: _with_value(getattr(record, first), rest, value) if rest else value})


@contextlib.contextmanager
def in_detection(values: Values) -> Iterator[None]:
    """Give the shared constants of detection other values for a time, by path."""
    instances = {**DETECTION, **FOLLOWING}
    before = [(instances[path.rpartition('.')[0]], path.rpartition('.')[2]) for path in values]
    old = [getattr(*place) for place in before]
    try:
        for place, value in zip(before, values.values()):
            object.__setattr__(*place, value)
        yield
    finally:
        for place, value in zip(before, old):
            object.__setattr__(*place, value)


def all_paths(part: str) -> List[Tuple[str, Any]]:
    """Return path, value and metadata of the constants of a part: estimator, floor, detection, following."""
    if part in ('estimator', 'floor'):
        return [(path, value) for path, value in constant_paths(METHOD)
                if path.startswith('track.standing.') == (part == 'floor')]
    instances = DETECTION if part == 'detection' else FOLLOWING
    return [pair for name, record in instances.items() for pair in constant_paths(record, name)]


def of_part(part: str) -> List[Variant]:
    """Return the variants of the constants of a part."""
    return half_and_twice(all_paths(part))

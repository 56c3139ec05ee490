#!/usr/bin/python3
"""Ablation: what constants and parameters are worth, by the figures of scenes with other values.

A constant is named by its module, record and field. Alone, it is set to half and to twice its value, and a record
varies all its constants; NAME=VALUE sets one value. A name without a dot is a parameter of the chain. The chain runs on
each scene as it is and with each variant, while the networks compute each input once. Printed: the figures as they are,
and for each variant those whose paired difference has a 95 % bootstrap interval over scenes without 0.

Arrays and tuples change as a whole; integers are rounded, at least 1, and odd where the value is odd and above 9;
shares and likelihoods (0..1, without a unit) are at most 1. Words in tuples, such as joints, stay.

    ./run bench ablation skeleton_extract_3d.constants.METHOD.head smoothing=false --scenes SCENE ...
    ./run bench ablation openpose_ros_pkg.detect.following.FOLLOWING.fading=0.1 --scenes SCENE ... --budget 0.5
    ./run bench ablation openpose_ros_pkg.detect.existence.EXISTENCE --scenes SEQUENCE ... --virtual
"""
import argparse
import ast
import contextlib
import gc
import importlib
import sys
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from types import FunctionType
from typing import Any, Dict, Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np

import virtual
from chain_runs import CountedNetworks, Finder
from common import Parser, markdown
from openpose_ros_pkg.command_line import run_command, setting_values
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.parameters import build
from scoring.counts import Counts, load
from scoring.figures import Figure, differences, figures, of_sums
from scoring.people import STATISTICS, TABLE, score_people
from skeleton_extract_3d.chain_settings import ChainSettings

FACTORS = {'half': 0.5, 'twice': 2.0}
# Of sequences in virtual time: rate of the camera [Hz], slowness of the machine; figures.
RATE, SLOW = 15.0, 4.0
VIRTUAL = {name: of_sums(name, top, bottom, digits=3 if bottom else 0) for name, top, bottom in (
    ('lost', 'lost', 'plain'), ('ghosts', 'ghosts', 'found'), ('switches', 'switches', ''),
    ('ids kept', 'kept', 'returned'))}


class Variant(NamedTuple):
    """Parameters of the chain that differ, and a record of constants with the one that takes its place."""

    name: str
    parameters: Dict[str, Any]
    record: Any = None
    other: Any = None


def variants_of(parser: argparse.ArgumentParser, text: str) -> List[Variant]:
    """Return the variants that an argument asks for."""
    name, equals, value = text.partition('=')
    if '.' not in name:
        return [Variant(text, setting_values(parser, [text]))]
    root, record, path = record_of(name)
    if equals:
        return [Variant(text, {}, record, changed(record, path, ast.literal_eval(value)))]
    found = []
    for each, before, unit in constants_of(record):
        at_most = 1.0 if isinstance(before, float) and 0 < before <= 1 and unit in ('', 'share') else np.inf
        for how, factor in FACTORS.items() if each[:len(path)] == path else ():
            after = scaled(before, factor, at_most)
            if not np.array_equal(np.asarray(after, object), np.asarray(before, object)):
                found.append(Variant(f"{'.'.join([root, *each])} {how}", {}, record, changed(record, each, after)))
    return found


def record_of(name: str) -> Tuple[str, Any, List[str]]:
    """Return the name of a module's record, the record, and the path of fields in it, that a dotted name means."""
    words = name.split('.')
    for count in range(len(words) - 1, 0, -1):
        with contextlib.suppress(ModuleNotFoundError):
            record = getattr(importlib.import_module('.'.join(words[:count])), words[count])
            return '.'.join(words[:count + 1]), record, words[count + 1:]
    raise BadInputError(f'{name}: there is no such module')


def constants_of(record: Any, path: Sequence[str] = (), unit: str = '') -> List[Tuple[List[str], Any, str]]:
    """Return path, value and unit of each constant in a record of records."""
    if not is_dataclass(record):
        return [([*path], record, unit)]
    return [found for field in fields(record) for found in constants_of(
        getattr(record, field.name), [*path, field.name], field.metadata.get('unit', ''))]


def changed(record: Any, path: Sequence[str], value: Any) -> Any:
    """Return a record with another constant; a number for an array fills it."""
    if not path:
        return np.full_like(record, value) if isinstance(record, np.ndarray) else type(record)(value)
    return replace(record, **{path[0]: changed(getattr(record, path[0]), path[1:], value)})


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


@contextlib.contextmanager
def in_place_of(record: Any, other: Any) -> Iterator[None]:
    """Let modules, and defaults of functions, have another record, and its parts, in place of one."""
    swaps: Dict[int, Any] = {}
    pairs = [(record, other)] if record is not other else []
    while pairs:
        before, after = pairs.pop()
        swaps[id(before)] = after
        pairs += [pair for pair in ((getattr(before, field.name), getattr(after, field.name))
                                    for field in fields(before)) if is_dataclass(pair[0]) and pair[0] is not pair[1]]
    # None stands for a module that must not be imported
    holders = [(module, name, value) for module in list(sys.modules.values()) if module is not None
               for name, value in list(vars(module).items()) if id(value) in swaps]
    functions = [(each, '__defaults__', each.__defaults__) for each in gc.get_objects()
                 if isinstance(each, FunctionType) and any(id(value) in swaps for value in each.__defaults__ or ())]
    try:
        for module, name, value in holders:
            setattr(module, name, swaps[id(value)])
        for function, name, values in functions:
            setattr(function, name, tuple(swaps.get(id(value), value) for value in values))
        yield
    finally:
        for holder, name, value in [*holders, *functions]:
            setattr(holder, name, value)


def count(folder: Path, variant: Variant, networks: CountedNetworks, arguments: argparse.Namespace) -> Counts:
    """Return the counts of a scene."""
    settings = build(ChainSettings, {'threads': 1, **variant.parameters})
    with in_place_of(variant.record, variant.other):
        if arguments.virtual:
            chains = virtual.Chains(settings, networks)
            moments = virtual.passes(virtual.moments_of(folder), RATE, 1)
            played = virtual.play(chains.new(SLOW, 1.0), chains.machine, moments)
            return Counts(folder.name, {}, dict(virtual.counted(moments, played)), {})
        return score_people(folder, Finder(settings, arguments.budget, networks).run(folder).frames)


def count_all(variants: Sequence[Variant], arguments: argparse.Namespace) -> List[List[Counts]]:
    """Return the counts of each variant in each scene; those that are in --out are read."""
    detector = build(ChainSettings, {'threads': 1}).detector
    kind = virtual.VirtualNetworks if arguments.virtual else CountedNetworks
    networks = kind(detector.backend, detector.detector.model_folder, cached=True)
    counts: List[List[Counts]] = [[] for _ in variants]
    for folder in arguments.scenes:
        for own, variant in zip(counts, variants):
            path = arguments.out / folder.name / f'{variant.name}.npz' if arguments.out else None
            own.append(load(path) if path and path.is_file() else count(folder, variant, networks, arguments))
            if path:
                own[-1].save(path)
        networks.forget()
        print(folder, file=sys.stderr, flush=True)
    return counts


def moved(found: Dict[str, Figure], titles: Dict[str, str]) -> str:
    """Return the differences whose interval does not hold 0, as text."""
    return ', '.join(f'{titles.get(name, name)} {figure.value:+.{figure.digits}f} '
                     f'[{figure.low:+.{figure.digits}f}, {figure.high:+.{figure.digits}f}]'
                     for name, figure in found.items() if None not in (figure.low, figure.high)
                     and (figure.low > 0 or figure.high < 0)) or '-'


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('constants', nargs='+', metavar='NAME[=VALUE]', help='what is varied')
    parser.add_argument('--scenes', nargs='+', type=Path, required=True, help='sequence folders')
    parser.add_argument('--budget', type=float, default=0.0, help='search after each frame, with this work per frame')
    parser.add_argument('--virtual', action='store_true', help=f'at {RATE:g} Hz on a virtual clock, slowness {SLOW:g}')
    parser.add_argument('--out', type=Path, help='folder of counts, which are computed once')
    arguments = parser.parse_args()
    variants = [Variant('as it is', {}), *(each for text in arguments.constants for each in variants_of(parser, text))]
    statistics, titles = (VIRTUAL, {}) if arguments.virtual else ({name: STATISTICS[name] for name in TABLE}, TABLE)
    base, *others = count_all(variants, arguments)
    print(markdown([['figure', 'as it is'], *([titles.get(name, name), figure.interval]
                                              for name, figure in figures(base, statistics).items())]))
    print(markdown([['variant', 'figures that change'], *(
        [f'`{variant.name}`', moved(differences(base, counts, statistics), titles)]
        for variant, counts in zip(variants[1:], others))]))
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

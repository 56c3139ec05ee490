#!/usr/bin/python3
"""Ablation of the signals: each constant at half and at twice its value, each condition left out; what moves by how much.

Simulated people (tests/support/simulated_population.py) make gestures and what is nearly one, hold postures, fall, walk,
come back under another id. Sequences with labelled gestures (see chain_runs.py; labels in gt.json) are run through the
chain once; their people are kept in --cache.

    ./run bench ablation signals --people 12 SEQUENCE...
"""
import pickle
import sys
from functools import partial
from pathlib import Path
from typing import Any, Dict, Iterator, List, Sequence, Tuple

import numpy as np

import simulated_actions as actions
from ablation_table import FACTORS, NEAR_FACTORS, changes, names_of, print_base, table, variants
from chain_runs import Finder, camera_poses, open_sequence
from common import Parser
from openpose_ros_pkg.command_line import run_command
from openpose_ros_pkg.params.parameters import build
from openpose_ros_signals.constants import SIGNALS, SignalConstants
from skeleton_extract_3d.chain_settings import ChainSettings

# Conditions that always hold.
ALWAYS = (-1e9, 1.0 - 1e9)
# Which suites the constants of a group can change: all where it is not named.
SUITES = {'posture': ('postures', 'falls', 'scenes'), 'gesture': ('gestures', 'nearly', 'scenes'),
          'swing': ('gestures', 'nearly', 'scenes'), 'pointing': ('scenes',), 'motion': ('falls', 'walks', 'nearly'),
          'floor': ('places',)}


def without(name: str, value: Any) -> Any:
    """Return the value with which a condition always holds; None: the constant is none."""
    return ALWAYS if isinstance(value, tuple) and len(value) == 2 else None


def read_scene(folder: Path, cache: Path) -> Dict[str, Any]:
    """Return the truth of a sequence, and what the chain finds in it."""
    path = cache / f'{folder.resolve().parent.name}_{folder.name}_signals.pickle'
    if not path.is_file():
        source = open_sequence(folder)
        found = Finder(build(ChainSettings, {})).run(source).frames
        cache.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps(actions.scene_of(folder, found, camera_poses(folder, source))))
    return pickle.loads(path.read_bytes())  # noqa: S301  a file of this program


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='*', type=Path, help='sequence folders')
    parser.add_argument('--people', type=int, default=12, help='simulated people of each kind (default: %(default)s)')
    parser.add_argument('--only', default='', help='constants whose dotted names begin like this')
    parser.add_argument('--before', type=Path, help='counts to compare with; the file is written if it is not there')
    parser.add_argument('--suites', nargs='*', default=(), help='these alone')
    parser.add_argument('--near', action='store_true', help='factors 0.8 and 1.25: which constants are fragile')
    parser.add_argument('--cache', type=Path, default=Path('logs/ablation'), help='folder for the people of sequences')
    arguments = parser.parse_args()
    scenes = [read_scene(folder, arguments.cache) for folder in arguments.sequences]
    suites = actions.suites(arguments.people)
    if scenes:
        suites['scenes'] = partial(actions.score_scenes, scenes)
    factors = NEAR_FACTORS if arguments.near else FACTORS
    suites = {name: score for name, score in suites.items() if not arguments.suites or name in arguments.suites}
    base = {suite: score(SIGNALS) for suite, score in suites.items()}
    print_base(base, arguments.before)
    names = [name for name in names_of(SIGNALS) if name.startswith(arguments.only) and not name.startswith('body.')]
    found: Dict[Tuple[str, str], Any] = {}
    for variant in variants(SIGNALS, names, factors, (lambda *_: None) if arguments.near else without):
        run = SUITES.get(variant.name.split('.')[0], tuple(suites))
        found[variant.name, variant.how] = {figure: change for suite in run if suite in suites for figure, change in changes(
            base[suite], suites[suite](variant.constants)).items()}
        print(variant.name, variant.how, {k: tuple(round(float(x), 3) for x in v[:3]) for k, v in found[variant.name, variant.how].items() if v.is_clear},
              file=sys.stderr, flush=True)
    print(table(SIGNALS, found, [*factors, *(() if arguments.near else ('without',))]))
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

#!/usr/bin/python3
"""Ablation of the signals: each constant at half and at twice its value, each condition left out; what moves.

Simulated people (tests/support/simulated_population.py) make gestures and what is nearly one, hold postures, fall,
walk. Sequences (see chain_runs.py; labels of gestures in gt.json) are run through the chain once; their people are kept
in --cache.

    ./run bench ablation signals --people 12 SEQUENCE...
"""
import sys
from functools import partial
from pathlib import Path

from ablation_tools import actions, command
from ablation_tools.changes import counted
from ablation_tools.kept import found_in
from ablation_tools.variants import constant_paths, with_values
from chain_runs import camera_poses, open_sequence
from common import Parser
from openpose_ros_pkg.command_line import run_command
from openpose_ros_signals.constants import SIGNALS

SUITES = {'posture': ('postures', 'falls', 'scenes'), 'gesture': ('gestures', 'nearly', 'scenes'),
          'swing': ('gestures', 'nearly', 'scenes'), 'pointing': ('scenes',), 'motion': ('falls', 'walks', 'nearly'),
          'floor': ('places',), 'body': ()}


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='*', type=Path, help='sequence folders')
    parser.add_argument('--people', type=int, default=12, help='simulated people of each kind (default: %(default)s)')
    command.add_options(parser)
    arguments = parser.parse_args()
    scenes = [actions.scene_of(folder, found_in(folder, arguments.cache)[0],
                               camera_poses(folder, open_sequence(folder))) for folder in arguments.sequences]
    suites = actions.suites(arguments.people)
    if scenes:
        suites['scenes'] = partial(counted, actions.count_scene, scenes)
    command.run(constant_paths(SIGNALS), partial(with_values, SIGNALS), suites, SUITES, arguments)
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

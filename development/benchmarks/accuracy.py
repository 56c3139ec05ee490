#!/usr/bin/python3
"""Measure the 3D chain, without ROS, on RGB-D sequences with known joints (see chain_runs.py).

Prints the figures of each sequence, and of all with their 95 % intervals by bootstrap over sequences (scoring/).
Without sequences: the small ones of this repository. Each frame is searched in full before its people count, as
process_bag does; with --budget, people count before the search, as in the nodes, and the networks may do that much work
per frame, in units of one pass of mobilenet_thin over 656 x 368 pixels; work counts pixels, not time.

    ./run bench accuracy
    ./run bench accuracy SEQUENCE [SEQUENCE ...] --set mode=balanced
    ./run bench accuracy SEQUENCE --exact-2d
    ./run bench accuracy SEQUENCE --set lifting=mean3x3 --set tracking=false   # the original
"""
import sys
from pathlib import Path

import numpy as np

import chain_runs
from common import SCENES, Parser, markdown, scenes_of
from openpose_ros_pkg.command_line import add_settings, run_command, setting_values
from openpose_ros_pkg.params.parameters import build
from scoring.figures import figures_of, rows_of
from scoring.people import STATISTICS, TABLE, score_people
from skeleton_extract_3d.chain_settings import ChainSettings


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='*', type=Path, help='sequence folders')
    parser.add_argument('--exact-2d', action='store_true', help='take the true pixels instead of the detector')
    add_settings(parser, 'of the chain')
    parser.add_argument('--budget', type=float, default=0.0, help='search after each frame, with this work per frame')
    arguments = parser.parse_args()
    folders = arguments.sequences or scenes_of(SCENES)
    settings = build(ChainSettings, setting_values(parser, arguments.settings))
    finder = chain_runs.Finder(settings, arguments.budget, exact=arguments.exact_2d)
    runs = [finder.run(folder) for folder in folders]
    detecting, estimating = 1e3 * np.median([times for run in runs for times in run.times], axis=0)
    work = np.concatenate([run.work for run in runs])
    print(f'median ms per frame: 2D {detecting:.1f}, 3D {estimating:.2f}')
    print(f'work per frame: {work.mean():.2f}, at most {work.max():.2f}')
    counts = [score_people(folder, run.frames) for folder, run in zip(folders, runs)]
    scenes = {f'{number}: {each.scene}': [each] for number, each in enumerate(counts, 1)}
    found = figures_of({**scenes, 'all': counts}, STATISTICS)
    print(markdown(rows_of(found, TABLE, 'scene')),
          'all, with 95 % intervals; of less than five scenes they are hardly more than their range:',
          *(f'{each.text}: {each.interval} {each.unit}'.rstrip() + f', n {each.n}' for each in found['all'].values()),
          sep='\n')
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

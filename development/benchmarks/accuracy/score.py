#!/usr/bin/python3
"""Score people that any software found in RGB-D sequences with known joints, from CSV files.

A file has one row per person and frame, as `rostopic echo -p` writes the per-person 3D message: field.header.stamp
[ns], field.person_ID, and for each joint field.JOINT.x, .y, .z in the optical frame of the camera [m], nan where
missing; optional .confidence, .status (0 MISSING, 1 MEASURED, 2 INFERRED) and .sigma [m]. Joints: nose, neck,
right_shoulder, ... (scoring/csv_people.py). A folder with gt_world.json is scored in the world, with people fused from
several cameras.

    ./run bench accuracy score SEQUENCE people.csv [SEQUENCE people.csv ...]
    ./run bench accuracy score SEQUENCE people.csv --begin 1600000000000000000
"""
import sys
from pathlib import Path

from common import Parser
from openpose_ros_pkg.command_line import run_command
from scoring.csv_people import read_csv
from scoring.figures import figures
from scoring.people import score_people
from scoring.tables import lines_of, table_of_scenes
from scoring.world import STATISTICS, score_world


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('pairs', nargs='+', type=Path, metavar='SEQUENCE CSV', help='folders and what was found there')
    parser.add_argument('--begin', type=int, default=0, help='stamp of the first frame [ns] (default %(default)s)')
    arguments = parser.parse_args()
    if len(arguments.pairs) % 2:
        parser.error('each sequence needs a CSV file')
    pairs = [(folder, read_csv(path, arguments.begin))
             for folder, path in zip(arguments.pairs[::2], arguments.pairs[1::2])]
    worlds = [score_world(*pair) for pair in pairs if (pair[0] / 'gt_world.json').is_file()]
    scenes = [score_people(*pair) for pair in pairs if (pair[0] / 'gt.json').is_file()]
    if scenes:
        print(table_of_scenes(scenes))
    if worlds:
        print(*lines_of(figures(worlds, STATISTICS)), sep='\n')
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

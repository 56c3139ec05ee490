#!/usr/bin/python3
"""Measure the fusion of cameras without depth on MVOR: real people in an operating theatre, three calibrated cameras.

PATH is a folder with camma_mvor_2018.json and openpose_kps.json of https://github.com/CAMMA-public/MVOR, whose licence
is CC BY-NC-SA 4.0. `./run bench report mvor --data mvor=PATH` writes the same into docs/results.md.

    ./run bench mvor PATH
"""
import sys
from pathlib import Path

from common import Parser
from openpose_ros_pkg.command_line import run_command
from results import Options
from sections.mvor import measure


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('path', type=Path, help='folder of the data set')
    print(measure(Options(data={'mvor': parser.parse_args().path})))
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

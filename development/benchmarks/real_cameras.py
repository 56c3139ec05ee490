#!/usr/bin/python3
"""Measure fusion and calibration on four real cameras without depth: the multi-person demo of Pose2Sim.

It is fetched from PyPI, 51 MB, by its checksum, and kept in build/. `./run bench report real_cameras` writes the same
into docs/results.md.

    ./run bench real_cameras
"""
import sys

from common import Parser
from openpose_ros_pkg.command_line import run_command
from results import Options
from sections.real_cameras import measure


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('--quick', action='store_true', help='half a second')
    print(measure(Options(quick=parser.parse_args().quick)))
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

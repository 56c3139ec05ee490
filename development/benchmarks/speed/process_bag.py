#!/usr/bin/python3
"""Measure process_bag: frames per second against the bare network.

The bare network (`Detector.compute` on prepared images) and the whole command on a recording of the same frames take
turns in one process, with the same loaded detector, so that a busy moment hits both alike. The command's time is that
of everything but loading the network. With --jobs, the steady rate of that many processes follows.

    ./run bench speed process_bag --points cloud --set mode=balanced --rounds 5
"""
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import List

from chain_runs import open_sequence
from common import DEMO, Parser
from nodes import NAMESPACE, make_bag
from openpose_ros_pkg.allocator import keep_large_blocks
from openpose_ros_pkg.command_line import add_settings, run_command, setting_values
from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.recipes import DetectorSettings
from openpose_ros_pkg.params.parameters import build
from openpose_ros_tools.ros.process_bag.job import BagJob, CameraTopics
from openpose_ros_tools.ros.process_bag.work import process
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.depth_view import depth_view

# Share of the frames before a steady rate, while processes start.
WARM_UP = 0.25


def steady_rate(job: BagJob) -> float:
    """Return the frames per second of a job after its processes have started."""
    times: List[float] = []
    process(job, lambda done, total: times.append(time.perf_counter()))
    times = times[int(WARM_UP * len(times)):-1]
    return (len(times) - 1) / (times[-1] - times[0])


def main() -> int:
    """Print the rate of the bare network, of the command, and their ratio; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('--sequence', type=Path, default=DEMO, help='sequence folder')
    parser.add_argument('--points', choices=('cloud', 'depth'), default='depth')
    parser.add_argument('--rounds', type=int, default=5, help='(default: %(default)s)')
    parser.add_argument('--jobs', type=int, nargs='*', default=[2], help='numbers of processes (default: 2)')
    add_settings(parser, 'of process_bag')
    options = parser.parse_args()
    values, sequence = setting_values(parser, options.settings), open_sequence(options.sequence)
    topics = CameraTopics(points=f'{NAMESPACE}/points') if options.points == 'cloud' else CameraTopics()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        source = make_bag(options.sequence, folder / 'source.bag', options.points == 'cloud')
        keep_large_blocks()  # as the command does
        detector = create_detector(build(DetectorSettings, values))
        images = [(frame.bgr, depth_view(DepthImage(frame.depth, sequence.camera))) for frame in sequence]
        detector.detect(*images[0])  # compiles the networks
        network, command = [], []
        for _ in range(options.rounds):
            prepared = [detector.prepare(bgr, depth=depth) for bgr, depth in images]
            began = time.perf_counter()
            for frame in prepared:
                detector.compute(frame)
            network.append(len(images) / (time.perf_counter() - began))
            began = time.perf_counter()
            report = process(BagJob(source, folder / 'out.bag', folder / 'out.csv', values=values, topics=topics,
                                    create=lambda _: detector))
            command.append(report.frames / (time.perf_counter() - began))
        ratios = [whole / bare for whole, bare in zip(command, network)]
        print(f'{options.points}, {len(images)} frames, {options.rounds} rounds, {detector.recipe.description}')
        for title, rates in (('bare network [Hz]', network), ('process_bag [Hz]', command), ('ratio', ratios)):
            print(f'{title:18s} {median(rates):7.2f}  ({min(rates):.2f} .. {max(rates):.2f})')
        for jobs in options.jobs:
            rate = steady_rate(BagJob(source, folder / 'jobs.bag', values=values, topics=topics, jobs=jobs))
            print(f'--jobs {jobs} [Hz] {rate:12.2f}, ratio {rate / median(network):.2f}')
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

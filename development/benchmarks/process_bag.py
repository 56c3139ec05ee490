#!/usr/bin/python3
"""Measure process_bag: frames per second against the bare network, peak memory by length, speed-up by workers.

The recording is a sequence folder (the shipped one), repeated as often as it takes, with stamps that go on.

- Throughput: blocks of the bare network (`Detector.compute` on prepared images, all in memory) and of the whole
  command on the same frames take turns in one process, with the same loaded detector, so that a busy moment hits both
  alike. The command's time is that of everything but loading the network: opening the bag, reading, decoding, lifting,
  writing, closing. With --jobs, the steady rate of that many processes follows, from a recording of the same frames.
- Memory: the peak of a process of its own (ru_maxrss), for a recording and for one that is ten times as long.
- Workers: wall time of the command on several bags with one worker and with two, one thread for the networks each,
  with and without the start of the cluster.

    benchmarks/process_bag.py
    benchmarks/process_bag.py --points cloud --set mode=balanced --measure throughput --rounds 5
"""
import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any, Dict, List, Sequence, Tuple

import genpy
import rosbag
from std_msgs.msg import Header

from common import DEMO, ROOT, Parser, errors_end_the_program
from openpose_ros_pkg.allocator import keep_large_blocks
from openpose_ros_pkg.detect.detector import DetectorSettings, create_detector
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.ros.convert import bgr_to_image
from openpose_ros_tools.ros.process_bag.job import BagJob
from openpose_ros_tools.ros.process_bag.work import process
from session import ENDS_WITH_PARENT
from skeleton_extract_3d.points.depth import DepthImage, cloud_from_depth
from skeleton_extract_3d.points.depth_view import depth_view
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence
from skeleton_extract_3d.ros import convert

COMMAND = ROOT / 'openpose_ros_tools' / 'scripts' / 'process_bag'
MEASUREMENTS = ('throughput', 'memory', 'workers')
RATE = 15.0
LONGER = 10
# Frames that are not counted in a steady rate, while processes start.
WARM_UP = 0.25


def write_recording(path: Path, sequence: RgbdSequence, frames: int, points: str) -> Path:
    """Write a bag with the given number of frames, with clouds or depth images."""
    rays = sequence.camera.ray_grid()
    with rosbag.Bag(str(path), 'w') as bag:
        for number in range(frames):
            frame = sequence.frame(number % len(sequence))
            stamp = genpy.Time.from_sec(1000 + number / RATE)
            header = Header(stamp=stamp, frame_id='camera_optical_frame')
            bag.write('/camera/image_color', bgr_to_image(frame.bgr, header), stamp)
            if points == 'cloud':
                cloud = cloud_from_depth(frame.depth * 0.001, sequence.camera, frame.bgr, rays)
                bag.write('/camera/points', convert.cloud_to_message(cloud, header), stamp)
            else:
                bag.write('/camera/camera_info', convert.camera_to_message(sequence.camera, header), stamp)
                bag.write('/camera/image_depth', convert.depth_to_message(frame.depth, header), stamp)
    return path


def throughput(folder: Path, sequence: RgbdSequence, options: argparse.Namespace, values: Dict[str, Any]) -> None:
    """Print the rate of the bare network, of the command, and their ratio."""
    source = write_recording(folder / 'throughput.bag', sequence, options.frames, options.points)
    keep_large_blocks()  # as the command does
    detector = create_detector(build(DetectorSettings, values))
    frames = [sequence.frame(number % len(sequence)) for number in range(options.frames)]
    images = [(frame.bgr, depth_view(DepthImage(frame.depth, sequence.camera))) for frame in frames]
    detector.detect(*images[0])  # compiles the networks
    network, command = [], []
    for _ in range(options.rounds):
        prepared = [detector.prepare(bgr, depth=depth) for bgr, depth in images]
        began = time.perf_counter()
        for frame in prepared:
            detector.compute(frame)
        network.append(len(images) / (time.perf_counter() - began))
        began = time.perf_counter()
        report = process(BagJob(source, folder / 'throughput_out.bag', folder / 'throughput.csv', values=values,
                                create=lambda _: detector))
        command.append(report.frames / (time.perf_counter() - began))
    ratios = [whole / bare for whole, bare in zip(command, network)]
    print(f'{options.points}, {options.frames} frames, {options.rounds} rounds, {detector.recipe.description}')
    print(f'bare network      {median(network):7.2f} frames/s  ({min(network):.2f} .. {max(network):.2f})')
    print(f'process_bag       {median(command):7.2f} frames/s  ({min(command):.2f} .. {max(command):.2f})')
    print(f'ratio             {median(ratios):7.2f}  ({min(ratios):.2f} .. {max(ratios):.2f}), in rounds')
    for jobs in options.jobs:
        rate = steady_rate(BagJob(source, folder / 'jobs_out.bag', values=values, jobs=jobs))
        print(f'--jobs {jobs:<2d}         {rate:7.2f} frames/s, ratio {rate / median(network):.2f}')


def steady_rate(job: BagJob) -> float:
    """Return the frames per second of a job after its processes have started."""
    times: List[float] = []
    process(job, lambda done, total: times.append(time.perf_counter()))
    times = times[int(WARM_UP * len(times)):-1]
    return (len(times) - 1) / (times[-1] - times[0])


def memory(folder: Path, sequence: RgbdSequence, options: argparse.Namespace) -> None:
    """Print the peak memory for a recording and for a longer one."""
    peaks = []
    for frames in (options.frames, LONGER * options.frames):
        source = write_recording(folder / 'memory.bag', sequence, frames, options.points)
        seconds, peak = run_command([str(source), '-o', str(folder / 'memory_out.bag'), '--csv',
                                     str(folder / 'memory.csv'), '--jobs=1', '--overwrite', *settings(options)])
        peaks.append(peak)
        print(f'{frames:6d} frames  {source.stat().st_size / 1e6:8.0f} MB of bag  {peak / 1024:7.0f} MB peak  '
              f'{seconds:6.1f} s')
        source.unlink()
    print(f'{LONGER} times as long: {100 * (peaks[1] / peaks[0] - 1):+.1f} % memory')


def workers(folder: Path, sequence: RgbdSequence, options: argparse.Namespace) -> None:
    """Print the time for several bags with one and with two workers."""
    (folder / 'bags').mkdir()
    first = write_recording(folder / 'bags' / '0.bag', sequence, options.frames, options.points)
    for number in range(1, options.bags):
        os.link(str(first), str(folder / 'bags' / f'{number}.bag'))
    (folder / 'start').mkdir()
    for number in range(2):
        (folder / 'start' / f'{number}.bag').write_bytes(b'')  # no bag: the workers start, the task fails at once
    times: Dict[int, List[float]] = {1: [], 2: []}
    starts: Dict[int, List[float]] = {1: [], 2: []}
    for _ in range(options.rounds):
        for count in times:
            common = [f'--workers={count}', '--overwrite', '--set=threads=1', *settings(options)]
            times[count].append(run_command([str(folder / 'bags'), '-o', str(folder / 'people'), *common])[0])
            starts[count].append(run_command([str(folder / 'start'), '-o', str(folder / 'none'), *common],
                                             expected=1)[0])
    frames = options.bags * options.frames
    for count in times:
        whole, start = median(times[count]), median(starts[count])
        print(f'{count} worker{"s" * (count > 1)}: {options.bags} bags, {frames} frames in {whole:.1f} s '
              f'({frames / whole:.2f} frames/s), of which {start:.1f} s start and end')
    whole = [one / two for one, two in zip(times[1], times[2])]
    net = [(one - median(starts[1])) / (two - median(starts[2])) for one, two in zip(times[1], times[2])]
    print(f'speed-up 1 -> 2 workers: {median(whole):.2f}; without start and end {median(net):.2f}')


def settings(options: argparse.Namespace) -> List[str]:
    """Return the parameters as arguments."""
    return [f'--set={setting}' for setting in options.set]


def run_command(arguments: Sequence[str], expected: int = 0) -> Tuple[float, int]:
    """Run the command as a process; return its wall time [s] and peak memory [kB]."""
    began = time.perf_counter()
    command = subprocess.Popen([*ENDS_WITH_PARENT, sys.executable, str(COMMAND), *arguments],
                               stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(command.pid, 0)
    seconds = time.perf_counter() - began
    if os.WEXITSTATUS(status) != expected:
        sys.exit(f'process_bag ended with status {os.WEXITSTATUS(status)}')
    return seconds, usage.ru_maxrss


def main() -> None:
    """Measure what is asked for."""
    parser = Parser(__doc__)
    parser.add_argument('--measure', nargs='+', choices=MEASUREMENTS, default=MEASUREMENTS)
    parser.add_argument('--sequence', type=Path, default=DEMO, help='sequence folder')
    parser.add_argument('--points', choices=('cloud', 'depth'), default='depth')
    parser.add_argument('--frames', type=int, default=20, help='of a recording (default: %(default)s)')
    parser.add_argument('--rounds', type=int, default=5, help='(default: %(default)s)')
    parser.add_argument('--jobs', type=int, nargs='*', default=[2], help='numbers of processes (default: 2)')
    parser.add_argument('--bags', type=int, default=4, help='for the workers (default: %(default)s)')
    parser.add_settings('of process_bag')
    options = parser.parse_args()
    values = parser.settings(options.set)
    sequence = RgbdSequence.read(options.sequence)
    with errors_end_the_program(), tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if 'throughput' in options.measure:
            throughput(folder, sequence, options, values)
        if 'memory' in options.measure:
            memory(folder, sequence, options)
        if 'workers' in options.measure:
            workers(folder, sequence, options)


if __name__ == '__main__':
    main()

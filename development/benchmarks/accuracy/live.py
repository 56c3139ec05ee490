#!/usr/bin/python3
"""Measure how accurate the running nodes are: play sequences with known joints, and score the 3D results.

A camera driver plays one sequence after the other into the launched chain, each once and with a frame_id of its own,
with stamps of the moment of publishing. The first one of each size of image is played before, under another frame_id,
until results come. At another rate than that of the recording, everything moves faster or slower.

The 3D messages are scored as those of `accuracy 3d`, with the times of the sequence; --out writes them as CSV. A frame
without a result counts as one in which no person was found.

    ./run bench accuracy live SEQUENCE ... --rate 30 --points point_cloud target_rate:=30
"""
import argparse
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict, List, Tuple

import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray

from chain_runs import Frames, name_of, open_sequence
from common import Parser, markdown, new_path, run_live
from nodes import PEOPLE_3D, TOPICS, make_bag, median_and_95, played_stamps, start_camera
from results.machine import Unit
from scoring.counts import Counts
from scoring.csv_people import write_csv
from scoring.people import score_people
from scoring.tables import table_of_scenes
from session import Session, wait_for
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.ros.convert import people_from_array

START_TIMEOUT = 120.0
# Results before the first sequence, so that the first measured frame is one like the others.
LEAD_IN = 30
# Maximum time to wait for the result of the last frame [s].
LAST_RESULT = 2.0


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders')
    parser.add_argument('--rate', type=float, default=15.0, help='frames per second (default %(default)s)')
    parser.add_argument('--points', choices=TOPICS, default='depth_image', help='(default %(default)s)')
    parser.add_argument('--out', type=new_path, help='folder for CSV files')
    return parser.parse_live()


class Player:
    """Plays sequences into the running chain, one after the other.

    Args:
        folder: for logs and bags.
    """

    def __init__(self, session: Session, folder: Path, arguments: argparse.Namespace) -> None:
        self._session, self._folder = session, folder
        self._rate, self._points = arguments.rate, arguments.points
        self._results: Dict[int, Tuple[People3D, float]] = {}  # by stamp [ns]: people, and latency [s]
        self.nodes = session.start('nodes', ['roslaunch', 'skeleton_extract_3d', 'openpose_skeleton_extract.launch',
                                             f'points_source:={self._points}', *arguments.launch])
        rospy.Subscriber(PEOPLE_3D, PersonDetection_3dArray, self._keep, queue_size=100)

    def _keep(self, message: PersonDetection_3dArray) -> None:
        latency = (rospy.get_rostime() - message.header.stamp).to_sec()
        self._results[message.header.stamp.to_nsec()] = (people_from_array(message), latency)

    def _start(self, sequence: Path, **parameters: object) -> Tuple['subprocess.Popen[bytes]', Path]:
        bag = self._folder / f'{name_of(sequence)}.bag'
        if not bag.is_file():
            make_bag(sequence, bag, self._points == 'point_cloud')
        return start_camera(self._session, bag, self._rate, topics=TOPICS[self._points],
                            **parameters), bag.with_suffix('.txt')

    def lead_in(self, sequence: Path) -> None:
        """Play a sequence again and again until results come."""
        before, (camera, _) = len(self._results), self._start(sequence, frame_id='lead_in')
        wait_for(lambda: len(self._results) - before >= LEAD_IN, START_TIMEOUT, 'first results', self.nodes)
        self._session.stop(camera)

    def play(self, sequence: Path) -> Tuple[Frames, List[float]]:
        """Play a sequence once; return the frames with a result, with their times in it, and their latencies [s]."""
        source = open_sequence(sequence)
        count, (camera, log) = len(source), self._start(sequence, frame_id=name_of(sequence), once=True)
        wait_for(lambda: len(played_stamps(log)) == count, START_TIMEOUT + count / self._rate, 'end of the sequence',
                 self.nodes)
        stamps, deadline = played_stamps(log), time.monotonic() + LAST_RESULT
        wait_for(lambda: stamps[-1] in self._results or time.monotonic() > deadline, 2 * LAST_RESULT, 'last result',
                 self.nodes)
        self._session.stop(camera)
        found = [(number / source.fps, *self._results[stamp]) for number, stamp in enumerate(stamps)
                 if stamp in self._results]
        return [(seconds, people) for seconds, people, _ in found], [latency for *_, latency in found]


def play_all(session: Session, folder: Path, arguments: argparse.Namespace
             ) -> Tuple[List[Counts], List[List[float]]]:
    """Play everything; return the counts and the latencies [s] of each sequence."""
    counts, latencies = [], []
    rospy.init_node('accuracy_live', disable_signals=True)
    player, size = Player(session, folder, arguments), None
    for sequence in arguments.sequences:
        camera = open_sequence(sequence).camera
        if (camera.width, camera.height) != size:  # networks are compiled for each size of image
            player.lead_in(sequence)
            size = (camera.width, camera.height)
        frames, late = player.play(sequence)
        latencies.append(late)
        counts.append(score_people(sequence, frames))
        if arguments.out:
            arguments.out.mkdir(parents=True, exist_ok=True)
            write_csv(arguments.out / f'{name_of(sequence)}.csv', frames)
    session.stop(player.nodes)
    return counts, latencies


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> List[str]:
    """Play everything, print the tables."""
    unit = Unit()
    before = unit.milliseconds()
    counts, latencies = play_all(session, folder, arguments)
    rows: List[List[object]] = [['sequence', 'frames played', 'answered', 'latency median / 95 % [ms]'],
                                *([each.scene, int(each.sums['frames']), len(late), median_and_95(late)]
                                  for each, late in zip(counts, latencies))]
    log = (folder / 'nodes.log').read_text(errors='replace').splitlines()
    print(f'{markdown(rows)}\nT: {before:.0f} - {unit.milliseconds():.0f} ms',
          *(line for line in log if 'networks may take' in line or 'WARN' in line or 'ERROR' in line), sep='\n')
    print(table_of_scenes(counts))
    return []


if __name__ == '__main__':
    sys.exit(run_live(measure, parse_arguments()))

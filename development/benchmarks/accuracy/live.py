#!/usr/bin/python3
"""Measure how accurate the running nodes are: play sequences with known joints, and score the 3D results.

Starts the 3D chain by roslaunch on a ROS master of its own. A camera driver in C++ plays one sequence after the other,
each once and with a frame_id of its own; its stamps are those of the moment of publishing. The first sequence is played
before, under another frame_id, until results come, so that networks and connections are there. A sequence begins when
the chain has subscribed to every topic, and ends with the result of its last frame, or when that does not come. At
another rate than that of the recording, everything moves faster or slower.

The 3D messages are written as CSV as `rostopic echo -p` writes them, with the times of the sequence. --evaluate scores
them, and beside them the joints of the same images without ROS, in full (`accuracy_3d`).

    ./run bench accuracy_live SEQUENCE ... --evaluate evaluate.py target_rate:=15
    ./run bench accuracy_live SEQUENCE ... --evaluate evaluate.py --rate 30 --points point_cloud target_rate:=30
"""
import argparse
import sys
import time
from pathlib import Path
from typing import Dict, List, Tuple

import rospy
from accuracy_3d import ChainSettings, Finder, open_sequence, run_chain, write_csv
from live.camera import TOPICS, Unit, make_bag, played_stamps, start_camera
from live.figures import SCORE_COLUMNS, Answers, misordered, score, score_row
from openpose_ros_msgs.msg import PersonDetection_3dArray

from common import Figures, Parser, markdown, new_path, run_live
from openpose_ros_pkg.params.parameters import build
from session import Session, wait_for
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.ros.convert import people_from_array

TOPIC = '/openpose_ros/skeleton_3d/detected_poses_3d'
START_TIMEOUT = 120.0
# Results before the first sequence, so that the first measured frame is one like the others.
LEAD_IN = 30
# A result that has not come this long after the last frame was played never will [s].
LAST_RESULT = 2.0


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders')
    parser.add_argument('--rate', type=float, default=15.0, help='frames per second (default %(default)s)')
    parser.add_argument('--points', choices=TOPICS, default='depth_image', help='(default %(default)s)')
    parser.add_argument('--evaluate', type=Path, help='script that scores pairs of sequence folder and CSV')
    parser.add_argument('--t0', type=int, default=0, help='stamp of the first frames in the CSV [ns] (default 0)')
    parser.add_settings('of the chain without ROS (default: mode=balanced)', '--offline')
    parser.add_argument('--no-offline', action='store_true', help='only the running nodes')
    parser.add_argument('--out', type=new_path, help='folder for the CSV files (default: a temporary one)')
    parser.add_argument('--json', type=new_path, help='write the figures here')
    arguments = parser.parse_named('launch')
    arguments.sequences = [path.resolve() for path in arguments.sequences]
    arguments.offline = parser.settings(arguments.offline or ['mode=balanced'])
    return arguments


class Recorder:
    """Keeps the people of each frame that comes, by stamp [ns], and its latency [s], in the order of arrival."""

    def __init__(self) -> None:
        self.answers: Dict[int, Tuple[People3D, float]] = {}
        self._subscriber = rospy.Subscriber(TOPIC, PersonDetection_3dArray, self._keep, queue_size=100)

    def _keep(self, message: PersonDetection_3dArray) -> None:
        latency = (rospy.get_rostime() - message.header.stamp).to_sec()
        self.answers[message.header.stamp.to_nsec()] = (people_from_array(message), latency)


class Player:
    """Plays sequences into the running chain, one after the other.

    Args:
        folder: for logs and bags.
    """

    def __init__(self, session: Session, folder: Path, arguments: argparse.Namespace) -> None:
        self._session, self._folder = session, folder
        self._rate, self._points = arguments.rate, arguments.points
        self.nodes = session.start('nodes', ['roslaunch', 'skeleton_extract_3d', 'openpose_skeleton_extract.launch',
                                             f'points_source:={self._points}', *arguments.launch])
        self.recorder = Recorder()

    def lead_in(self, sequence: Path) -> None:
        """Play a sequence again and again until results come."""
        bag = make_bag(sequence, self._folder / 'lead_in.bag', self._points == 'point_cloud')
        camera = start_camera(self._session, bag, self._rate, frame_id='lead_in', topics=TOPICS[self._points])
        wait_for(lambda: len(self.recorder.answers) >= LEAD_IN, START_TIMEOUT, 'first results', self.nodes)
        self._session.stop(camera)

    def play(self, sequence: Path) -> Tuple[List[Tuple[float, People3D]], Answers]:
        """Play a sequence once; return the answered frames with their times in the sequence [s]."""
        fps = open_sequence(sequence).fps
        bag = make_bag(sequence, self._folder / 'sequence.bag', self._points == 'point_cloud')
        count, log = len(open_sequence(sequence)), bag.with_suffix('.txt')
        camera = start_camera(self._session, bag, self._rate, frame_id=name_of(sequence).replace('/', '_'),
                              topics=TOPICS[self._points], once=True)
        wait_for(lambda: len(played_stamps(log)) == count, START_TIMEOUT + count / self._rate, 'end of the sequence',
                 self.nodes)
        stamps, deadline = played_stamps(log), time.monotonic() + LAST_RESULT
        wait_for(lambda: stamps[-1] in self.recorder.answers or time.monotonic() > deadline, 2 * LAST_RESULT,
                 'last result', self.nodes)
        self._session.stop(camera)
        answers = self.recorder.answers
        order = [stamp for stamp in answers if stamp in set(stamps)]
        frames = [(number / fps, answers[stamp][0]) for number, stamp in enumerate(stamps) if stamp in answers]
        return frames, Answers(count, [answers[stamp][1] for stamp in order], misordered(order))


def name_of(sequence: Path) -> str:
    """Return a name that tells sequences apart."""
    return '/'.join(sequence.parts[-2:])


def offline(sequences: List[Path], settings: ChainSettings) -> List[List[Tuple[float, People3D]]]:
    """Return time and people of each frame of the sequences, as `accuracy_3d` finds them."""
    results: List[List[Tuple[float, People3D]]] = []
    finder = Finder(settings, 0.0, 0.0)
    for folder in sequences:
        chain = PeopleChain(finder.stream(), settings.estimator)
        results.append(run_chain(open_sequence(folder), chain, finder).frames)
    return results


def rows_of(way: str, results: List[List[Tuple[float, People3D]]], answers: List[Answers], folder: Path,
            arguments: argparse.Namespace) -> List[List[str]]:
    """Write the CSV files and return the rows of their scores, one a sequence and one of all."""
    pairs = []
    for sequence, frames in zip(arguments.sequences, results):
        path = folder / f"{name_of(sequence).replace('/', '_')}_{way.replace(' ', '_')}.csv"
        write_csv(path, [(seconds + 1e-9 * arguments.t0, people) for seconds, people in frames])
        pairs.append((sequence, path))
    if not arguments.evaluate:
        return []
    names = [name_of(sequence) for sequence in arguments.sequences]
    if len(names) > 1:
        total = answers[0]
        for each in answers[1:]:
            total = total.plus(each)
        names, answers = [*names, 'all'], [*answers, total]
    scores = score(arguments.evaluate, pairs, str(arguments.t0), folder / f'scores_{way}.json')
    return [score_row(name, way, *both) for name, *both in zip(names, scores, answers)]


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> Figures:
    """Run everything; return the figures, and print the table."""
    out = arguments.out or folder
    out.mkdir(parents=True, exist_ok=True)
    rospy.init_node('accuracy_live', disable_signals=True)
    unit = Unit()
    before = unit.milliseconds()
    player = Player(session, folder, arguments)
    player.lead_in(arguments.sequences[0])
    played = [player.play(sequence) for sequence in arguments.sequences]
    session.stop(player.nodes)
    after = unit.milliseconds()
    log = (folder / 'nodes.log').read_text(errors='replace').splitlines()
    answers = [each for _, each in played]
    rows = rows_of('live', [frames for frames, _ in played], answers, out, arguments)
    if not arguments.no_offline:
        results = offline(arguments.sequences, build(ChainSettings, arguments.offline))
        nobody_waits = [Answers(each.played, [float('nan')] * len(frames)) for each, frames in zip(answers, results)]
        rows += rows_of('offline', results, nobody_waits, out, arguments)
    rows.sort(key=lambda row: [name_of(each) for each in arguments.sequences].index(row[0]) if row[0] != 'all' else 999)
    print(markdown([SCORE_COLUMNS, *rows]), flush=True)
    return {'T_ms': [before, after], 'rate': arguments.rate, 'points': arguments.points, 'launch': arguments.launch,
            'log': [line for line in log if 'networks may take' in line or 'WARN' in line or 'ERROR' in line],
            'answers': {name_of(sequence): {'played': each.played, 'answered': len(each.latencies),
                                            'misordered': each.misordered}
                        for sequence, each in zip(arguments.sequences, answers)}, 'rows': rows}


def main() -> int:
    """Run the benchmark; return the exit status."""
    arguments = parse_arguments()
    return run_live(lambda session, folder: measure(session, folder, arguments), arguments.json)


if __name__ == '__main__':
    sys.exit(main())

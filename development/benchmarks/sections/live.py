"""Accuracy of the running nodes."""
import subprocess
import time
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray

from camera_driver import PEOPLE_3D, make_bag, played_stamps, start_camera, worth_reading
from chain_runs import Frames, open_sequence
from common import on_a_master
from results import Options, Section, Table
from scoring.counts import Counts
from scoring.figures import Figure, figures_of, named, rows_of
from scoring.people import SHORT_TABLE, STATISTICS, score_people
from session import Session, wait_for
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.ros.convert import people_from_array

# Frames per second that scenes are played at; 5 Hz: what a machine three times as fast does at 15 Hz.
RATES = (15.0, 5.0)
EVERY = 4
# Results before the first sequence, so that the first measured frame is one like the others.
LEAD_IN = 30
# To wait for the nodes, and at most for the result of the last frame [s].
START_TIMEOUT, LAST_RESULT = 120.0, 2.0


def measure(options: Options) -> Section:
    """Play scenes into the launched chain and score the results."""
    folders = [*options.scenes[:1]] if options.quick else [*options.scenes[::EVERY]]
    arguments = [f'{name}:={value}' for name, value in options.settings.items()]
    played = {f'{rate:g} Hz': on_a_master(play, folders, rate, arguments) for rate in RATES}
    found = figures_of({title: each for title, (each, _) in played.items()}, STATISTICS)
    every, late = {}, [['played at', 'frames', 'answered', 'latency median [ms]', '95 % [ms]']]
    for title, (each, latencies) in played.items():
        name = f"at_{title.split(' ')[0]}"
        every.update(named({name: found[title]}))
        middle, most = 1e3 * np.percentile(latencies, (50, 95))
        every[f'{name}_latency'] = Figure(float(middle), n=len(latencies), unit='ms', digits=0)
        late.append([title, int(sum(one.sums['frames'] for one in each)), len(latencies), f'{middle:.0f}',
                     f'{most:.0f}'])
    return Section('Scenes are played into the launched chain as a camera does, once each; `mode` balanced, depth '
                   'images, people are followed. A frame without a result counts as one in which no person was found.',
                   every, [Table('', rows_of(found, SHORT_TABLE, 'played at')), Table('Latency', late)])


def play(session: Session, folder: Path, sequences: Sequence[Path], rate: float, arguments: Sequence[str]
         ) -> Tuple[List[Counts], List[float]]:
    """Return the counts of each sequence, and the latencies of all frames [s].

    The first sequence of each size of image is played before, under another frame_id, until results come.
    """
    rospy.init_node('accuracy_live', disable_signals=True)
    player = Player(session, folder, rate, arguments)
    counts, latencies, size = [], [], None
    for sequence in sequences:
        camera = open_sequence(sequence).camera
        if (camera.width, camera.height) != size:  # networks are compiled for each size of image
            player.lead_in(sequence)
            size = (camera.width, camera.height)
        frames, late = player.play(sequence)
        latencies += late
        counts.append(score_people(sequence, frames))
    session.stop(player.nodes)
    print(*worth_reading(folder / 'nodes.log'), sep='\n')
    return counts, latencies


class Player:
    """Plays sequences into the running chain, one after the other.

    Args:
        folder: for logs and bags.
        rate: of the camera [Hz]; at another one than that of the recording, everything moves faster or slower.
    """

    def __init__(self, session: Session, folder: Path, rate: float, arguments: Sequence[str]) -> None:
        self._session, self._folder, self._rate = session, folder, rate
        self._results: Dict[int, Tuple[People3D, float]] = {}  # by stamp [ns]: people, and latency [s]
        self.nodes = session.start('nodes', ['roslaunch', 'skeleton_extract_3d', 'openpose_skeleton_extract.launch',
                                             'points_source:=depth_image', f'target_rate:={rate}', *arguments])
        rospy.Subscriber(PEOPLE_3D, PersonDetection_3dArray, self._keep, queue_size=100)

    def _keep(self, message: PersonDetection_3dArray) -> None:
        latency = (rospy.get_rostime() - message.header.stamp).to_sec()
        self._results[message.header.stamp.to_nsec()] = (people_from_array(message), latency)

    def _start(self, sequence: Path, **parameters: Any) -> Tuple['subprocess.Popen[bytes]', Path]:
        bag = self._folder / f'{sequence.resolve().parent.name}_{sequence.name}.bag'
        if not bag.is_file():
            make_bag(sequence, bag)
        camera = start_camera(self._session, bag, self._rate, **parameters)
        return camera, bag.with_suffix('.txt')

    def lead_in(self, sequence: Path) -> None:
        """Play a sequence again and again until results come."""
        before, (camera, _) = len(self._results), self._start(sequence, frame_id='lead_in')
        wait_for(lambda: len(self._results) - before >= LEAD_IN, START_TIMEOUT, 'first results', self.nodes)
        self._session.stop(camera)

    def play(self, sequence: Path) -> Tuple[Frames, List[float]]:
        """Play a sequence once; return the frames with a result, with their times in it, and their latencies [s]."""
        source = open_sequence(sequence)
        count, (camera, log) = len(source), self._start(sequence, frame_id=sequence.name, once=True)
        wait_for(lambda: len(played_stamps(log)) == count, START_TIMEOUT + count / self._rate, 'end of the sequence',
                 self.nodes)
        stamps, deadline = played_stamps(log), time.monotonic() + LAST_RESULT
        wait_for(lambda: stamps[-1] in self._results or time.monotonic() > deadline, 2 * LAST_RESULT, 'last result',
                 self.nodes)
        self._session.stop(camera)
        found = [(number / source.fps, *self._results[stamp]) for number, stamp in enumerate(stamps)
                 if stamp in self._results]
        return [(seconds, people) for seconds, people, _ in found], [latency for *_, latency in found]

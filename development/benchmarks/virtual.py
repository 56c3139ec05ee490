#!/usr/bin/python3
"""Measure the chain in virtual time: visible people lost, people made up, ids, on machines that are slow or busy.

The chain, its networks and its queue of frames are those of the nodes. The clock is not: networks advance it by their
work (pixels), times T, times the slowness of the machine and the load of another program, so that the figures do not
depend on the machine that computes them. T: one pass of mobilenet_thin over 656 x 368 pixels, 50 ms at slowness 1.

lost: person-frames with 6 and more visible joints, of the answered frames, without a report within 0.6 m. ghosts: of
the reports, those of no person. switches: another id without a second out of plain view, or the id of another person.
returned: people after such a second, and how many of them had their id. unreported: longest time in plain view without
a report; frames that were left out count.

    ./run bench virtual SEQUENCE ... --rates 15 30 --slow 1 2 4 --loads 1 4
    ./run bench virtual SEQUENCE --passes 2          # played, 1.5 s of black images, played once more
    ./run bench virtual SEQUENCE --passes 2 --black 20 --light .45 .6 .7   # back after 20 s, in other light
"""
import itertools
import sys
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence

import numpy as np

from chain_runs import BEGIN, WORK, CountedNetworks, camera_poses, open_sequence
from common import DEMO, Parser, markdown
from ground_truth import VISIBLE, true_frames
from openpose_ros_pkg.command_line import add_settings, run_command, setting_values
from openpose_ros_pkg.detect.detection import NextPart
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.stream.frame_loop import FrameQueue, Taken
from scoring.people import found_of, pair
from skeleton_extract_3d.chain import PeopleChain, Result
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.points.depth import DepthImage

# T; the start of a network, and what a frame takes besides networks [s]. A single crop uses the cores less well.
T, START, BESIDES, SINGLE_CROP = 0.05, 0.002, 0.008, 1.5
PERIOD, BUSY = 3.0, 1.4  # the other program computes in the first part of each period [s]
# Visible joints of a person in plain view; time out of it after which another id is no switch [s].
PLAIN, AWAY = 6, 1.0


class Machine:
    """A clock [s] that work advances."""

    now, slow, load = 0.0, 1.0, 1.0

    def clock(self) -> float:
        return self.now

    def work(self, seconds: float) -> None:
        """Compute for some seconds of an idle machine of slowness 1."""
        self.now += seconds * self.slow * (self.load if self.now % PERIOD < BUSY else 1.0)


class VirtualNetworks(CountedNetworks):
    """Networks whose work advances the clock of a machine."""

    machine = Machine()

    def count(self, name: str, images: Sequence[np.ndarray]) -> None:
        pixels = sum(image.shape[0] * image.shape[1] * image.shape[2] for image in images)
        single = name == 'movenet_thunder' and sum(map(len, images)) == 1
        self.machine.work(START + T * WORK[name] * pixels * (SINGLE_CROP if single else 1.0))


class Chains:
    """Makes chains that follow people, with the same networks."""

    def __init__(self, settings: ChainSettings, networks: Optional[CountedNetworks] = None) -> None:
        # with target_rate, the networks would be chosen by the pace of the real machine
        detector = replace(settings.detector.detector, target_rate=0.0)
        self._settings = replace(settings, following=replace(settings.following, following='always'),
                                 detector=replace(settings.detector, detector=detector))
        networks = networks or VirtualNetworks(settings.detector.backend, detector.model_folder)
        self.machine = VirtualNetworks.machine
        self._detector = Detector(self._settings.detector, networks, self._settings.following)

    def new(self, slow: float, load: float) -> PeopleChain:
        """Return a chain on a machine whose clock begins at 0."""
        self.machine.now, self.machine.slow, self.machine.load = 0.0, slow, load
        first = {model: work * T * slow for model, work in WORK.items()}
        detection = NetworkDetection(self._detector, self._settings.following, first, self.machine.clock)
        plan = detection._plan
        detection._plan = replace(plan, pace=replace(plan.pace, fixed=False))  # it follows the load
        return PeopleChain(detection, self._settings.estimator, tracking=self._settings.tracking)


class Moment(NamedTuple):
    """An image, and the people who are there: ids (P,), joints (P, K, 3) [m], whether these are visible (P, K)."""

    frame: Frame
    ids: Sequence[int] = ()
    xyz: np.ndarray = np.zeros((0, 18, 3))
    visible: np.ndarray = np.zeros((0, 18), bool)


class Answer(NamedTuple):
    """What a chain published: the number of the moment, the result, the time since the image came [s]."""

    number: int
    result: Result
    latency: float


def play(chain: PeopleChain, machine: Machine, moments: Sequence[Moment]) -> List[Answer]:
    """Return what a chain publishes while images come at their stamps; it computes as `FrameLoop` lets it."""
    queue, answers, arrivals = FrameQueue(), [], [moment.frame.stamp - BEGIN for moment in moments]
    arrived = 0

    def handle(number: int) -> Iterator[Optional[NextPart]]:
        machine.work(BESIDES)
        result = chain.look(moments[number].frame)
        answers.append(Answer(number, result, machine.now - arrivals[number]))
        yield from chain.search()

    def receive() -> None:
        nonlocal arrived
        while arrived < len(moments) and arrivals[arrived] <= machine.now:
            queue.submit('', Taken(arrived, handle), arrivals[arrived])
            arrived += 1

    while arrived < len(moments) or queue.waits:
        if not queue.waits:
            machine.now = max(machine.now, arrivals[arrived])
            receive()
        taken = queue.take()
        for part in taken.handle(taken.item):
            receive()
            if not queue.goes_on(part, machine.now):
                break
        receive()
    return answers


def counted(moments: Sequence[Moment], answers: Sequence[Answer]) -> Counter:
    """Return the sums of a `Tally`."""
    tally, by_number = Tally(), {answer.number: answer for answer in answers}
    for number, moment in enumerate(moments):
        tally.add(moment, by_number.get(number))
    return tally.sums


def moments_of(folder: Path) -> List[Moment]:
    """Return the frames of a sequence."""
    sequence, poses, moments = open_sequence(folder), camera_poses(folder), []
    moves = (poses != poses[0]).any()
    for one, pose, true in zip(sequence, poses, true_frames(folder)):
        frame = Frame('', BEGIN, one.bgr, DepthImage(one.depth, sequence.camera),
                      tracking_from_points=(pose[:3, :3], pose[:3, 3]) if moves else None)
        moments.append(Moment(frame, true.ids, true.xyz, true.labels == VISIBLE))
    return moments


def passes(moments: Sequence[Moment], rate: float, count: int, seconds: float = 1.5,
           light: Sequence[float] = (1.0, 1.0, 1.0)) -> List[Moment]:
    """Return moments played at a rate [Hz] so many times, with black images for some seconds in between.

    Args:
        light: factors, at most 1, on blue, green and red of the images after the first pass.
    """
    first, points = moments[0].frame, moments[0].frame.points
    black = replace(first, bgr=np.zeros_like(first.bgr),
                    points=DepthImage(np.zeros((points.height, points.width), np.uint16), points.camera))
    again = [one._replace(frame=replace(one.frame, bgr=(one.frame.bgr * light).astype(np.uint8))) for one in moments]
    played = [*moments, *(count - 1) * [*round(seconds * rate) * [Moment(black)], *again]]
    return [one._replace(frame=replace(one.frame, stamp=BEGIN + number / rate)) for number, one in enumerate(played)]


@dataclass
class Person:
    """What is known of a true person."""

    seen: float  # when it was last in plain view [s]
    since: float  # since when it is in plain view without a report [s]
    away: float = 0.0  # longest time out of plain view since the last report [s]
    id: Optional[int] = None  # as last reported


class Tally:
    """Counts what answers tell: `sums`."""

    def __init__(self) -> None:
        self.sums = Counter(lost=0, plain=0, ghosts=0, found=0, switches=0, kept=0, returned=0)
        self._people: Dict[int, Person] = {}
        self._owners: Dict[int, int] = {}  # the last person of each id; 0: none
        self._before = -np.inf  # stamp of the last moment [s]

    def add(self, moment: Moment, answer: Optional[Answer]) -> None:
        """Count a moment; None: it was not answered."""
        sums, now, plain = self.sums, moment.frame.stamp, moment.visible.sum(axis=1) >= PLAIN
        pairs: Dict[int, int] = {}
        if answer is not None:
            found = answer.result.people_3d
            pairs = pair(moment.xyz, moment.visible, found_of(found))
            sums.update(answered=1, found=len(found), ghosts=len(found) - len(pairs), plain=int(plain.sum()),
                        lost=len(set(np.flatnonzero(plain)) - set(pairs)))
            self._owners = {**dict.fromkeys(found.ids.tolist(), 0), **self._owners}
        for row, name in enumerate(moment.ids):
            person = self._people.setdefault(name, Person(now, now))
            if plain[row]:
                person.away = max(person.away, now - person.seen)
                person.since = now if person.seen < self._before else person.since
                person.seen = now
                sums['unreported'] = max(sums['unreported'], now - person.since)
            if row in pairs:
                self._report(name, int(found.ids[pairs[row]]), now)
        self._before = now
        sums.update(frames=1, ids=len(self._owners) - sums['ids'], people=len(self._people) - sums['people'])

    def _report(self, name: int, new: int, now: float) -> None:
        person = self._people[name]
        old, returned = person.id, person.id is not None and person.away >= AWAY
        self.sums.update(returned=returned, kept=returned and old == new)
        self.sums['switches'] += self._owners[new] not in (0, name) or (old not in (None, new) and not returned)
        person.id, person.away, person.since, self._owners[new] = new, 0.0, now, name


TITLES = ['sequence', 'rate [Hz]', 'slow', 'load', 'answered', 'visible', 'lost', 'ghosts', 'switches',
          'returned, kept', 'ids, people', 'unreported [s]', 'latency median / 95 % [T]']


def row_of(name: Sequence[object], sums: Counter, latencies: Sequence[float]) -> List[object]:
    """Return a row of the table; latencies [T]."""
    def share(part: str, whole: str) -> str:
        return f'{sums[part]} ({100 * sums[part] / max(sums[whole], 1):.1f} %)'
    return [*name, f"{sums['answered']} of {sums['frames']}", sums['plain'], share('lost', 'plain'),
            share('ghosts', 'found'), sums['switches'], f"{sums['returned']}, {sums['kept']}",
            f"{sums['ids']}, {sums['people']}", f"{sums['unreported']:.2f}",
            ' / '.join(f'{value:.2f}' for value in np.percentile(latencies, (50, 95)))]


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='*', type=Path, default=[DEMO], help='sequence folders')
    parser.add_argument('--rates', type=float, nargs='+', default=[15.0, 30.0], help='of the camera [Hz]')
    parser.add_argument('--slow', type=float, nargs='+', default=[1.0, 2.0, 4.0], help='slowness of the machine')
    parser.add_argument('--loads', type=float, nargs='+', default=[1.0],
                        help=f'factors on that in the first {BUSY} s of each {PERIOD:g} s')
    parser.add_argument('--passes', type=int, default=1, help='with black images in between')
    parser.add_argument('--black', type=float, default=1.5, help='for so long [s]')
    parser.add_argument('--light', type=float, nargs=3, default=(1.0, 1.0, 1.0),
                        help='factors, at most 1, on blue, green and red after the first pass')
    add_settings(parser, 'of the chain')
    arguments = parser.parse_args()
    chains = Chains(build(ChainSettings, setting_values(parser, arguments.settings)))
    rows, total, every = [], Counter(), []
    for folder in arguments.sequences:
        moments = moments_of(folder)
        for rate, slow, load in itertools.product(arguments.rates, arguments.slow, arguments.loads):
            played = passes(moments, rate, arguments.passes, arguments.black, arguments.light)
            answers = play(chains.new(slow, load), chains.machine, played)
            sums = counted(played, answers)
            latencies = [answer.latency / T / slow for answer in answers]
            rows.append(row_of((folder.resolve().name, f'{rate:g}', f'{slow:g}', f'{load:g}'), sums, latencies))
            print(*rows[-1], sep=' | ', flush=True)
            unreported = max(total['unreported'], sums['unreported'])
            total.update(sums)
            total['unreported'], every = unreported, [*every, *latencies]
    print('\n' + markdown([TITLES, *rows, row_of(('all', '', '', ''), total, every)]))
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

"""What a soak run measures: memory, threads and files of nodes over time, what came of each frame, and the verdict."""
import struct
import threading
import time
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import psutil
import rosbag
from scipy.stats import theilslopes

from openpose_ros_pkg.errors import OpenposeRosError
from session import Diagnostics

# Medians of the age over this many parts of a run make the line whose slope is judged.
AGE_PARTS = 60
# A slope within this share of the median age over the whole run is not called growth.
AGE_GROWTH = 0.1
# Images that may wait for their points when the camera ends.
WAITING = 2


class Sample(NamedTuple):
    """What a process holds at a time [s since the begin]: memory that is its own alone [MB], threads, files."""

    time: float
    memory: float
    threads: int
    files: int


class Sampler:
    """Looks at the processes of nodes every few seconds, in a thread of its own.

    Args:
        find: returns the process of a node, or raises.
        period: [s].

    Attributes:
        samples: of each node.
        lives: number of processes of each node so far.
    """

    def __init__(self, nodes: Sequence[str], find: Callable[[str], psutil.Process], period: float) -> None:
        self._find, self._period, self._began = find, period, time.monotonic()
        self._processes: Dict[str, psutil.Process] = {}
        self.samples: Dict[str, List[Sample]] = {node: [] for node in nodes}
        self.lives = dict.fromkeys(nodes, 0)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def seconds(self) -> float:
        """Time since the begin [s]."""
        return time.monotonic() - self._began

    def stop(self) -> None:
        """Look no more."""
        self._stopped.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._stopped.wait(self._period):
            for node, samples in self.samples.items():
                try:
                    if node not in self._processes:
                        self._processes[node] = self._find(node)
                        self.lives[node] += 1
                    process = self._processes[node]
                    samples.append(Sample(self.seconds, process.memory_full_info().uss / 1e6, process.num_threads(),
                                          process.num_fds()))
                except (OSError, psutil.Error):  # it was killed and is not there again
                    self._processes.pop(node, None)


class Result(NamedTuple):
    """A recorded message.

    Attributes:
        seq, stamp: of its header; [ns].
        received: when the recorder got it [ns].
    """

    seq: int
    stamp: int
    received: int


def recorded(folder: Path) -> Dict[str, List[Result]]:
    """Return what the bags of a folder hold of each topic, messages with a header, in the order of their arrival."""
    results: Dict[str, List[Result]] = {}
    for path in sorted(folder.glob('*.bag')):
        with rosbag.Bag(str(path)) as bag:
            for topic, raw, received in bag.read_messages(raw=True):
                seq, seconds, nanoseconds = struct.unpack_from('<III', raw[1])
                results.setdefault(topic, []).append(
                    Result(seq, seconds * 10**9 + nanoseconds, received.to_nsec()))
    return results


def lost_on_the_way(results: Sequence[Result]) -> int:
    """Return how many messages of one publisher, which never restarted, are missing between those that came."""
    return results[-1].seq - results[0].seq + 1 - len(results) if results else 0


def frame_faults() -> Iterator[str]:
    """Return the counters of faults that cost a frame."""
    kinds = [OpenposeRosError]
    while kinds:
        kind = kinds.pop()
        kinds += kind.__subclasses__()
        if kind.event:
            yield kind.event
    yield 'frame failed'


class Account(NamedTuple):
    """What came of the frames of a camera.

    Attributes:
        played: frames that the camera has published while somebody listened.
        received: that the node counts as images that came, or were lost before it.
        answered: that the node counts as results.
        dropped: that the node counts as not answered, by why.
        unanswered: frames between two answered ones of the same run of the camera, without a result in the bag.
        invented: results with a stamp that no frame had.
    """

    played: int
    received: int
    answered: int
    dropped: Dict[str, int]
    unanswered: int
    invented: int

    def faults(self) -> List[str]:
        """Return what does not add up."""
        dropped = sum(self.dropped.values())
        faults = []
        if not 0 <= self.received - self.answered - dropped <= WAITING:
            faults.append(f'{self.received} frames came, but {self.answered} were answered and {dropped} dropped')
        if self.unanswered > dropped:
            faults.append(f'{self.unanswered} frames have no result, but {dropped} are counted as dropped')
        if self.invented:
            faults.append(f'{self.invented} results have stamps of no frame')
        return faults


def account(diagnostics: Diagnostics, node: str, image_topic: str, runs: Sequence[Sequence[int]],
            results: Sequence[Result]) -> Account:
    """Return what came of the frames of a camera that ran several times.

    Args:
        runs: stamps of the frames of each run [ns].
        results: of these, as recorded.
    """
    lost = f'lost before this node, {image_topic}'
    reasons = [lost, 'frames skipped', 'images without a partner', 'stamp not newer', *sorted(set(frame_faults()))]
    dropped = {reason: diagnostics.count(node, reason) for reason in reasons if diagnostics.count(node, reason)}
    answered = {result.stamp for result in results}
    unanswered = 0
    for stamps in runs:
        known = [number for number, stamp in enumerate(stamps) if stamp in answered]
        unanswered += known[-1] - known[0] + 1 - len(known) if known else 0
    return Account(sum(map(len, runs)), diagnostics.count(node, 'images received') + dropped.get(lost, 0),
                   diagnostics.count(node, 'frames'), dropped, unanswered,
                   len(answered.difference(*runs)))


class Growth(NamedTuple):
    """What a node held at the end of the first part of a run, and at the end of the last one.

    Attributes:
        memory: medians [MB].
        threads, files: least numbers, as subscribers come and go.
    """

    memory: Tuple[float, float]
    threads: Tuple[int, int]
    files: Tuple[int, int]

    def faults(self, node: str, factor: float, megabytes: float, more: int) -> List[str]:
        """Return what grew: the memory to more than a factor of it and this, threads or files by more than a number."""
        faults = []
        if self.memory[1] > factor * self.memory[0] + megabytes:
            faults.append(f'{node}: memory grew from {self.memory[0]:.1f} to {self.memory[1]:.1f} MB')
        for what, (first, last) in (('threads', self.threads), ('files', self.files)):
            if last > first + more:
                faults.append(f'{node}: from {first} to {last} {what}')
        return faults


def growth(samples: Sequence[Sample], windows: Sequence[Tuple[float, float]]) -> Optional[Growth]:
    """Return what changed between two windows [s]; None where there are no samples."""
    parts = [[sample for sample in samples if begin <= sample.time <= end] for begin, end in windows]
    if not all(parts):
        return None
    first, last = parts
    return Growth((float(np.median([each.memory for each in first])), float(np.median([each.memory for each in last]))),
                  (min(each.threads for each in first), min(each.threads for each in last)),
                  (min(each.files for each in first), min(each.files for each in last)))


class Age(NamedTuple):
    """Latency of results, from the stamp of the camera to the recorder.

    Attributes:
        median, percentile_95, worst: [s].
        slope: per hour, with the limits of its confidence interval of 95 % [s/h].
        parts: middle of each part of the run [s since its begin], its median and its greatest latency [s].
    """

    median: float
    percentile_95: float
    worst: float
    slope: Tuple[float, float, float]
    parts: Tuple[Tuple[float, float, float], ...]

    def faults(self) -> List[str]:
        """Tell whether it grew, beyond doubt and by more than AGE_GROWTH of it over the run."""
        hours = (self.parts[-1][0] - self.parts[0][0]) / 3600
        if self.slope[1] * hours <= AGE_GROWTH * self.median:
            return []
        return [f'the age grows by at least {1000 * self.slope[1]:.1f} ms per hour']


def age(results: Sequence[Result], begin: int, end: int) -> Age:
    """Return the latency of the results that came between two times [ns]."""
    times = np.array([result.received for result in results], np.float64)
    ages = np.array([result.received - result.stamp for result in results]) / 1e9
    edges = np.linspace(begin, end, AGE_PARTS + 1)
    parts = []
    for first, last in zip(edges, edges[1:]):
        own = ages[(times >= first) & (times < last)]
        if len(own):
            parts.append((float((first + last) / 2 - begin) / 1e9, float(np.median(own)), float(own.max())))
    slope, _, low, high = theilslopes([part[1] for part in parts], [part[0] / 3600 for part in parts], 0.95)
    median, high_age = np.percentile(ages, (50, 95))
    return Age(float(median), float(high_age), float(ages.max()), (float(slope), float(low), float(high)), tuple(parts))


def draw(path: Path, samples: Mapping[str, Sequence[Sample]], latency: Age) -> None:
    """Draw memory, threads, files and latency over time."""
    import matplotlib as mpl
    mpl.use('Agg')
    from matplotlib import pyplot as plt
    figure, axes = plt.subplots(3, 1, sharex=True, figsize=(8, 8))
    for node, each in samples.items():
        minutes = [sample.time / 60 for sample in each]
        axes[0].plot(minutes, [sample.memory for sample in each], '.', markersize=2, label=node)
        line, = axes[1].plot(minutes, [sample.threads for sample in each], linewidth=0.8, label=f'{node}: threads')
        axes[1].plot(minutes, [sample.files for sample in each], ':', linewidth=0.8, color=line.get_color(),
                     label=f'{node}: files')
    minutes = [part[0] / 60 for part in latency.parts]
    axes[2].plot(minutes, [1000 * part[1] for part in latency.parts], label='median')
    axes[2].plot(minutes, [1000 * part[2] for part in latency.parts], '.', label='greatest')
    for axis, label in zip(axes, ('memory of its own [MB]', 'threads, files', 'age of results [ms]')):
        axis.set_ylabel(label)
        axis.set_ylim(bottom=0)
        axis.legend(fontsize=6, loc='lower right')
    axes[2].set_xlabel('time [min]')
    figure.tight_layout()
    figure.savefig(str(path), dpi=80)
    plt.close(figure)

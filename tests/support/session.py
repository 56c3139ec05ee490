"""Run nodes on a ROS master of one's own and watch what they publish: for demo, benchmarks and tests."""
import os
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time
from collections import defaultdict
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import Any, Callable, DefaultDict, Dict, List, NamedTuple, Optional, Sequence, Type, Union
from xmlrpc.client import ServerProxy

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray

from openpose_ros_pkg.command_line import all_ends_are_interrupts
from openpose_ros_pkg.errors import OpenposeRosError

PATIENCE = 60.0
"""Time for what takes a few seconds on a machine that is not busy [s]."""

ENDS_WITH_PARENT = ('setpriv', '--pdeathsig', 'TERM', '--')
"""Before a command: it gets SIGTERM when the thread that starts it has ended, even if that was killed."""

# A child has this long to end after each of these signals [s].
_STOPPING = ((signal.SIGINT, 20.0), (signal.SIGTERM, 5.0), (signal.SIGKILL, 5.0))
_MASTER_TIMEOUT = 30.0
# Of a status in /diagnostics, by its number.
_LEVELS = ('OK', 'WARN', 'ERROR', 'STALE')


class SessionError(OpenposeRosError):
    """What was waited for did not come; the text says what."""


class Session:
    """A ROS master on a free port and child processes, which log to <name>.log in a folder; all end on leaving.

    Within it, SIGTERM and SIGHUP are interrupts, as Ctrl-C is. Sets the ROS variables of this process.
    """

    def __init__(self, log_folder: Path) -> None:
        self._log_folder = log_folder
        self._children: List[subprocess.Popen] = []
        self._logs: Dict[int, Path] = {}

    def __enter__(self) -> 'Session':
        self._log_folder.mkdir(parents=True, exist_ok=True)
        with socket.socket() as probe:
            probe.bind(('localhost', 0))
            port = probe.getsockname()[1]
        with ExitStack() as stack:
            stack.enter_context(all_ends_are_interrupts())
            ros_home = tempfile.mkdtemp(prefix='openpose_ros_')
            stack.callback(shutil.rmtree, ros_home, ignore_errors=True)
            stack.callback(self._stop_all)
            os.environ.update(ROS_MASTER_URI=f'http://localhost:{port}', ROS_HOSTNAME='localhost',
                              ROS_HOME=ros_home, ROS_LOG_DIR=str(Path(ros_home) / 'log'))
            master = self.start('roscore', ['roscore', '-p', str(port)])
            wait_for(_is_master_online, _MASTER_TIMEOUT, 'ROS master', master)
            self._leaving = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._leaving.close()

    def _stop_all(self) -> None:
        for child in reversed(self._children.copy()):
            self.stop(child)

    def start(self, name: str, command: List[str], stdout: Optional[Path] = None) -> subprocess.Popen:
        """Start a command in a process group of its own; its output goes to `stdout` or to its log."""
        path = self._log_folder / f'{name}.log'
        with ExitStack() as files:
            log = files.enter_context(path.open('w'))
            out = files.enter_context(stdout.open('w')) if stdout else log
            child = subprocess.Popen([*ENDS_WITH_PARENT, *command], stdin=subprocess.DEVNULL, stdout=out, stderr=log,
                                     start_new_session=True)
        self._children.append(child)
        self._logs[child.pid] = path
        return child

    def log(self, child: subprocess.Popen) -> str:
        """Return what a child said so far."""
        return self._logs[child.pid].read_text(errors='replace')

    def stop(self, child: subprocess.Popen) -> None:
        """Interrupt a child as Ctrl-C would and wait for it; kill what does not listen."""
        for sign, patience in _STOPPING:
            if child.poll() is not None:
                break
            os.killpg(child.pid, sign)
            try:
                child.wait(patience)
            except subprocess.TimeoutExpired:
                continue
        if child in self._children:
            self._children.remove(child)


def _is_master_online() -> bool:
    """Return whether the master answers, as `rosgraph.is_master_online` does, which takes an interrupt for a no."""
    try:
        rosgraph.Master('/session').getPid()
    except Exception:
        return False
    return True


def wait_for(condition: Callable[[], bool], timeout: float, what: str, watched: subprocess.Popen) -> None:
    """Wait until condition() holds; SessionError: it does not within a time [s], or the watched child has ended."""
    deadline = time.monotonic() + timeout
    while not condition():
        if watched.poll() is not None:
            raise SessionError(f'the nodes ended before the {what} came')
        if time.monotonic() > deadline:
            raise SessionError(f'no {what} within {timeout:.0f} s')
        time.sleep(0.05)


def await_true(condition: Callable[[], Any], what: Union[str, Callable[[], str]], timeout: float = PATIENCE) -> Any:
    """Return the first true value of condition(); AssertionError with `what` when there is none in time [s]."""
    deadline = time.monotonic() + timeout
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            raise AssertionError(f'not within {timeout:g} s: {what() if callable(what) else what}')
        time.sleep(0.01)


def is_heard(topic: str) -> bool:
    """Tell whether what is published on a topic from now on reaches this process, which has subscribed to it.

    rospy's subscribers count a connection before it is made, so its publishers are asked. No publisher: no.
    """
    name, topic = rospy.get_name(), rospy.resolve_name(topic)
    master = rosgraph.Master(name)
    heard = []
    for publisher in dict(master.getSystemState()[0]).get(topic, []):
        with suppress(OSError, rosgraph.MasterException):
            answer: Any = ServerProxy(master.lookupNode(publisher)).getBusInfo(name)
            # rows of the ROS Slave API: id, who is at the other end, direction, transport, topic, ...
            heard.append(any(row[1:3] == [name, 'o'] and row[4] == topic for row in answer[2]))
    return bool(heard) and all(heard)


class Recorder:
    """Keeps the messages of a topic; ready when its publishers send to here, at once without `connect`."""

    def __init__(self, topic: str, kind: Type[Any], connect: bool = True) -> None:
        self.topic = topic
        self.messages: List[Any] = []
        self._subscriber = rospy.Subscriber(topic, kind, self.messages.append, queue_size=100)
        if connect:
            await_true(lambda: is_heard(topic), f'a publisher of {topic}')

    def wait(self, number: int, stamp: Optional[rospy.Time] = None) -> List[Any]:
        """Return the messages so far, of one stamp if given, as soon as there are so many."""
        def chosen() -> List[Any]:
            return [message for message in self.messages.copy() if stamp is None or message.header.stamp == stamp]
        await_true(lambda: len(chosen()) >= number,
                   lambda: f'{number} messages on {self.topic}, of stamp {stamp}; got {len(chosen())}')
        return chosen()

    def close(self) -> None:
        """Listen no more."""
        self._subscriber.unregister()


class ResultWatch:
    """Counts the results of a chain, array messages with `header` and `persons`, as they arrive."""

    def __init__(self, topic: str, kind: Type[Any]) -> None:
        self.people: List[int] = []  # number in each frame
        self.arrivals: List[float] = []  # time.monotonic() of each frame [s]
        self.latencies: List[float] = []  # from the camera's stamp to here, of each frame [s]
        self._subscriber = rospy.Subscriber(topic, kind, self._count, queue_size=10)

    def _count(self, message: Any) -> None:
        self.latencies.append((rospy.get_rostime() - message.header.stamp).to_sec())
        self.people.append(len(message.persons))
        self.arrivals.append(time.monotonic())

    def stop(self) -> None:
        """Count no more."""
        self._subscriber.unregister()

    @property
    def rate(self) -> float:
        """Results per second since the first one."""
        frames, span = len(self.arrivals), self.arrivals[-1] - self.arrivals[0] if self.arrivals else 0.0
        return (frames - 1) / span if span > 0 else 0.0

    @property
    def latency(self) -> float:
        """Median latency [s]."""
        return sorted(self.latencies)[len(self.latencies) // 2] if self.latencies else float('nan')

    def line(self) -> str:
        """Return what is known in one line."""
        newest = self.people[-1] if self.people else 0
        people = f'{newest} {"person" if newest == 1 else "people"}'
        return (f'{len(self.arrivals):5d} frames  {self.rate:5.1f} Hz  {people}  '
                f'median latency {1000 * self.latency:4.0f} ms')


class Report(NamedTuple):
    """The status of a node in /diagnostics."""

    level: str  # 'OK', 'WARN', 'ERROR' or 'STALE'
    text: str
    values: Dict[str, str]  # counters and what else it shows


class Diagnostics:
    """Keeps the reports of all nodes in /diagnostics, and waits for one of each that is given."""

    def __init__(self, *nodes: str) -> None:
        self._lock = threading.Lock()
        self._reports: DefaultDict[str, List[Report]] = defaultdict(list)
        self._subscriber = rospy.Subscriber('/diagnostics', DiagnosticArray, self._store, queue_size=100)
        for node in nodes:
            await_true(partial(self.reports, node), f'diagnostics of {node}')

    def _store(self, message: DiagnosticArray) -> None:
        with self._lock:
            for status in message.status:
                # the updater writes <node>: <task>; a nodelet's task is its own name
                node = status.name.split(': ')[-1].strip('/')
                level = status.level[0] if isinstance(status.level, bytes) else status.level
                self._reports[node].append(Report(_LEVELS[level], status.message,
                                                  {pair.key: pair.value for pair in status.values}))

    def reports(self, node: str, first: int = 0) -> List[Report]:
        """Return all reports of a node so far, from a number on."""
        with self._lock:
            return self._reports[rospy.resolve_name(node).strip('/')][first:]

    def value(self, node: str, key: str) -> str:
        """Return a value as last reported; empty: there is none."""
        newest = self.reports(node)[-1:]
        return newest[0].values.get(key, '') if newest else ''

    def count(self, node: str, event: str) -> int:
        """Return how often an event happened, as last reported."""
        return int(self.value(node, event) or 0)

    def texts(self, node: str) -> List[str]:
        """Return what a node said so far."""
        return [report.text for report in self.reports(node)]

    def await_count(self, node: str, event: str, at_least: int) -> None:
        """Wait until an event was counted so often."""
        await_true(lambda: self.count(node, event) >= at_least,
                   lambda: f"{node} counts {at_least} times '{event}'; it reports {self.reports(node)[-1:]}")

    def await_text(self, node: str, *words: str) -> None:
        """Wait until a node has said all these words in one text."""
        await_true(lambda: any(all(word in text for word in words) for text in self.texts(node)),
                   lambda: f'{node} says {words}; it said {set(self.texts(node))}')

    def await_event(self, node: str, event: str, at_least: int, words: Sequence[str] = ()) -> None:
        """Wait until an event was counted so often, and a text named it with all these words."""
        self.await_count(node, event, at_least)
        self.await_text(node, event, *words)

    def await_state(self, node: str, text: str) -> None:
        """Wait until a node's newest report has this text."""
        await_true(lambda: self.texts(node)[-1:] == [text],
                   lambda: f'{node} says {text!r}; it said {set(self.texts(node))}')

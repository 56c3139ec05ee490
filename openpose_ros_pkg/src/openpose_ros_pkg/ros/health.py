"""Counters and throttled warnings of a node, on the log and on /diagnostics."""
import threading
import time
import traceback
from collections import Counter, deque
from typing import Callable, Deque, Dict, List, Tuple, TypeVar

import diagnostic_updater
import rospy
from diagnostic_msgs.msg import DiagnosticStatus

from openpose_ros_pkg.errors import BadInputError, OpenposeRosError
from openpose_ros_pkg.ros.threads import repeat
from openpose_ros_pkg.throttle import Throttle

# Time over which the rate is measured and a warning keeps the status at WARN [s].
RECENT = 5.0
# Longest text of a warning [characters].
_LONGEST_TEXT = 1000

_Value = TypeVar('_Value')


class Health:
    """Counts what a node does and its faults; published on /diagnostics once a second.

    `bad_input` names messages that it can not use; `name` is that of its status, empty: of the node.
    """

    def __init__(self, bad_input: str = BadInputError.event, name: str = '') -> None:
        self._bad_input = bad_input
        self._lock = threading.Lock()
        self._counts: Counter = Counter()
        self._throttle = Throttle()
        self._latencies: Deque = deque(maxlen=1000)
        self._values: List[Callable[[], Dict[str, str]]] = []
        self._why_resting: Callable[[], str] = str
        self._lasting_faults: List[Tuple[Callable[[], str], int]] = []
        self._last_warning = ('', -float('inf'))
        self._updater = diagnostic_updater.Updater()
        self._updater.setHardwareID('none')
        self._updater.add((name or rospy.get_name()).strip('/'), self._report)
        repeat(self._update, 'diagnostics', period=1.0)

    def count(self, event: str, number: int = 1) -> None:
        """Count something that is no fault."""
        with self._lock:
            self._counts[event] += number

    def show(self, values: Callable[[], Dict[str, str]]) -> None:
        """Add values to every report."""
        self._values.append(values)

    def explain_rest(self, why: Callable[[], str]) -> None:
        """Say in the status why there are no frames, where `why` returns a text; empty: there should be some."""
        self._why_resting = why

    def show_lasting(self, fault: Callable[[], str], level: int = DiagnosticStatus.WARN) -> None:
        """Keep the status at a level while `fault` returns a text: what is at work is not what was asked for."""
        self._lasting_faults.append((fault, level))

    def frame_done(self, stamp: rospy.Time) -> None:
        """Count a finished frame and its latency, from the stamp of the camera to now."""
        latency = (rospy.get_rostime() - stamp).to_sec()
        with self._lock:
            self._counts['frames'] += 1
            self._latencies.append((time.monotonic(), latency))

    def warn(self, event: str, text: str) -> None:
        """Count a fault and log it, at most once in a time for each kind of event (`Throttle`).

        Texts quote what others sent: they are cut, and characters that control a terminal are replaced.
        """
        text = ''.join(each if each.isprintable() else '?' for each in text[:_LONGEST_TEXT])
        now = time.monotonic()
        with self._lock:
            self._counts[event] += 1
            number = self._counts[event]
            self._last_warning = (f'{event}: {text}', now)
        if self._throttle.is_due(event):
            rospy.logwarn('%s: %s (number %d of this kind)', event, text, number)

    def frame_failed(self, error: Exception) -> None:
        """Count and warn of what ended the work on a frame, which is dropped."""
        if rospy.is_shutdown():
            return  # topics close while a result is on its way
        if isinstance(error, BadInputError):
            self.warn(self._bad_input, str(error))
        elif isinstance(error, OpenposeRosError) and error.event:
            self.warn(error.event, str(error))
        else:
            self.warn('frame failed', f'{traceback.extract_tb(error.__traceback__)[-1:]} {error!r}')

    def _update(self) -> None:
        try:
            self._updater.force_update()
        except Exception as error:  # /diagnostics must not end with one report
            self.warn('report failed', repr(error))

    def _ask(self, ask: Callable[[], _Value], otherwise: _Value) -> _Value:
        """Return what a part of the node says of itself; otherwise, with a warning, where it raises."""
        try:
            return ask()
        except Exception as error:  # one part that can not tell must not hide the others
            self.warn('report failed', f'{getattr(ask, "__qualname__", ask)}: {error!r}')
            return otherwise

    def _report(self, status: diagnostic_updater.DiagnosticStatusWrapper) -> diagnostic_updater.DiagnosticStatusWrapper:
        rest = self._ask(self._why_resting, '')
        lasting_faults = [(self._ask(fault, ''), level) for fault, level in self._lasting_faults]
        shown: List[Dict[str, str]] = [self._ask(values, {}) for values in self._values]
        now = time.monotonic()
        with self._lock:
            counts = dict(self._counts)
            latencies = sorted(latency for when, latency in self._latencies if now - when <= RECENT)
            text, when = self._last_warning
        status.summary(DiagnosticStatus.OK, rest or f'{len(latencies) / RECENT:.1f} Hz')
        if now - when <= RECENT:
            status.mergeSummary(DiagnosticStatus.WARN, text)
        for lasting, level in lasting_faults:
            if lasting:
                status.mergeSummary(level, lasting)
        status.add('rate [Hz]', f'{len(latencies) / RECENT:.1f}')
        if latencies:
            status.add('age of the result, median [s]', f'{latencies[len(latencies) // 2]:.3f}')
        for event, number in sorted(counts.items()):
            status.add(event, str(number))
        for values in shown:
            for key, value in values.items():
                status.add(key, value)
        return status

"""Tell the user which inputs of a node are silent, and why."""
import time
from functools import partial
from typing import Callable, Dict, List, Sequence, Tuple

import rosgraph
import rospy

from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.master.calls import CALL_ERRORS, published_topics
from openpose_ros_pkg.ros.threads import repeat
from openpose_ros_pkg.stream.silent_topic import why_clock_stands, why_silent
from openpose_ros_pkg.throttle import Throttle

PATIENCE = 5.0
"""An input without a message for this long is silent [s], in wall time."""
# Period of the checks; of asking the master again while something is wrong; of telling it again in the log [s].
_PERIOD, _REFRESH_PERIOD, _LOG_PERIOD = 1.0, 5.0, 60.0


class InputWatch:
    """Logs what is wrong with the inputs of a node, seldom, and keeps its status at WARN while it lasts."""

    def __init__(self, health: Health) -> None:
        self._health = health
        self._checks: List[Tuple[str, Callable[[], bool], Callable[[], str]]] = []
        self._faults: Dict[str, str] = {}
        self._refresh, self._log = Throttle(_REFRESH_PERIOD), Throttle(_LOG_PERIOD)
        self._clock = rospy.Time(), time.monotonic()
        health.show_lasting(lambda: '; '.join(f'{event}: {text}' for event, text in list(self._faults.items())))

    def start(self, inputs: Sequence[InputSubscriber]) -> None:
        """Begin to check, in a thread of its own, which inputs that the node needs are silent."""
        for source in inputs:
            if not source.optional:
                self.add(f'no message on {source.resolved_name}', partial(_is_silent, source),
                         partial(self._why_silent, source))
        repeat(self._check, 'input watch', _PERIOD)

    def add(self, event: str, lasts: Callable[[], bool], why: Callable[[], str]) -> None:
        """Check for something else that may be wrong; `why` is asked for only while it `lasts`."""
        self._checks.append((event, lasts, why))

    def _check(self) -> None:
        now = rospy.get_rostime()
        if now != self._clock[0]:
            self._clock = now, time.monotonic()
        wrong = {event: why for event, lasts, why in self._checks if lasts()}
        is_due = bool(wrong) and self._refresh.is_due('')
        faults = {event: why() if is_due or event not in self._faults else self._faults[event]
                  for event, why in wrong.items()}
        for event, text in faults.items():
            if event not in self._faults:
                self._health.count(event)
            if self._log.is_due(event):
                rospy.logwarn('%s: %s', event, text)
        self._faults = faults

    def _why_silent(self, source: InputSubscriber) -> str:
        try:
            topics = published_topics()
            text = why_silent(source.resolved_name, source.kind, topics, source.connected, rospy.get_name())
            if source.start and source.resolved_name not in topics:
                text += f'; to start one: {source.start}'
        except CALL_ERRORS:
            text = f'the ROS master {rosgraph.get_master_uri()} does not answer'
        stamp, since = self._clock
        if not rospy.rostime.is_wallclock() and time.monotonic() - since >= PATIENCE:
            return f'{why_clock_stands(stamp.to_sec())}; {text}'
        return text


def _is_silent(source: InputSubscriber) -> bool:
    return source.silence >= PATIENCE

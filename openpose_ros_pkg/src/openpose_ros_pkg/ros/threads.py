"""Threads of nodes that go on whatever they meet."""
import threading
import time
from typing import Callable

import rospy

from openpose_ros_pkg.throttle import Throttle

_THROTTLE = Throttle()
# After an error [s].
_LEAST_PAUSE = 0.1


def _report(name: str, error: Exception) -> None:
    """Log what a thread met, at most once in a time for each thread (`Throttle`)."""
    if _THROTTLE.is_due(name) and not rospy.is_shutdown():
        rospy.logerr('thread %s: %r; it goes on', name, error)


def repeat(work: Callable[[], object], name: str, period: float = 0.0) -> None:
    """Do something again and again until shutdown, in a thread of its own, whatever it raises.

    Args:
        name: of the thread.
        period: pause in between, in wall time, so that it does not stop with a simulated clock [s].
    """
    def run() -> None:
        while not rospy.is_shutdown():
            try:
                work()
            except Exception as error:  # the thread must outlive it
                _report(name, error)
                time.sleep(_LEAST_PAUSE)  # what raises at once must not take all time
            time.sleep(period)

    threading.Thread(target=run, name=name, daemon=True).start()

"""Threads of nodes that survive errors."""
import time
from typing import Callable

import rospy

from openpose_ros_pkg.stream.worker import Worker
from openpose_ros_pkg.throttle import Throttle

_THROTTLE = Throttle()
# After an error [s]: work that fails at once must not take all of the processor.
_LEAST_PAUSE = 0.1


def repeat(work: Callable[[], object], name: str, period: float = 0.0) -> None:
    """Repeat work in a thread of its own until shutdown; errors are logged, throttled for each thread.

    `period` is a pause in between [s], in wall time, so that it does not stop with a simulated clock.
    """
    def step() -> bool:
        if rospy.is_shutdown():
            return False
        work()
        time.sleep(period)
        return True

    def report(error: Exception) -> None:
        time.sleep(_LEAST_PAUSE + period)
        if _THROTTLE.is_due(name) and not rospy.is_shutdown():
            rospy.logerr('thread %s: %r; it goes on', name, error)

    Worker(name, step, report).start()

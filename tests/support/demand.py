"""What the tests of nodes that work on demand share: their switch, and how soon a subscriber gets a result."""
import time
from typing import Any, Callable, List, Type

import rospy
from std_srvs.srv import SetBool

from session import PATIENCE, Recorder

FIRST_RESULT = 0.3
"""From the subscription to the first result, at most [s]."""
# Other programs may take the processor: the best of some tries counts.
_TRIES = 8


def enable(node: str, whether: bool) -> bool:
    """Enable or disable a node; tell whether it said so."""
    rospy.wait_for_service(f'{node}/enable', PATIENCE)
    answer = rospy.ServiceProxy(f'{node}/enable', SetBool)(whether)
    return answer.success and answer.message == ('enabled' if whether else 'disabled')


def subscribe(topic: str, kind: Type[Any]) -> Recorder:
    """Subscribe as a user does, to what may not be published yet."""
    return Recorder(topic, kind, connect=False)


def seconds_to_first_result(topic: str, kind: Type[Any], assert_idle: Callable[[], None]) -> float:
    """Return the time from a subscription to the first message [s]; nodes are idle before and after each try."""
    seconds: List[float] = []
    assert_idle()
    while len(seconds) < _TRIES and min(seconds, default=PATIENCE) > FIRST_RESULT:
        begin = time.monotonic()
        recorder = subscribe(topic, kind)
        try:
            recorder.wait(1)
            seconds.append(time.monotonic() - begin)
        finally:
            recorder.close()
        assert_idle()
    rospy.loginfo('first of %s after %s s', topic, ', '.join(f'{each:.3f}' for each in seconds))
    return min(seconds)

"""End a node whose ROS master is another one than at its start.

rospy registers once, and what roslaunch had set is gone with the master: a node that went on could not be found, and a
node that started again would have the default parameters.
"""
from typing import NamedTuple, Optional

import rosgraph
import rospy

from openpose_ros_pkg.ros.master.calls import CALL_ERRORS, call_master
from openpose_ros_pkg.ros.threads import repeat

# Period of the check, in wall time: one request of a few milliseconds [s].
PERIOD = 1.0
REPLACED = ('the ROS master was started again: the parameters that roslaunch had set are gone with the one before, so '
            'the launch has to be started again')


class MasterId(NamedTuple):
    """What tells one master from another."""

    pid: int  # number of its process, on its machine
    run_id: str  # what roscore or the first roslaunch has set as /run_id; empty: nothing yet

    def is_other(self, before: 'MasterId') -> bool:
        """Return whether this is another master than one before; in containers, both may have the same pid."""
        return self.pid != before.pid or ('' not in (self.run_id, before.run_id) and self.run_id != before.run_id)


class MasterWatch:
    """Checks that the master is still the one of the start, and shuts the node down when it is not.

    Attributes:
        is_replaced: whether the node was shut down for that.
    """

    def __init__(self) -> None:
        self.is_replaced = False
        self._known: Optional[MasterId] = None
        self._fault = ''

    def start(self) -> None:
        """Begin to check, in a thread of its own that ends with the node."""
        repeat(self._check, 'master watch', PERIOD)

    def fault(self) -> str:
        """Return that the master does not answer; empty: it does."""
        return self._fault

    def _check(self) -> None:
        try:
            now = _master_id()
        except CALL_ERRORS as error:
            fault = f'the ROS master {rosgraph.get_master_uri()} does not answer: {type(error).__name__}'
            if not self._fault:
                rospy.logwarn('%s', fault)
            self._fault = fault
            return
        self._fault = ''
        if self._known is not None and now.is_other(self._known):
            self.is_replaced = True
            rospy.logfatal('%s: %s', rospy.get_name(), REPLACED)
            rospy.signal_shutdown('another ROS master')
        self._known = now


def _master_id() -> MasterId:
    (_, _, pid), (code, _, run_id) = call_master([('getPid',), ('getParam', '/run_id')])
    return MasterId(int(pid), str(run_id) if code == 1 else '')


WATCH = MasterWatch()
"""That of this process, as rospy's node is."""

"""Start a node, and end it with a clear message when its configuration is wrong."""
import logging
import sys
from typing import Any, Callable

import rospy

from openpose_ros_pkg.errors import OpenposeRosError


def run_node(name: str, make: Callable[[], Any]) -> None:
    """Initialise the node, build it and serve until shutdown; exit with 1 when it can not be built.

    Args:
        name: default node name.
        make: builds the node and returns it; raises OpenposeRosError for what the user has to mend.
    """
    rospy.init_node(name)
    # what the core logs reaches /rosout like the node's own messages
    logging.getLogger('openpose_ros_pkg').setLevel(logging.INFO)
    core_log = _RosLogHandler()
    logging.getLogger('openpose_ros_pkg').addHandler(core_log)
    logging.getLogger('skeleton_extract_3d').addHandler(core_log)
    try:
        node = make()
    except OpenposeRosError as error:
        rospy.logfatal('%s: %s', rospy.get_name(), error)
        sys.exit(1)
    rospy.spin()
    del node  # lives until here: its publishers and threads serve while spinning


class _RosLogHandler(logging.Handler):
    """Pass records of the standard logging module on to rospy's log."""

    def emit(self, record: logging.LogRecord) -> None:
        log = {logging.DEBUG: rospy.logdebug, logging.INFO: rospy.loginfo,
               logging.WARNING: rospy.logwarn}.get(record.levelno, rospy.logerr)
        log('%s', record.getMessage())

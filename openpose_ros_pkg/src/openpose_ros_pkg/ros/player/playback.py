"""The thread of a node that plays files: what can not be read is skipped and counted, and the node ends with it."""
import threading
import traceback
from typing import Callable

import rospy

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.throttle import Throttle


class Playback:
    """Plays a source in a thread; the node ends when it is over, or fails.

    Args:
        play: publishes the frames of the source, and tells `skip` of those that can not be read.

    Attributes:
        failed: whether something could not be played: for the exit status, see `run_node`.
    """

    def __init__(self, source: str, play: Callable[[], None]) -> None:
        self.failed = False
        self._source, self._play = source, play
        self._skipped, self._throttle = 0, Throttle()

    def start(self) -> None:
        """Begin."""
        threading.Thread(target=self._run, name='playback', daemon=True).start()

    def skip(self, error: BadInputError) -> None:
        """Count and warn of a frame that can not be read; of each again after a while, where the source is repeated."""
        self.failed = True
        self._skipped += 1
        if self._throttle.is_due(str(error)):
            rospy.logwarn('frame skipped: %s (number %d)', error, self._skipped)

    def _run(self) -> None:
        try:
            self._play()
        except Exception as error:
            if not rospy.is_shutdown():  # topics close while a frame is on its way
                self.failed = True
                rospy.logerr('%s', error if isinstance(error, BadInputError) else traceback.format_exc())
        rospy.loginfo('end of %s%s', self._source, f'; {self._skipped} frames skipped' if self._skipped else '')
        rospy.signal_shutdown('end of the source')

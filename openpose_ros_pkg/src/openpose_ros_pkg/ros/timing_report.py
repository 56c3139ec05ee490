"""Report how long the stages of a node take: on a topic, and as values for /diagnostics."""
import time
from typing import Dict, Iterator, List, Sequence

import rospy
from openpose_ros_msgs.msg import StageTiming as StageTimingMessage
from openpose_ros_msgs.msg import Timing

from openpose_ros_pkg.detect.detection import NextPart
from openpose_ros_pkg.ros.threads import repeat
from openpose_ros_pkg.stream.stage_timing import StageTiming

# How far the report looks back [s].
WINDOW = 10.0
# Stage that the search of the rest of an image takes.
SEARCH_STAGE = 'search'


class TimingReport:
    """Collects durations of `stages`; publishes them once a second to subscribers.

    `result` is the stage that ends once per result: its rate is that of the results.
    """

    def __init__(self, stages: Sequence[str], result: str, topic: str = '~timing') -> None:
        self._timing, self._result = StageTiming(stages, WINDOW), result
        self._publisher = rospy.Publisher(topic, Timing, queue_size=1)
        repeat(self._publish, 'timing', period=1.0)

    def add(self, stage: str, seconds: float) -> None:
        """Note that a stage ended now and took that long [s]."""
        self._timing.add(stage, seconds, time.monotonic())

    def timed_search(self, parts: Iterator[NextPart]) -> Iterator[NextPart]:
        """Yield the parts of a search; add the time that it took, if any part was searched."""
        spent: List[float] = []  # until the first part, and by each part [s]
        try:
            while True:
                begin = time.monotonic()
                part = next(parts, None)
                spent.append(time.monotonic() - begin)
                if part is None:
                    return
                yield part
        finally:
            if len(spent) > 1:
                self.add(SEARCH_STAGE, sum(spent))

    def medians(self) -> Dict[str, str]:
        """Return the median of each stage that occurred, as text."""
        return {f'{summary.stage}, median [ms]': f'{1000 * summary.p50:.2f}'
                for summary in self._timing.summaries(time.monotonic()) if summary.count}

    def _publish(self) -> None:
        if self._publisher.get_num_connections() == 0:
            return
        summaries = self._timing.summaries(time.monotonic())
        message = Timing(window=WINDOW)
        message.header.stamp = rospy.get_rostime()
        message.rate = next(summary.rate for summary in summaries if summary.stage == self._result)
        message.stages = [StageTimingMessage(stage=summary.stage, count=summary.count, p50=1000 * summary.p50,
                                             p95=1000 * summary.p95, mean=1000 * summary.mean) for summary in summaries]
        self._publisher.publish(message)

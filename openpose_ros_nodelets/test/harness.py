"""What the tests of the nodelets share: clouds of known points, recorders, counters, waiting for conditions."""
import threading
import time
from typing import Any, Callable, Dict, List, Sequence

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

import openpose_ros_pkg.ros  # noqa: F401 - with it the rospy of Debian 11 can end a test

FRAME_ID = 'test_optical_frame'
PATIENCE = 60.0  # [s] for what takes a few seconds on a machine that is not busy


def wait_for(condition: Callable[[], Any], what: str, timeout: float = PATIENCE) -> Any:
    """Return the first true value of the condition; fail when there is none in time [s, wall clock]."""
    deadline = time.monotonic() + timeout
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            raise AssertionError(f'not within {timeout:g} s: {what}')
        time.sleep(0.01)


def cloud(xyz: np.ndarray, stamp: rospy.Time, offsets: Sequence[int] = (0, 4, 8), point_step: int = 32,
          padding: int = 0) -> PointCloud2:
    """Return the message of (H, W, 3) float32 points [m].

    Args:
        offsets, point_step: where x, y and z lie in a point, and its size [bytes].
        padding: bytes between the rows.
    """
    height, width = xyz.shape[:2]
    dtype = np.dtype({'names': list('xyz'), 'formats': ['<f4'] * 3, 'offsets': list(offsets), 'itemsize': point_step})
    points = np.zeros((height, width), dtype)
    for i, axis in enumerate('xyz'):
        points[axis] = xyz[..., i]
    rows = np.full((height, width * point_step + padding), 0x5a, np.uint8)
    rows[:, :width * point_step] = points.view(np.uint8).reshape(height, -1)
    fields = [PointField(name=axis, offset=offset, datatype=PointField.FLOAT32, count=1)
              for axis, offset in zip('xyz', offsets)]
    return PointCloud2(header=Header(stamp=stamp, frame_id=FRAME_ID), height=height, width=width, fields=fields,
                       point_step=point_step, row_step=rows.shape[1], data=rows.tobytes())


class Recorder:
    """Keeps the messages of a topic."""

    def __init__(self, topic: str, kind: Any) -> None:
        self.messages: List[Any] = []
        self._subscriber = rospy.Subscriber(topic, kind, self.messages.append, queue_size=100)

    def at(self, stamp: rospy.Time) -> Any:
        """Wait for the message with this stamp and return it."""
        return wait_for(lambda: next((each for each in list(self.messages) if each.header.stamp == stamp), None),
                        f'message of {self._subscriber.resolved_name} with stamp {stamp.to_sec():.3f}')

    def stop(self) -> None:
        """Listen no more."""
        self._subscriber.unregister()


class Counters:
    """Keeps the newest counters and every text of each nodelet from /diagnostics."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._values: Dict[str, Dict[str, str]] = {}
        self._texts: Dict[str, List[str]] = {}
        self._subscriber = rospy.Subscriber('/diagnostics', DiagnosticArray, self._store)

    def _store(self, message: DiagnosticArray) -> None:
        with self._lock:
            for status in message.status:
                name = status.name.split(': ')[-1]
                self._values[name] = {pair.key: pair.value for pair in status.values}
                self._texts.setdefault(name, []).append(status.message)

    def value(self, name: str, key: str) -> str:
        """Return the value as last reported, '' without any."""
        with self._lock:
            return self._values.get(name, {}).get(key, '')

    def await_event(self, name: str, event: str, at_least: int, words: Sequence[str] = ()) -> None:
        """Wait until an event was counted, and a text named it with all these words."""
        wait_for(lambda: int(self.value(name, event) or 0) >= at_least,
                 f"{name} counts {at_least} times '{event}'; it says {self._values.get(name)}")
        wait_for(lambda: any(all(word in text for word in (event, *words)) for text in self.said(name)),
                 f"{name} says '{event}' with {words}; it said {set(self.said(name))}")

    def said(self, name: str) -> List[str]:
        """Return all texts of a nodelet."""
        with self._lock:
            return list(self._texts.get(name, []))

"""The floor as a node publishes it, for people on it."""
from typing import Optional

import numpy as np
from pcl_msgs.msg import ModelCoefficients
from std_msgs.msg import Header

from openpose_ros_pkg.ros.images import InputSubscriber

# A plane that is older than this, by the stamps, is not used [s].
GREATEST_AGE = 2.0


class FloorInput:
    """Keeps the newest plane on a topic.

    Attributes:
        input: its subscriber.
    """

    def __init__(self, topic: str = '~floor') -> None:
        self._newest: Optional[ModelCoefficients] = None
        self.input = InputSubscriber(topic, ModelCoefficients)
        self.input.registerCallback(self._store)

    def at(self, header: Header) -> Optional[np.ndarray]:
        """Return the floor in the frame and at the time of a message, see `Frame`; None: it is not known."""
        plane = self._newest
        if plane is None or plane.header.frame_id != header.frame_id or len(plane.values) != 4:
            return None
        if abs((header.stamp - plane.header.stamp).to_sec()) > GREATEST_AGE:
            return None
        values = np.array(plane.values, np.float64)
        length = float(np.linalg.norm(values[:3]))
        return values / length if length > 0 and np.isfinite([*values, length]).all() else None

    def _store(self, message: ModelCoefficients) -> None:
        self._newest = message

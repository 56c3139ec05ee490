"""Who finds the people in an image for the extractor: a service, or networks of this process."""
from typing import Any, List, Optional, Protocol

import numpy as np
from openpose_ros_msgs.msg import PersonDetection
from sensor_msgs.msg import Image

from openpose_ros_pkg.detect.detection import DepthView
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros.client.service_client import REQUEST_LEAD, Call, DetectionClient
from openpose_ros_pkg.stream.fair_lock import FairLock


class Finder(Protocol):
    """Finds people in three steps, each for one thread, so that those of successive images overlap: see `Pipeline`.

    `DetectionService` is one.

    Attributes:
        name: of the service that answers, or that this process has for others.
        lock: to be held during `compute`.
        lead: see `Pipeline`.
    """

    name: str
    lead: float

    @property
    def lock(self) -> FairLock:
        """See above."""

    def prepare(self, image: Image, bgr: np.ndarray, depth: Optional[DepthView] = None) -> Any:
        """Take an image; `bgr` is the same, (H, W, 3) uint8; None: its depth is not known."""

    def compute(self, prepared: Any, expected: Optional[People2D]) -> Any:
        """Find the people.

        Args:
            expected: where people who are followed in space will be in the image; None: nobody is.

        Returns:
            For `finish`; `network_seconds` is the time that the networks took [s], None where that is not known.
        """

    def finish(self, computed: Any) -> List[PersonDetection]:
        """Return the people [px of the image]."""


class _Answer:
    """What a service answered."""

    network_seconds = None

    def __init__(self, detections: List[PersonDetection]) -> None:
        self.detections = detections


class ServiceFinder:
    """Lets a detection service find the people: the next image is on its way while one is computed.

    `compute` and `finish` raise ServiceCallError, see `DetectionClient`.
    """

    lead = REQUEST_LEAD

    def __init__(self, client: DetectionClient) -> None:
        self._client = client
        self.name, self.lock = client.name, FairLock()

    def prepare(self, image: Image, bgr: np.ndarray, depth: Optional[DepthView] = None) -> Call:
        """See `Finder`; the service gets no depth."""
        return self._client.begin(image)

    def compute(self, prepared: Call, expected: Optional[People2D]) -> _Answer:
        """See `Finder`; the service knows nothing of space."""
        return _Answer(self._client.result(prepared))

    def finish(self, computed: _Answer) -> List[PersonDetection]:
        """See `Finder`."""
        return computed.detections

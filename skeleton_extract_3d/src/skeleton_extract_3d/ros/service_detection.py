"""Detection by a service: the only place between image and joints in space where people pass through messages."""
from typing import Iterator

import numpy as np

from openpose_ros_pkg.detect.detection import ImageFrame, Looks, NextPart
from openpose_ros_pkg.people import ExpectedPeople
from openpose_ros_pkg.ros.client.service_client import DetectionClient
from openpose_ros_pkg.ros.convert import people_from_messages
from openpose_ros_pkg.skeletons import SkeletonModel


class ServiceDetection:
    """A `Detection` that sends each image to openpose_ros_msgs/GetPersons; the service gets neither depth nor tracks.

    `ImageFrame.source` is the sensor_msgs/Image that is sent. People have the ids of the service. Messages do not tell
    who was extrapolated in the image: `People2D.looked` is true for all. `look` raises ServiceCallError, see
    `DetectionClient`.
    """

    gives_ids = True

    def __init__(self, client: DetectionClient, skeleton: SkeletonModel) -> None:
        self._client, self.skeleton = client, skeleton

    def look(self, frame: ImageFrame, expected: ExpectedPeople, in_full: bool = True) -> Looks:
        people = people_from_messages(self._client.detect(frame.source), self.skeleton)
        return Looks.of_all(people, expected)

    def remember(self, frame: ImageFrame, ids: np.ndarray) -> None:
        """Do nothing: the service has tracks of its own."""

    def search(self, frame: ImageFrame) -> Iterator[NextPart]:
        """Do nothing: the service searches once it has answered."""
        return iter(())

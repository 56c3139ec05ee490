"""Detection by a service: the only place between image and joints in space where people pass through messages."""
from typing import List, Optional

from openpose_ros_msgs.msg import PersonDetection

from openpose_ros_pkg.detect.detection import ImageFrame, Wanted, never_wanted
from openpose_ros_pkg.people import ExpectedPeople, People2D
from openpose_ros_pkg.ros.client.service_client import Call, DetectionClient
from openpose_ros_pkg.ros.convert import people_from_messages
from openpose_ros_pkg.skeletons import SkeletonModel
from openpose_ros_pkg.stream.fair_lock import FairLock


class ServiceDetection:
    """A `Detection` that sends each image to openpose_ros_msgs/GetPersons; the service gets neither depth nor tracks.

    Messages do not tell who was extrapolated in the image: `People2D.looked` is true for all.

    `ImageFrame.source` is the sensor_msgs/Image that is sent. The next image is on its way while one is computed.
    `compute` raises ServiceCallError, see `DetectionClient`.
    """

    def __init__(self, client: DetectionClient, skeleton: SkeletonModel) -> None:
        self._client, self.skeleton = client, skeleton
        self.lock = FairLock()

    def prepare(self, frame: ImageFrame) -> Call:
        return self._client.begin(frame.source)

    def compute(self, prepared: Call, expected: Optional[ExpectedPeople] = None) -> List[PersonDetection]:
        return self._client.result(prepared)

    def search(self, computed: List[PersonDetection], wanted: Wanted = never_wanted) -> bool:
        """Do nothing: the service searches once it has answered."""
        return False

    def finish(self, computed: List[PersonDetection]) -> People2D:
        """See `Detection`; ids are those of the service."""
        return people_from_messages(computed, self.skeleton)

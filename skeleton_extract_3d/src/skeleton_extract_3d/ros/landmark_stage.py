"""Hands and faces of the frames of the extractor: found, in space, and published."""
from typing import NamedTuple, Optional, Tuple

from openpose_ros_msgs.msg import FaceDetection_3dArray, HandDetection_3dArray
from std_msgs.msg import Header

from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.landmarks.params import LandmarkParams
from openpose_ros_pkg.landmarks.records import Landmarks2D
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.people_publisher import RESULTS_QUEUE, LandmarkPublisher
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.estimator import Estimate
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.lifter import Lifter


class LandmarkFinder(NamedTuple):
    """What finds hands and faces, and the rate that it has to keep up with [Hz]; 0: none."""

    detector: LandmarkDetector
    target_rate: float = 0.0


class LandmarkStage:
    """Finds hands and faces while somebody wants them, and publishes detected_hands_3d and detected_faces_3d.

    Args:
        namespace: prefix of the topics.
        chain: with the detector of `in_image`.
        lifter: knows the frame in which they are published.
        in_image: publishes what is found in the image.
        demand: gets to know who listens.
    """

    def __init__(self, namespace: str, chain: PeopleChain, lifter: Lifter, in_image: LandmarkPublisher, demand: Demand
                 ) -> None:
        self._chain, self._lifter, self._in_image, self._demand = chain, lifter, in_image, demand
        self._hands = demand.advertise(f'{namespace}/detected_hands_3d', HandDetection_3dArray,
                                       queue_size=RESULTS_QUEUE)
        self._faces = demand.advertise(f'{namespace}/detected_faces_3d', FaceDetection_3dArray,
                                       queue_size=RESULTS_QUEUE)

    def reconfigure(self, params: LandmarkParams) -> None:
        """Take other parameters from the next frame on."""
        self._in_image.reconfigure(params)

    def find(self, estimate: Estimate, frame: Frame, headers: Tuple[Header, Header], drawn: bool
             ) -> Optional[Landmarks2D]:
        """Publish hands and faces of a frame, and return those in the image; None: nobody wants any.

        Args:
            frame: with its image.
            headers: of the image and of the points.
            drawn: whether somebody draws them.

        Raises:
            BadInputError: the points are in no optical frame.
            NoTransformError: there is no transform to `target_frame`.
        """
        asked = self._in_image.look(drawn or self._demand.is_wanted(self._hands),
                                    drawn or self._demand.is_wanted(self._faces))
        if frame.bgr is None or not (asked.hands or asked.face):
            return None
        found = self._chain.landmarks(frame.bgr, estimate, frame, self._in_image.seconds)
        self._in_image.publish(found.in_image, headers[0])
        in_space, header = self._lifter.landmarks_in_target_frame(found.in_space, headers[1])
        if asked.hands:
            self._hands.publish(convert.hands_to_array(in_space.hands, header))
        if asked.face:
            self._faces.publish(convert.faces_to_array(in_space.faces, header))
        return found.in_image

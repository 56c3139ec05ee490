"""Hands and faces of the frames of the extractor: found, in space, and published."""
from typing import Tuple

from openpose_ros_msgs.msg import FaceDetection_3dArray, HandDetection_3dArray
from std_msgs.msg import Header

from openpose_ros_pkg.errors import BadInputError, NoTransformError
from openpose_ros_pkg.landmarks.params import LandmarkParams
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.people_publisher import RESULTS_QUEUE, LandmarkPublisher
from skeleton_extract_3d.chain import PeopleChain, Result
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.frames import FrameTransforms


class LandmarkStage:
    """Finds hands and faces while they have subscribers, and publishes detected_hands_3d and detected_faces_3d.

    The chain has the detector of `in_image`, which publishes what is found in the image.
    """

    def __init__(self, namespace: str, chain: PeopleChain, transforms: FrameTransforms, in_image: LandmarkPublisher,
                 health: Health, demand: Demand) -> None:
        self._chain, self._transforms, self._in_image = chain, transforms, in_image
        self._health, self._demand = health, demand
        self._hands = demand.advertise(f'{namespace}/detected_hands_3d', HandDetection_3dArray,
                                       queue_size=RESULTS_QUEUE)
        self._faces = demand.advertise(f'{namespace}/detected_faces_3d', FaceDetection_3dArray,
                                       queue_size=RESULTS_QUEUE)

    def reconfigure(self, params: LandmarkParams) -> None:
        """Take other parameters from the next frame on."""
        self._in_image.reconfigure(params)

    def publish(self, result: Result, headers: Tuple[Header, Header], drawn: bool) -> Result:
        """Find and publish hands and faces of a frame where they are wanted; return the result with them.

        People are published whatever becomes of these: an error is a warning.

        Args:
            headers: of the image and of the points.
            drawn: whether they are drawn.
        """
        try:
            return self._publish(result, headers, drawn)
        except NoTransformError:
            pass  # publishing the people says so
        except Exception as error:
            self._health.warn('no hands and faces', str(error) if isinstance(error, BadInputError) else repr(error))
        return result

    def _publish(self, result: Result, headers: Tuple[Header, Header], drawn: bool) -> Result:
        asked = self._in_image.look(drawn or self._demand.is_wanted(self._hands),
                                    drawn or self._demand.is_wanted(self._faces))
        if not (asked.hands or asked.face):
            return result
        result = self._chain.add_landmarks(result, self._in_image.seconds)
        self._in_image.publish(result.landmarks.in_image, headers[0])
        in_space, header = self._transforms.landmarks_in_target_frame(result.landmarks.in_space, headers[1])
        if asked.hands:
            self._hands.publish(convert.hands_to_array(in_space.hands, header))
        if asked.face:
            self._faces.publish(convert.faces_to_array(in_space.faces, header))
        return result

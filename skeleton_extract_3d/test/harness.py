"""What the tests of the running nodes share: frames of known truth, a detection service that says what it is told.

Frames carry their number, in pixel (0, 0) of the image and in z of the cloud, so that a wrong pair shows.
"""
import json
import sys
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Tuple

import numpy as np
import rospy
from openpose_ros_msgs.msg import BodypartDetection, PersonDetection, PersonDetection_3d, PersonDetection_3dArray
from openpose_ros_msgs.srv import GetPersons, GetPersonsRequest, GetPersonsResponse
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Header

sys.path.append(str(Path(__file__).resolve().parents[2] / 'tests/support'))
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.convert import bgr_to_image, image_to_bgr
from openpose_ros_pkg.skeletons import COCO_18
from optional_weights import need_weights as need_weights
from session import PATIENCE, await_true, is_heard
from skeleton_extract_3d.points.depth import XYZRGB, cloud_from_depth
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence
from skeleton_extract_3d.ros.convert import cloud_to_message

WIDTH, HEIGHT = 64, 48
FRAME_ID = 'test_optical_frame'
# z of frame number n is FIRST_Z + n * STEP_Z [m]
FIRST_Z, STEP_Z = 1.0, 0.01
OUTPUT = 'openpose_ros/skeleton_3d'


def image(number: int, stamp: rospy.Time, width: int = WIDTH, height: int = HEIGHT) -> Image:
    """Return a grey image whose pixel (0, 0) holds the frame's number."""
    bgr = np.full((height, width, 3), 90, np.uint8)
    bgr[0, 0] = number % 256, number // 256, 0
    return bgr_to_image(bgr, Header(stamp=stamp, frame_id=FRAME_ID))


def number_in(message: Image) -> int:
    """Return the frame's number; the message may be of any encoding."""
    blue, green, _ = image_to_bgr(message)[0, 0].tolist()
    return blue + 256 * green


def points(number: int, width: int = WIDTH, height: int = HEIGHT) -> np.ndarray:
    """Return a bent surface, so that a mean differs from the middle: (H, W, 3) [m]."""
    v, u = np.mgrid[:height, :width] * (WIDTH / width)
    z = np.full(u.shape, FIRST_Z + STEP_Z * number)
    return np.stack([0.01 * u + 0.0004 * u * u, 0.02 * v - 0.0003 * v * v, z], axis=-1)


def cloud(xyz: np.ndarray, stamp: rospy.Time, frame_id: str = FRAME_ID) -> PointCloud2:
    """Return the message of (H, W, 3) points [m]."""
    values = np.zeros(xyz.shape[:2], XYZRGB)
    for i, axis in enumerate('xyz'):
        values[axis] = xyz[..., i]
    return cloud_to_message(values, Header(stamp=stamp, frame_id=frame_id))


def person(person_id: int, keypoints: Mapping[str, Tuple[float, float]], confidence: float = 0.75) -> PersonDetection:
    """Return a person with some joints [px]."""
    message = PersonDetection(person_ID=person_id, num_people_detected=1)
    for joint, (x, y) in keypoints.items():
        setattr(message, joint, BodypartDetection(x=x, y=y, confidence=confidence))
    return message


def position(part: Any) -> np.ndarray:
    """Return x, y, z of a body part, (3,) [m]."""
    return np.array([part.x, part.y, part.z])


# Labels of the truth: a joint is outside the image, or visible; with any other one something hides it.
OUTSIDE, VISIBLE = 0, 2


class TruePerson(NamedTuple):
    """The truth about a person in a frame of the shipped sequence."""

    id: int  # the same in all frames
    xyz: np.ndarray  # (18, 3) [m], in the frame of the points
    uv: np.ndarray  # (18, 2) [px]
    labels: np.ndarray  # (18,)

    @property
    def hidden(self) -> np.ndarray:
        """(18,) joints within the image that are not to be seen."""
        return (self.labels != VISIBLE) & (self.labels != OUTSIDE)

    @property
    def shown(self) -> int:
        """Number of joints that are to be seen."""
        return int((self.labels == VISIBLE).sum())

    def pixels(self, labels: np.ndarray) -> Dict[str, Tuple[float, float]]:
        """Return the places [px] of some joints, (18,) bool, by name."""
        return {joint: tuple(xy) for joint, xy, label in zip(COCO_18.joints, self.uv, labels) if label}


class ShippedSequence:
    """The sequence that comes with the package: two people cross, and one hides the other for a while."""

    def __init__(self) -> None:
        folder = Path(__file__).resolve().parents[1] / 'demo' / 'cross'
        self.frames = RgbdSequence.read(folder)
        truth = json.loads((folder / 'gt.json').read_text())
        order = [truth['joints'].index(joint) for joint in COCO_18.joints]
        self.people = [[TruePerson(person['id'], *(np.array(person[key])[order] for key in ('xyz', 'uv', 'vis')))
                        for person in frame['people']] for frame in truth['frames']]

    def messages(self, number: int, stamp: rospy.Time, frame_id: str = FRAME_ID) -> Tuple[Image, PointCloud2]:
        """Return image and cloud of a frame."""
        frame, header = self.frames.frame(number), Header(stamp=stamp, frame_id=frame_id)
        picture, cloud = frame.bgr.copy(), cloud_from_depth(frame.depth * 0.001, self.frames.camera, frame.bgr)
        picture[0, 0] = number, 0, 0
        return bgr_to_image(picture, header), cloud_to_message(cloud, header)


class FakeDetector:
    """Serves GetPersons in place of a network.

    Attributes:
        answer: makes the people of a frame from its number; may raise or wait.
    """

    def __init__(self, name: str, keypoints: Optional[Mapping[str, Tuple[float, float]]] = None) -> None:
        keypoints = keypoints or {'nose': (20, 30)}
        self.answer: Callable[[int], List[PersonDetection]] = lambda number: [person(number, keypoints)]
        self.answered = 0
        self._service = rospy.Service(name, GetPersons, self._serve)

    def shutdown(self) -> None:
        """Take the service away."""
        self._service.shutdown('the test ends it')

    def _serve(self, request: GetPersonsRequest) -> GetPersonsResponse:
        try:
            number = number_in(request.image)
        except BadInputError as error:  # as the real one says it
            raise rospy.ServiceException(str(error)) from error
        detections = self.answer(number)
        self.answered += 1
        return GetPersonsResponse(detections=detections)


class Camera:
    """Publishes images and clouds with stamps that grow; ready when each has a number of subscribers."""

    def __init__(self, image_topic: str = 'image', points_topic: str = 'points', image_type: Any = Image,
                 points_type: Any = PointCloud2, listeners: Tuple[int, int] = (1, 1)) -> None:
        self.images = rospy.Publisher(image_topic, image_type, queue_size=10)
        self.points = rospy.Publisher(points_topic, points_type, queue_size=10)
        await_true(lambda: self.images.get_num_connections() >= listeners[0]
                   and self.points.get_num_connections() >= listeners[1],
                   f'{listeners} subscribers of {image_topic} and {points_topic}')

    def send(self, image_message: Any, points_message: Any) -> None:
        """Publish both."""
        self.images.publish(image_message)
        self.points.publish(points_message)

    def send_frame(self, number: int, stamp: Optional[rospy.Time] = None) -> rospy.Time:
        """Publish a good frame and return its stamp."""
        stamp = stamp or now()
        self.send(image(number, stamp), cloud(points(number), stamp))
        return stamp


_last = [rospy.Time()]


def now() -> rospy.Time:
    """Return the time, which is at least the period of a 30 Hz camera after the last call: waits for it."""
    following = _last[0] + rospy.Duration(1 / 30)
    time.sleep(max(0.0, following.to_sec() - time.time()))
    _last[0] = max(rospy.Time.from_sec(time.time()), following)
    return _last[0]


class Output:
    """Keeps what the extractor publishes."""

    def __init__(self, namespace: str = '') -> None:
        self.arrays: List[PersonDetection_3dArray] = []
        self.persons: List[PersonDetection_3d] = []
        topics = [f'{namespace}/{OUTPUT}/{topic}'.lstrip('/')
                  for topic in ('detected_poses_3d', 'detected_poses_keypoints_3d')]
        rospy.Subscriber(topics[0], PersonDetection_3dArray, self.arrays.append)
        rospy.Subscriber(topics[1], PersonDetection_3d, self.persons.append)
        await_true(lambda: all(map(is_heard, topics)), 'the extractor is there')

    def frame(self, stamp: rospy.Time, timeout: float = PATIENCE) -> PersonDetection_3dArray:
        """Wait for the people of the frame with this stamp and return them."""
        return await_true(lambda: next((array for array in list(self.arrays) if array.header.stamp == stamp), None),
                          f'people of the frame of {stamp.to_sec():.3f}', timeout)

    def has(self, stamp: rospy.Time) -> bool:
        """Tell whether the frame with this stamp came."""
        return any(array.header.stamp == stamp for array in list(self.arrays))


def joints_of(found: PersonDetection_3d) -> np.ndarray:
    """Return the joints of a person, (18, 3) [m]; NaN where MISSING."""
    return np.array([position(getattr(found, joint)) for joint in COCO_18.joints])


def of_joints(found: Any, what: str) -> np.ndarray:
    """Return status, sigma or confidence of each joint, (18,)."""
    return np.array([getattr(getattr(found, joint), what) for joint in COCO_18.joints])

"""Publish the people of each image: in one message, one by one, drawn into the image; and their hands and faces."""
import time
from dataclasses import replace
from typing import Dict, NamedTuple, Optional, Sequence

import numpy as np
import rospy
from openpose_ros_msgs.msg import FaceDetectionArray, HandDetectionArray, PersonDetection, PersonDetectionArray
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from openpose_ros_pkg.detect.recipe_choice import RATE
from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.landmarks.records import LandmarkParams, Landmarks2D
from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.params.nodes import AnnotatedImageParams
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros import convert
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.timing_report import TimingReport
from openpose_ros_pkg.stream.frame_loop import NewestWinsWorker

# Frames whose results wait for a subscriber that does not read: 3 s at 30 Hz, and as many as a topic's queue in `rosbag
# record` holds; an array of 20 people in space takes 30 kB.
RESULTS_QUEUE = 100
# One message per person: the same time with 20 people.
PERSONS_QUEUE = 20 * RESULTS_QUEUE
# Stage of the timing report that a drawing takes.
DRAW_STAGE = 'draw'
# A longer time between images is a gap [s].
_LONGEST_INTERVAL = 1.0
# Stage that hands and faces take.
LANDMARK_STAGE = 'landmarks'


class Drawing(NamedTuple):
    """What is drawn into an image; see `draw_people`."""

    header: Header
    bgr: np.ndarray
    people: People2D
    hidden: Optional[np.ndarray]
    landmarks: Optional[Landmarks2D]


class PeoplePublisher:
    """Publishes detected_poses, detected_poses_keypoints and detected_poses_image, raw and compressed.

    The image is drawn once, in a thread of its own, and made a raw and a compressed message only for subscribers.
    `timing` is a report with DRAW_STAGE.
    """

    def __init__(self, namespace: str, params: DrawParams, images: AnnotatedImageParams, health: Health,
                 timing: TimingReport, demand: Demand) -> None:
        self._params, self._images, self._timing = params, images, timing
        self._array_publisher = demand.advertise(f'{namespace}/detected_poses', PersonDetectionArray,
                                                 queue_size=RESULTS_QUEUE)
        self._person_publisher = demand.advertise(f'{namespace}/detected_poses_keypoints', PersonDetection,
                                                  queue_size=PERSONS_QUEUE)
        self._image_publisher = demand.advertise(f'{namespace}/detected_poses_image', Image, queue_size=1)
        # where image_transport looks for it
        self._compressed_publisher = demand.advertise(f'{namespace}/detected_poses_image/compressed', CompressedImage,
                                                      queue_size=1)
        self._painter = NewestWinsWorker(
            self._draw, lambda error: health.warn('drawing failed', str(error)), 'painter')

    def reconfigure(self, params: DrawParams, images: AnnotatedImageParams) -> None:
        """Draw and compress with other parameters from the next image on."""
        self._params, self._images = params, images

    @property
    def draws(self) -> bool:
        """Whether the drawn image has a subscriber."""
        return _is_wanted(self._image_publisher) or _is_wanted(self._compressed_publisher)

    def publish(self, people: People2D, header: Header, scaled: Optional[Sequence[PersonDetection]] = None) -> None:
        """Publish the people of an image; `scaled` are the messages of single people where those are not in pixels."""
        array = convert.people_to_array(people, header)
        self._array_publisher.publish(array)
        for message in array.persons if scaled is None else scaled:
            self._person_publisher.publish(message)

    def draw(self, drawing: Drawing) -> None:
        """Have an image drawn and published, if there is a subscriber; it may be read after this call."""
        if self.draws:
            self._painter.submit(drawing)

    def _draw(self, drawing: Drawing) -> None:
        begin = time.monotonic()
        header, bgr, people, hidden, landmarks = drawing
        drawn = draw_people(bgr, people, self._params, hidden, landmarks)
        if _is_wanted(self._image_publisher):
            self._image_publisher.publish(convert.bgr_to_image(drawn, header))
        if _is_wanted(self._compressed_publisher):
            self._compressed_publisher.publish(convert.bgr_to_jpeg(drawn, header, self._images.jpeg_quality))
        self._timing.add(DRAW_STAGE, time.monotonic() - begin)



class LandmarkPublisher:
    """Publishes detected_hands and detected_faces, each while its parameter is on.

    Args:
        namespace: prefix of the topics; None: nothing is published.
        detector: finds them; it belongs to this object from now on.
        params: what is to be found.
        target_rate: of the images [Hz]; 0: none is asked for.

    Attributes:
        seconds: that the networks may take for an image [s]: what the others leave of the time until the next one, at
            `target_rate` or as images come; None: any time.
    """

    def __init__(self, namespace: Optional[str], detector: LandmarkDetector, params: LandmarkParams,
                 target_rate: float, health: Health, demand: Demand) -> None:
        self.detector, self._params, self._asked, self._demand = detector, params, params, demand
        self._rate, self._last = target_rate, time.monotonic()
        self.seconds = (1 - RATE.networks_share) / target_rate if target_rate > 0 else None
        self._newest: Optional[Landmarks2D] = None
        self._publishers = None if namespace is None else (
            demand.advertise(f'{namespace}/detected_hands', HandDetectionArray, queue_size=RESULTS_QUEUE),
            demand.advertise(f'{namespace}/detected_faces', FaceDetectionArray, queue_size=RESULTS_QUEUE))
        detector.warm_up()
        health.show_lasting(lambda: detector.faults if self._params.hands or self._params.face else '')
        health.show(self._numbers)

    def reconfigure(self, params: LandmarkParams) -> None:
        """Take other parameters from the next image on; networks that are wanted now are loaded."""
        if params != self._params:
            self._params = self._asked = params
            self.detector.reconfigure(params)

    def look(self, hands: bool, faces: bool) -> LandmarkParams:
        """Let the detector find what the parameters ask for and is wanted, or has subscribers; return what that is."""
        wanted = self._publishers and [self._demand.is_wanted(publisher) for publisher in self._publishers]
        hands, faces = (hands or wanted[0], faces or wanted[1]) if wanted else (hands, faces)
        if self._rate > 0:
            now, last = time.monotonic(), self._last
            self._last = now
            self.seconds = (1 - RATE.networks_share) * min(max(1 / self._rate, now - last), _LONGEST_INTERVAL)
        params = self._params
        asked = replace(params, hands=params.hands and hands, face=params.face and faces)
        if asked != self._asked:
            self._asked = asked
            self.detector.reconfigure(asked)
        return asked

    def publish(self, found: Landmarks2D, header: Header) -> None:
        """Publish hands and faces of an image with this header."""
        self._newest = found
        if self._publishers is None:
            return
        hands, faces = self._publishers
        if self._asked.hands:
            hands.publish(convert.hands_to_array(found.hands, header))
        if self._asked.face:
            faces.publish(convert.faces_to_array(found.faces, header))

    def _numbers(self) -> Dict[str, str]:
        newest = self._newest
        return {} if newest is None else {'hands in the newest image': str(len(newest.hands)),
                                          'faces in the newest image': str(len(newest.faces))}


def _is_wanted(publisher: rospy.Publisher) -> bool:
    return publisher.get_num_connections() > 0

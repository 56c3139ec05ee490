"""Publish the people of each image: in one message, one by one, and drawn into the image."""
import time
from typing import Optional, Sequence, Tuple

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection, PersonDetectionArray
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from openpose_ros_pkg.output.draw import DrawParams, draw_people
from openpose_ros_pkg.params.nodes import AnnotatedImageParams
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros import convert
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.timing_report import TimingReport
from openpose_ros_pkg.stream.newest_wins import NewestWinsWorker

# Frames whose results wait for a subscriber that does not read: 3 s at 30 Hz, and as many as a topic's queue in `rosbag
# record` holds; an array of 20 people in space takes 30 kB.
RESULTS_QUEUE = 100
# One message per person: the same time with 20 people.
PERSONS_QUEUE = 20 * RESULTS_QUEUE
# Stage of the timing report that a drawing takes.
DRAW_STAGE = 'draw'

Drawing = Tuple[Header, np.ndarray, People2D, Optional[np.ndarray]]


class PeoplePublisher:
    """Publishes detected_poses, detected_poses_keypoints and detected_poses_image, raw and compressed.

    The image is drawn once, in a thread of its own, and made a raw and a compressed message only while somebody listens
    to each.

    Args:
        namespace: prefix of the topics.
        params: how people are drawn.
        images: how the image is compressed.
        health: counts drawings that fail.
        timing: a report with DRAW_STAGE.
        demand: gets to know who listens.
    """

    def __init__(self, namespace: str, params: DrawParams, images: AnnotatedImageParams, health: Health,
                 timing: TimingReport, demand: Demand) -> None:
        self._params, self._images, self._health, self._timing = params, images, health, timing
        self._array_publisher = demand.advertise(f'{namespace}/detected_poses', PersonDetectionArray,
                                                 queue_size=RESULTS_QUEUE)
        self._person_publisher = demand.advertise(f'{namespace}/detected_poses_keypoints', PersonDetection,
                                                  queue_size=PERSONS_QUEUE)
        self._image_publisher = demand.advertise(f'{namespace}/detected_poses_image', Image, queue_size=1)
        # where image_transport looks for it
        self._compressed_publisher = demand.advertise(f'{namespace}/detected_poses_image/compressed', CompressedImage,
                                                      queue_size=1)
        self._painter = NewestWinsWorker(self._draw, self._failed, 'painter')

    def reconfigure(self, params: DrawParams, images: AnnotatedImageParams) -> None:
        """Draw and compress with other parameters from the next image on."""
        self._params, self._images = params, images

    def publish(self, people: People2D, messages: Sequence[PersonDetection], header: Header, bgr: np.ndarray,
                scaled: Optional[Sequence[PersonDetection]] = None, hidden: Optional[np.ndarray] = None) -> None:
        """Publish the people of an image.

        Args:
            people: keypoints [px of the image].
            messages: one of each person, as `convert.people_to_messages` makes them.
            header: of the image.
            bgr: (H, W, 3) uint8, not modified; may be read after this call.
            scaled: the messages for detected_poses_keypoints where those are not in pixels.
            hidden: (P, K) bool, joints that are drawn as hidden; None: none is.
        """
        self._array_publisher.publish(convert.people_to_array(messages, header, people.skeleton))
        for message in messages if scaled is None else scaled:
            self._person_publisher.publish(message)
        if _is_wanted(self._image_publisher) or _is_wanted(self._compressed_publisher):
            self._painter.submit((header, bgr, people, hidden))

    def _draw(self, drawing: Drawing) -> None:
        begin = time.monotonic()
        header, bgr, people, hidden = drawing
        drawn = draw_people(bgr, people, self._params, hidden)
        if _is_wanted(self._image_publisher):
            self._image_publisher.publish(convert.bgr_to_image(drawn, header))
        if _is_wanted(self._compressed_publisher):
            self._compressed_publisher.publish(convert.bgr_to_jpeg(drawn, header, self._images.jpeg_quality))
        self._timing.add(DRAW_STAGE, time.monotonic() - begin)

    def _failed(self, error: Exception) -> None:
        self._health.warn('drawing failed', str(error))


def _is_wanted(publisher: rospy.Publisher) -> bool:
    return publisher.get_num_connections() > 0

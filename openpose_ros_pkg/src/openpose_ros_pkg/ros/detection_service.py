"""The service node: finds the people in the images it is sent, publishes keypoints and the annotated image."""
import itertools
import time
from dataclasses import dataclass, field
from typing import Any, Dict, List, Optional

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection
from openpose_ros_msgs.srv import GetPersons, GetPersonsRequest, GetPersonsResponse
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.tracking import CameraTrackers
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.frame_writer import FrameWriter
from openpose_ros_pkg.output.keypoint_scale import scale_keypoints
from openpose_ros_pkg.output.recorder import Recorder
from openpose_ros_pkg.params.nodes import LIVE_PARAMETERS, ServiceSettings
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros import convert
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import AnyImage, image_subscriber, raw_image
from openpose_ros_pkg.ros.live_parameters import LiveParameters
from openpose_ros_pkg.ros.node import check_topic_name, run_node
from openpose_ros_pkg.ros.parameters import read_private
from openpose_ros_pkg.ros.people_publisher import DRAW_STAGE, PeoplePublisher
from openpose_ros_pkg.ros.timing_report import TimingReport
from openpose_ros_pkg.stream.pipeline import Pipeline

# Stages of the timing report. total: from the callback to the published result; added: total without waiting and
# network.
_STAGES = ('decode_message', 'preprocess', 'wait_for_network', 'network', 'decode', 'publish', 'total', 'added',
           DRAW_STAGE)


@dataclass
class _Frame:
    """An image on its way through the node.

    Attributes:
        message: the image as it came; None once it is decoded.
        header: of the image.
        bgr: (H, W, 3) uint8; for bgr8 a view of the message's data.
        work: what the detector hands from stage to stage.
        received: when the callback had it [s], time.monotonic().
        ready: when it was ready for the network [s].
        waited, computed: how long it waited for the network, and was in it [s].
    """

    message: Optional[AnyImage]
    header: Header
    bgr: Optional[np.ndarray] = None
    work: Any = None
    received: float = field(default_factory=time.monotonic)
    ready: float = 0.0
    waited: float = 0.0
    computed: float = 0.0


class DetectionService:
    """Serves openpose_ros_msgs/GetPersons and, with `image_topic`, finds the people of a camera by itself.

    Requests of several clients are prepared and finished in their own threads; the network takes one picture at a
    time, in the order in which they asked for it. The camera is one more of those who ask. People keep their ids per
    camera, told apart by frame_id.

    Args:
        service: name of the service.
        namespace: prefix of the published topics.
    """

    def __init__(self, service: str, namespace: str) -> None:
        settings = self._settings = read_private(ServiceSettings)
        if settings.stream.image_topic:
            check_topic_name('image_topic', settings.stream.image_topic)
        self._detector = create_detector(settings.detector)
        self._recorder: Optional[Recorder] = None
        if settings.save.active:
            writer = FrameWriter(settings.save, settings.draw, settings.keypoint_scale)
            self._recorder = Recorder(writer, wait_when_full=False)
        self._numbers = itertools.count()
        self._health = Health()
        self._timing = TimingReport(_STAGES, result='total')
        self._health.show(self._timing.medians)
        self._health.show(self._recorder_counters)
        self._trackers = CameraTrackers(settings.tracking)
        self._publisher: Optional[PeoplePublisher] = None
        if settings.publishing.publish_results:
            self._publisher = PeoplePublisher(namespace, settings.draw, self._health, self._timing)
        self._live = LiveParameters(settings, LIVE_PARAMETERS, self._reconfigure)
        self._service = rospy.Service(service, GetPersons, self._serve)
        if settings.stream.image_topic:
            self._subscribe(settings.stream.image_topic, namespace)
        if self._recorder is not None:
            rospy.on_shutdown(self._recorder.close)
        rospy.loginfo('Initialization Successful!')

    def _subscribe(self, topic: str, namespace: str) -> None:
        self._input_publisher = rospy.Publisher(f'{namespace}/input_image', Image, queue_size=1)
        self._pipeline = Pipeline(self._prepare_streamed, self._compute, self._finish, self._frame_failed,
                                  self._detector.lock)
        # a thread within the network would end the program with an abort
        rospy.on_shutdown(self._pipeline.stop)
        self._health.show(lambda: {'images skipped': str(self._pipeline.replaced)})
        self._subscriber = image_subscriber(topic, self._settings.transport,
                                            lambda message: self._pipeline.submit(_Frame(message, message.header)))
        rospy.loginfo('waiting for images on %s', self._subscriber.resolved_name)

    def _serve(self, request: GetPersonsRequest) -> GetPersonsResponse:
        frame = _Frame(request.image, request.image.header)
        try:
            self._prepare(frame)
            with self._detector.lock:
                self._compute(frame)
            return GetPersonsResponse(detections=self._finish(frame))
        except BadInputError as error:
            self._health.warn('bad image', str(error))
            raise rospy.ServiceException(str(error)) from error

    def _prepare_streamed(self, frame: _Frame) -> None:
        # until now, the pipeline held it back because the network was busy
        frame.waited = time.monotonic() - frame.received
        if self._input_publisher.get_num_connections() > 0:
            self._input_publisher.publish(raw_image(frame.message))
        self._prepare(frame)

    def _prepare(self, frame: _Frame) -> None:
        begin = time.monotonic()
        frame.bgr = convert.any_image_to_bgr(frame.message)
        frame.message = None
        decoded = time.monotonic()
        frame.work = self._detector.prepare(frame.bgr)
        frame.ready = time.monotonic()
        self._timing.add('decode_message', decoded - begin)
        self._timing.add('preprocess', frame.ready - decoded)

    def _compute(self, frame: _Frame) -> None:
        begin = time.monotonic()
        frame.work = self._detector.compute(frame.work)
        frame.waited += begin - frame.ready
        frame.computed = time.monotonic() - begin

    def _finish(self, frame: _Frame) -> List[PersonDetection]:
        begin = time.monotonic()
        people = self._detector.finish(frame.work)
        decoded = time.monotonic()
        people = self._trackers.update(people, frame.header.frame_id, frame.header.stamp.to_sec())
        messages = convert.people_to_messages(people, frame.header)
        if self._publisher is not None:
            self._publisher.publish(people, messages, frame.header, frame.bgr, self._scaled(people, frame))
        if self._recorder is not None:
            self._recorder.submit(next(self._numbers), frame.bgr, people)
        self._health.frame_done(frame.header.stamp)
        end = time.monotonic()
        for stage, seconds in (('wait_for_network', frame.waited), ('network', frame.computed),
                               ('decode', decoded - begin), ('publish', end - decoded), ('total', end - frame.received),
                               ('added', end - frame.received - frame.waited - frame.computed)):
            self._timing.add(stage, seconds)
        return messages

    def _frame_failed(self, error: Exception) -> None:
        if isinstance(error, BadInputError):
            self._health.warn('bad image', str(error))
        elif not rospy.is_shutdown():  # then topics close while a result is on its way
            self._health.warn('frame failed', repr(error))

    def _scaled(self, people: People2D, frame: _Frame) -> Optional[List[PersonDetection]]:
        """Return the messages with coordinates as `keypoint_scale` wants them; None: in pixels."""
        scale = self._settings.keypoint_scale
        if scale.keypoint_scale == 0:
            return None
        size = (frame.bgr.shape[1], frame.bgr.shape[0])
        return convert.people_to_messages(people, frame.header, scale_keypoints(people.keypoints, size, scale))

    def _recorder_counters(self) -> Dict[str, str]:
        counters = self._recorder.counters if self._recorder is not None else {}
        return {f'saving, {key}': str(number) for key, number in counters.items()}

    def _reconfigure(self, settings: ServiceSettings) -> None:
        """Take new parameters; they hold from the next frame on."""
        if settings.detector != self._settings.detector:
            self._detector.reconfigure(settings.detector)
        self._settings = settings
        self._trackers.reconfigure(settings.tracking)
        if self._publisher is not None:
            self._publisher.reconfigure(settings.draw)
        if self._recorder is not None:
            self._recorder.reconfigure(settings.draw)


def main_2d() -> None:
    """Run the service node under its 2D names."""
    run_node('openpose_ros_service_node', ServiceSettings, lambda: DetectionService('detect_poses', 'openpose_ros'))


def main_3d() -> None:
    """Run the service node under its 3D names."""
    run_node('openpose_ros_service_node_3d', ServiceSettings,
             lambda: DetectionService('detect_poses_3d', 'openpose_ros/skeleton_3d'))

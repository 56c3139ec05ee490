"""The service node: finds the people in the images it is sent, publishes keypoints and the annotated image."""
import itertools
import time
from dataclasses import dataclass, replace
from typing import Dict, Generic, List, NamedTuple, Optional, Tuple, TypeVar

import rospy
from diagnostic_msgs.msg import DiagnosticStatus
from openpose_ros_msgs.msg import PersonDetection
from openpose_ros_msgs.srv import GetPersons, GetPersonsRequest, GetPersonsResponse
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from openpose_ros_pkg.detect.detection import ImageFrame, Wanted, never_wanted
from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.network_detection import ComputedDetection, NetworkDetection, PreparedDetection
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.landmarks.detector import create_landmark_detector
from openpose_ros_pkg.landmarks.records import Landmarks2D
from openpose_ros_pkg.output.frame_writer import REFUSE, FrameWriter
from openpose_ros_pkg.output.keypoint_scale import scale_keypoints
from openpose_ros_pkg.output.recorder import Recorder
from openpose_ros_pkg.params.nodes import LIVE_PARAMETERS, ServiceSettings
from openpose_ros_pkg.people import ExpectedPeople, People2D
from openpose_ros_pkg.ros import convert
from openpose_ros_pkg.ros.camera_info import CameraInfoPublisher, sibling_camera_info
from openpose_ros_pkg.ros.cameras import find_camera
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import AnyImage, image_subscriber, raw_image
from openpose_ros_pkg.ros.live_parameters import LiveParameters
from openpose_ros_pkg.ros.node import check_topic_name, introduce, run_node
from openpose_ros_pkg.ros.people_publisher import (
    DRAW_STAGE,
    LANDMARK_STAGE,
    Drawing,
    LandmarkPublisher,
    PeoplePublisher,
)
from openpose_ros_pkg.ros.timing_report import TimingReport
from openpose_ros_pkg.skeletons import SkeletonModel
from openpose_ros_pkg.stream.fair_lock import FairLock
from openpose_ros_pkg.stream.later_search import LaterSearch
from openpose_ros_pkg.stream.pipeline import Pipeline, PipelineStages

# Stages of the timing report. network: the networks alone; decode: from their outputs to people; total: from the
# arrival of the image to the published result; added: total without wait_for_network and network.
STAGES = ('decode_message', 'preprocess', 'wait_for_network', 'network', 'decode', LANDMARK_STAGE, 'publish', 'total',
          'added', 'search', DRAW_STAGE)
# When so many frames in a row could not be saved, the status is ERROR.
_LASTING = 10
State = TypeVar('State', PreparedDetection, ComputedDetection)


class _Arrived(NamedTuple):
    """An image as it came."""

    message: AnyImage
    received: float  # when it came [s], time.monotonic()
    interval: Optional[float] = None  # see `ImageFrame`


@dataclass(frozen=True, eq=False)
class _Step(Generic[State]):
    """An image on its way through the detection."""

    frame: ImageFrame  # the image
    state: State  # in the detection
    received: float  # when the image came [s], time.monotonic()
    busy: float  # time that the newest stage took: decoding and preparing the image, or computing it [s]
    waited: float = 0.0  # for the networks [s]
    network_seconds: float = 0.0  # of the networks [s]

    @property
    def header(self) -> Header:
        """Header of the image."""
        return self.frame.source.header


class DetectionService:
    """A `Detection` that publishes and saves what it finds, and serves openpose_ros_msgs/GetPersons.

    It finds the people in the images of requests, in those of the chain of this process and, with `image_topic`, in
    those of a camera. Requests of several clients are prepared and finished in their own threads. The networks take one
    image at a time, of clients and cameras alike, in the order of their requests. People keep their ids per camera: a
    client and a frame_id, or a camera of this process. An image is searched for new people once the others in it are
    published or returned.

    Args:
        service: name of the service.
        namespace: prefix of the published topics.
        health, timing, demand: of the node; `timing` has STAGES.
    """

    def __init__(self, service: str, namespace: str, settings: ServiceSettings, health: Health, timing: TimingReport,
                 demand: Demand) -> None:
        self._settings, self._newest = settings, -float('inf')
        if settings.stream.image_topic:
            check_topic_name('image_topic', settings.stream.image_topic)
        self._detector = create_detector(settings.detector, settings.following)
        self._detection = NetworkDetection(self._detector, settings.tracking, settings.following)
        self._recorder: Optional[Recorder] = None
        self._numbers = itertools.count()
        if settings.save.active:
            writer = FrameWriter(settings.save, settings.draw, settings.keypoint_scale, existing=REFUSE)
            self._numbers = itertools.count(writer.next_number())
            self._recorder = Recorder(writer, wait_when_full=False,
                                      on_fault=lambda fault: health.warn('frame not saved', fault))
            health.show_lasting(self._recorder.fault)
            health.show_lasting(lambda: self._recorder.fault(_LASTING), DiagnosticStatus.ERROR)
        self._health, self._timing, self._demand = health, timing, demand
        self._health.show_lasting(lambda: self._detector.faults)
        self._health.show(lambda: self._detector.not_installed)
        self._health.show(self._recorder_counters)
        self._publisher: Optional[PeoplePublisher] = None
        self._camera_info: Optional[CameraInfoPublisher] = None
        if settings.publishing.publish_results:
            self._publisher = PeoplePublisher(namespace, settings.draw, settings.images, health, timing, demand)
        self._landmarks: Optional[LandmarkPublisher] = None
        if self._publisher is not None or self._recorder is not None:
            self._landmarks = self._make_landmarks(namespace if self._publisher is not None else None)
        self._later = LaterSearch(self.search, self.lock, health.frame_failed)
        # a thread within a network would end the program with an abort
        rospy.on_shutdown(self._later.stop)
        self._service = rospy.Service(service, GetPersons, self._serve)
        self.name = self._service.resolved_name
        if settings.stream.image_topic:
            self._subscribe(settings.stream.image_topic, namespace)
        if self._recorder is not None:
            rospy.on_shutdown(self._recorder.close)

    def warm_up(self, streams: bool) -> None:
        """Compile the networks for the first image.

        Args:
            streams: whether most images are those of a chain of this process, and the first request may take longer.
        """
        if self._settings.detector.detector.mode != 'accurate':  # for recordings, and slow
            self._detection.warm_up(streams or bool(self._settings.stream.image_topic))

    def _make_landmarks(self, namespace: Optional[str]) -> LandmarkPublisher:
        detector = self._settings.detector
        return LandmarkPublisher(
            namespace, create_landmark_detector(self._settings.landmarks, detector.backend,
                                                detector.detector.model_folder, self.whole_body),
            self._settings.landmarks, detector.detector.target_rate, self._health, self._demand)

    @property
    def lock(self) -> FairLock:
        """To be held during `compute`."""
        return self._detection.lock

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people."""
        return self._detection.skeleton

    @property
    def whole_body(self) -> bool:
        """Whether the people have the points of a network for whole bodies, in every mode."""
        return self._detector.recipe.whole_body

    @property
    def description(self) -> Dict[str, str]:
        """What is at work, for `introduce`."""
        params = self._settings.detector.detector
        crop_model = f', crop_model {params.crop_model}' if params.crop_model else ''
        return {'mode': f'{params.mode}, pose_model {params.pose_model}{crop_model}, joints {self.skeleton.name}',
                'networks': self._detector.recipe.description, 'runtime': self._detector.description,
                'people': self._detection.description,
                'target_rate': f'{params.target_rate:g} Hz' if params.target_rate > 0 else 'none'}

    def prepare(self, frame: ImageFrame) -> _Step[PreparedDetection]:
        """See `Detection`; `source` of the frame is a message with the header of the image."""
        return self._prepare(frame, time.monotonic())

    def compute(self, prepared: _Step[PreparedDetection], expected: Optional[ExpectedPeople] = None
                ) -> _Step[ComputedDetection]:
        begin = time.monotonic()
        found = self._detection.compute(prepared.state, expected)
        return _Step(prepared.frame, found, prepared.received, time.monotonic() - begin,
                     begin - prepared.received - prepared.busy, found.network_seconds)

    def search(self, computed: _Step[ComputedDetection], wanted: Wanted = never_wanted) -> bool:
        begin = time.monotonic()
        searched = self._detection.search(computed.state, wanted)
        if searched:
            self._timing.add('search', time.monotonic() - begin)
        return searched

    def finish(self, computed: _Step[ComputedDetection]) -> People2D:
        """Publish and save the people of an image as the parameters say, and return them; see `Detection`."""
        begin, frame, header = time.monotonic(), computed.frame, computed.header
        people = self._detection.finish(computed.state)
        decoded = time.monotonic()
        if self._publisher is not None:
            self._publisher.publish(convert.people_to_messages(people, header), header, people.skeleton,
                                    self._scaled(people, frame))
        published = time.monotonic()
        landmarks = self._find_landmarks(people, frame)
        found = time.monotonic()
        if self._publisher is not None:
            self._publisher.draw(Drawing(header, frame.bgr, people, None, landmarks))
        if self._recorder is not None:
            self._recorder.submit(next(self._numbers), frame.bgr, people, landmarks)
        end = time.monotonic()
        network, total = computed.network_seconds, end - computed.received
        for stage, seconds in (('wait_for_network', computed.waited), ('network', network),
                               ('decode', computed.busy - network + decoded - begin),
                               (LANDMARK_STAGE, found - published), ('publish', published - decoded + end - found),
                               ('total', total), ('added', total - computed.waited - network)):
            self._timing.add(stage, seconds)
        return people

    def _find_landmarks(self, people: People2D, frame: ImageFrame) -> Optional[Landmarks2D]:
        """Return hands and faces of the people of an image, after publishing them; None: they are not wanted."""
        if self._landmarks is None:
            return None
        used = self._recorder is not None or (self._publisher is not None and self._publisher.draws)
        asked = self._landmarks.look(used, used)
        if not (asked.hands or asked.face):
            return None
        found = self._landmarks.detector.detect(frame.bgr, people, None, frame.camera, frame.stamp,
                                                self._landmarks.seconds)
        self._landmarks.publish(found, frame.source.header)
        return found

    def _subscribe(self, topic: str, namespace: str) -> None:
        self._input_publisher = self._demand.advertise(f'{namespace}/input_image', Image, queue_size=1)
        images = image_subscriber(topic, self._settings.transport.image_transport)
        inputs = [images]
        if self._publisher is not None:
            self._camera_info = CameraInfoPublisher(namespace, sibling_camera_info(topic), self._health, self._demand)
            inputs.append(self._camera_info.input)
        stages = PipelineStages(self._prepare_streamed, self.compute, self._finish_and_count, self.search)
        self._pipeline = Pipeline(stages, self._health.frame_failed, self.lock)
        rospy.on_shutdown(self._pipeline.stop)
        self._health.show(lambda: {'images skipped': str(self._pipeline.replaced)})
        images.registerCallback(self._submit)
        self._demand.read(*inputs)

    def _submit(self, message: AnyImage) -> None:
        stamp = message.header.stamp.to_sec()
        interval, self._newest = stamp - self._newest, stamp
        self._pipeline.submit(_Arrived(message, time.monotonic(), interval))

    def _serve(self, request: GetPersonsRequest) -> GetPersonsResponse:
        if not self._demand.enabled:
            raise rospy.ServiceException(f'{rospy.get_name()} is disabled; {rospy.get_name()}/enable enables it')
        image = request.image
        try:
            prepared = self._decode(_Arrived(image, time.monotonic()), request._connection_header['callerid'],
                                    self._settings.following.follow_requests)
            with self.lock:
                computed = self.compute(prepared)
            persons = convert.people_to_messages(self._finish_and_count(computed), image.header)
            self._later.submit(prepared.frame.camera, computed)
            return GetPersonsResponse(persons)
        except BadInputError as error:
            self._health.frame_failed(error)
            raise rospy.ServiceException(str(error)) from error

    def _prepare_streamed(self, arrived: '_Arrived') -> _Step[PreparedDetection]:
        message = arrived.message
        if self._input_publisher.get_num_connections() > 0:
            self._input_publisher.publish(raw_image(message, self._settings.limits.max_image_megapixels))
        prepared = self._decode(arrived)
        if self._camera_info is not None:
            self._camera_info.publish(message.header, (prepared.frame.bgr.shape[1], prepared.frame.bgr.shape[0]))
        return prepared

    def _decode(self, arrived: '_Arrived', sender: str = '', follow: bool = True) -> _Step[PreparedDetection]:
        begin, message, header = time.monotonic(), arrived.message, arrived.message.header
        bgr = convert.any_image_to_bgr(message, self._settings.limits.max_image_megapixels)
        decoding = time.monotonic() - begin
        self._timing.add('decode_message', decoding)
        frame = ImageFrame((sender, header.frame_id), header.stamp.to_sec(), bgr, follow=follow, source=message,
                           interval=arrived.interval)
        return self._prepare(frame, arrived.received, decoding)

    def _prepare(self, frame: ImageFrame, received: float, decoding: float = 0.0) -> _Step[PreparedDetection]:
        begin = time.monotonic()
        prepared = self._detection.prepare(frame)
        preparing = time.monotonic() - begin
        self._timing.add('preprocess', preparing)
        return _Step(frame, prepared, received, decoding + preparing)

    def _finish_and_count(self, computed: _Step[ComputedDetection]) -> People2D:
        people = self.finish(computed)
        self._health.frame_done(computed.header.stamp)
        return people

    def _scaled(self, people: People2D, frame: ImageFrame) -> Optional[List[PersonDetection]]:
        """Return the messages with coordinates as `keypoint_scale` wants them; None: in pixels."""
        scale = self._settings.keypoint_scale
        if scale.keypoint_scale == 0:
            return None
        size = (frame.bgr.shape[1], frame.bgr.shape[0])
        return convert.people_to_messages(people, frame.source.header, scale_keypoints(people.keypoints, size, scale))

    def _recorder_counters(self) -> Dict[str, str]:
        counters = self._recorder.counters if self._recorder is not None else {}
        return {f'saving, {key}': str(number) for key, number in counters.items()}

    def reconfigure(self, settings: ServiceSettings) -> None:
        """Take new parameters; they hold from the next frame on."""
        if settings.detector != self._settings.detector:
            self._detector.reconfigure(settings.detector)
        self._settings = settings
        self._detection.reconfigure(settings.tracking)
        if self._landmarks is not None:
            self._landmarks.reconfigure(settings.landmarks)
        if self._publisher is not None:
            self._publisher.reconfigure(settings.draw, settings.images)
        if self._recorder is not None:
            self._recorder.reconfigure(settings.draw)


def main_2d() -> None:
    """Run the service node under its 2D names."""
    run_node('openpose_ros_service_node', ServiceSettings,
             lambda settings: _make('detect_poses', 'openpose_ros', settings))


def main_3d() -> None:
    """Run the service node under its 3D names."""
    run_node('openpose_ros_service_node_3d', ServiceSettings,
             lambda settings: _make('detect_poses_3d', 'openpose_ros/skeleton_3d', settings))


def _settle_camera(settings: ServiceSettings) -> ServiceSettings:
    """Return settings with image topic and transport of the camera where none is given; `auto` waits for one."""
    stream, transport = settings.stream, settings.transport
    if stream.image_topic or not stream.camera:
        return settings
    camera = find_camera(stream.camera, stream.camera_ns, 2)
    if transport.image_transport == 'auto':
        transport = replace(transport, image_transport=camera.preset.image_transport)
    return replace(settings, stream=replace(stream, image_topic=camera.preset.topic('image', camera.ns)),
                   transport=transport)


def _make(service: str, namespace: str, settings: ServiceSettings) -> Tuple[DetectionService, LiveParameters]:
    """Return the service as a node of its own, and its dynamic_reconfigure server."""
    if (settings.landmarks.hands or settings.landmarks.face) and not (settings.publishing.publish_results
                                                                      or settings.save.active):
        raise ParameterError("parameters 'hands', 'face' are not allowed in a node that neither publishes "
                             '(publish_results) nor saves; set them where the results are published')
    settings = _settle_camera(settings)
    health, timing = Health(bad_input='bad image'), TimingReport(STAGES, result='total')
    health.show(timing.medians)
    demand = Demand(settings.demand.lazy and not settings.save.active, health)
    node = DetectionService(service, namespace, settings, health, timing, demand)
    node.warm_up(streams=False)
    live = LiveParameters(settings, LIVE_PARAMETERS, node.reconfigure)
    introduce(demand.inputs, **node.description)
    rospy.loginfo('Initialization Successful!')
    return node, live

"""The service node: finds the people in the images it is sent, publishes keypoints and the annotated image."""
import time
from concurrent.futures import Future
from dataclasses import replace
from typing import Dict, Iterator, NamedTuple, Optional, Tuple

import rospy
from openpose_ros_msgs.srv import GetPersons, GetPersonsRequest, GetPersonsResponse
from sensor_msgs.msg import Image

from openpose_ros_pkg.detect.detection import ImageFrame, NextPart
from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.image_chain import ImageChain
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.detect.tracking import TURNED_CAMERA
from openpose_ros_pkg.errors import BadInputError, ParameterError, StoppedError
from openpose_ros_pkg.params.camera_presets import info_beside
from openpose_ros_pkg.params.nodes import LIVE_PARAMETERS, ServiceSettings
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros import convert
from openpose_ros_pkg.ros.camera_info import CameraInfoPublisher
from openpose_ros_pkg.ros.cameras import find_camera
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.detection_output import DetectionOutput
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import AnyImage, image_subscriber, raw_image
from openpose_ros_pkg.ros.live_parameters import LiveParameters
from openpose_ros_pkg.ros.node import check_topic_name, introduce, run_node
from openpose_ros_pkg.ros.people_publisher import DRAW_STAGE, LANDMARK_STAGE
from openpose_ros_pkg.ros.timing_report import SEARCH_STAGE, TimingReport
from openpose_ros_pkg.stream.frame_loop import FrameLoop

# Stages of the timing report. Those before it add up to `total`, from the arrival of an image to the published result.
STAGES = ('wait', 'decode_message', 'detection', 'publish', 'total', LANDMARK_STAGE, SEARCH_STAGE, DRAW_STAGE)


class _Decoded(NamedTuple):
    frame: ImageFrame  # `source`: the message
    received: float  # when that came [s], time.monotonic()
    decoding: float  # time that decoding took [s]


class DetectionService:
    """Serves openpose_ros_msgs/GetPersons, and publishes and saves what it finds.

    It finds the people in the images of requests and, with `image_topic`, in those of a camera. Chains of this process
    use its `detection` in its `loop`. People keep their ids per camera: a client and a frame_id.

    Args:
        service: name of the service.
        namespace: prefix of the published topics.
        health, timing, demand: of the node; `timing` has STAGES.

    Attributes:
        detection: finds the people; for the thread of `loop` alone.
        loop: handles the images.
        output: publishes and saves the people.
        name: of the service, resolved.
    """

    def __init__(self, service: str, namespace: str, settings: ServiceSettings, health: Health, timing: TimingReport,
                 demand: Demand) -> None:
        self._settings, self._health, self._timing, self._demand = settings, health, timing, demand
        if settings.stream.image_topic:
            check_topic_name('image_topic', settings.stream.image_topic)
        self._detector = create_detector(settings.detector, settings.following)
        self.detection = NetworkDetection(self._detector, settings.following)
        self._chain = ImageChain(self.detection, settings.tracking)
        health.show_lasting(lambda: self._detector.faults)
        health.show(lambda: self._detector.not_installed)
        self.loop = FrameLoop(health.frame_failed)
        # a thread within a network would end the program with an abort
        rospy.on_shutdown(self.loop.stop)
        self.output = DetectionOutput(namespace, settings, self.whole_body, health, timing, demand)
        self._service = rospy.Service(service, GetPersons, self._serve)
        self.name = self._service.resolved_name
        if settings.stream.image_topic:
            self._subscribe(settings.stream.image_topic, namespace)

    def _subscribe(self, topic: str, namespace: str) -> None:
        self._input_publisher = self._demand.advertise(f'{namespace}/input_image', Image, queue_size=1)
        images = image_subscriber(topic, self._settings.transport.image_transport)
        inputs = [images]
        self._camera_info: Optional[CameraInfoPublisher] = None
        if self._settings.publishing.publish_results:
            self._camera_info = CameraInfoPublisher(namespace, info_beside(images.resolved_name), self._health,
                                                    self._demand)
            self._camera_info.degrees = self._settings.stream.rotate_image
            inputs.append(self._camera_info.input)
        self._skipped = 0
        self._health.show(lambda: {'images skipped': str(self._skipped)})
        images.registerCallback(self._submit)
        self._demand.read(*inputs)

    @property
    def whole_body(self) -> bool:
        """Whether the people have the points of a network for whole bodies, in every mode."""
        return self._detector.recipe.whole_body

    @property
    def description(self) -> Dict[str, str]:
        """What is at work, for `introduce`."""
        params, joints = self._settings.detector.detector, self._detector.skeleton.name
        crop_model = f', crop_model {params.crop_model}' if params.crop_model else ''
        return {'mode': f'{params.mode}, pose_model {params.pose_model}{crop_model}, joints {joints}',
                'networks': self._detector.recipe.description, 'runtime': self._detector.description,
                'people': self.detection.description,
                'target_rate': f'{params.target_rate:g} Hz' if params.target_rate > 0 else 'none'}

    def warm_up(self) -> None:
        """Compile the networks for the first image."""
        if self._settings.detector.detector.mode != 'accurate':  # for recordings, and slow
            self.loop.call(self.detection.warm_up)

    def _submit(self, message: AnyImage) -> None:
        self._skipped += self.loop.submit('', (message, time.monotonic()), self._handle)

    def _handle(self, arrived: Tuple[AnyImage, float]) -> Iterator[NextPart]:
        """Handle an image of the camera, and the time when it came."""
        message, received = arrived
        most, degrees = self._settings.limits.max_image_megapixels, self._settings.stream.rotate_image
        message = raw_image(message, most, degrees) if degrees else message
        decoded = self._decode(message, received)
        search = self._publish(decoded, self._look(decoded, in_full=False))
        if self._camera_info is not None:
            self._camera_info.publish(message.header, decoded.frame.size)
        if self._input_publisher.get_num_connections() > 0:
            self._input_publisher.publish(raw_image(message, most))
        return search

    def _serve(self, request: GetPersonsRequest) -> GetPersonsResponse:
        if not self._demand.enabled:
            raise rospy.ServiceException(f'{rospy.get_name()} is disabled; {rospy.get_name()}/enable enables it')
        image = request.image
        image.header.frame_id = frame_name(image.header.frame_id)
        try:
            decoded = self._decode(image, time.monotonic(), request._connection_header['callerid'])
            people = self.loop.request(decoded, self._answer)
        except (BadInputError, StoppedError) as error:
            self._health.frame_failed(error)
            raise rospy.ServiceException(str(error)) from error
        return GetPersonsResponse(convert.people_to_messages(people, image.header))

    def _answer(self, decoded: _Decoded, answer: 'Future[People2D]') -> Iterator[NextPart]:
        """Handle the image of a client, which gets the people before they are published."""
        people = self._look(decoded, in_full=not self._settings.following.follow_requests)
        answer.set_result(people)
        return self._publish(decoded, people)

    def _decode(self, message: AnyImage, received: float, sender: str = '') -> _Decoded:
        begin, header = time.monotonic(), message.header
        bgr = convert.any_image_to_bgr(message, self._settings.limits.max_image_megapixels)
        decoding = time.monotonic() - begin
        self._timing.add('decode_message', decoding)
        frame = ImageFrame((sender, header.frame_id), header.stamp.to_sec(), bgr, source=message)
        return _Decoded(frame, received, decoding)

    def _look(self, decoded: _Decoded, in_full: bool) -> People2D:
        begin = time.monotonic()
        people = self._chain.look(decoded.frame, in_full)
        if self._chain.mounting:
            self._health.warn(TURNED_CAMERA, self._chain.mounting)
        self._timing.add('wait', begin - decoded.received - decoded.decoding)
        self._timing.add('detection', time.monotonic() - begin)
        return people

    def _publish(self, decoded: _Decoded, people: People2D) -> Iterator[NextPart]:
        """Publish and save the people of an image; return the search of the rest of it."""
        frame = decoded.frame
        self.output.publish(frame, people)
        self._timing.add('total', time.monotonic() - decoded.received)
        self._health.frame_done(frame.source.header.stamp)
        self.output.complete(frame, people)
        return self._timing.timed_search(self._chain.search())

    def reconfigure(self, settings: ServiceSettings) -> None:
        """Take new parameters; for the thread of `loop`, see `FrameLoop.call`."""
        if settings.detector != self._settings.detector:
            self._detector.reconfigure(settings.detector)
            self.detection.reconfigure()
        self._settings = settings
        self._chain.reconfigure(settings.tracking)
        self.output.reconfigure(settings)


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
    node.warm_up()
    live = LiveParameters(settings, LIVE_PARAMETERS, lambda new: node.loop.call(lambda: node.reconfigure(new)))
    introduce(demand.inputs, **node.description)
    rospy.loginfo('Initialization Successful!')
    return node, live

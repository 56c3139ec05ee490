"""The extractor node: pairs images and points, and publishes what the chain knows of the people in them."""
import time
from dataclasses import replace
from typing import Dict, Iterator, NamedTuple, Optional, Tuple

import numpy as np
import rospy
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.detect.detection import Detection, ImageFrame, NextPart
from openpose_ros_pkg.detect.tracking import TrackingParams
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.landmarks.body_landmarks import BodyLandmarkNetwork, create_body_landmarks
from openpose_ros_pkg.landmarks.detector import LandmarkDetector, create_landmark_detector
from openpose_ros_pkg.networks.backends import BackendParams, LiveBackendParams
from openpose_ros_pkg.networks.models import joint_set
from openpose_ros_pkg.params.nodes import ImageTransportParams
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.camera_info import CameraInfoPublisher
from openpose_ros_pkg.ros.client.service_client import DetectionClient
from openpose_ros_pkg.ros.convert import turned_header
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.detection_output import DetectionOutput
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import AnyImage, InputSubscriber, image_subscriber, raw_image
from openpose_ros_pkg.ros.live_parameters import LiveParameters
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.ros.people_publisher import (
    DRAW_STAGE,
    LANDMARK_STAGE,
    Drawing,
    LandmarkPublisher,
    PeoplePublisher,
)
from openpose_ros_pkg.ros.timing_report import SEARCH_STAGE, TimingReport
from openpose_ros_pkg.stream.frame_loop import FrameLoop
from openpose_ros_pkg.stream.pairing import PairingParams
from openpose_ros_pkg.stream.stage_timing import Stopwatch
from skeleton_extract_3d.chain import IMAGE_TRACKING, PeopleChain, Result
from skeleton_extract_3d.estimator import STAGES as ESTIMATOR_STAGES
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.node_params import LIVE_PARAMETERS, ExtractorParams, ExtractorSettings
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.camera_inputs import input_topics, settle_camera
from skeleton_extract_3d.ros.floor_input import FloorInput
from skeleton_extract_3d.ros.frames import FrameTransforms, PointsMessage, points_from_message
from skeleton_extract_3d.ros.input_echo import InputEcho
from skeleton_extract_3d.ros.result_publisher import LandmarkStage, PeoplePublisher3D
from skeleton_extract_3d.ros.service_detection import ServiceDetection
from skeleton_extract_3d.ros.synchronizer import StampSynchronizer
from skeleton_extract_3d.ros.transforms import Transforms
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.show.report import frame_report

NAMESPACE = 'openpose_ros/skeleton_3d'
# A greater latency [s] is that of a recording played without its clock, and not reported.
_GREATEST_LATENCY = 10.0
_TF_TIMEOUT = 0.1  # least wait for the transform to another frame; a frame without it is dropped [s]
_REPORT_PERIOD = 1.0  # least time between two of the original's reports [s]
# Stages of the timing report whose durations add up to the age of a result; docs/ros_api.md says what each is.
AGE_STAGES = ('transport', 'wait', 'prepare', 'detection', 'locate', 'estimate', 'publish')
STAGES = (*AGE_STAGES[:-1], *ESTIMATOR_STAGES, AGE_STAGES[-1], 'total', 'age', LANDMARK_STAGE, SEARCH_STAGE, DRAW_STAGE)


class _Pair(NamedTuple):
    """Image and points of one moment."""

    received: float  # when the second of them arrived [s], time.monotonic()
    image: AnyImage
    points: PointsMessage


class Networks(NamedTuple):
    """What finds people, hands and faces for an extractor."""

    detection: Detection  # of people in images; used in the thread of `loop`
    name: str  # of the service that detects, or that offers this detection to others
    landmarks: LandmarkDetector  # finds hands and faces
    loop: FrameLoop  # handles the pairs
    output: Optional[DetectionOutput] = None  # takes the people in images, too
    target_rate: float = 0.0  # of the images [Hz]; 0: none
    camera: str = ''  # namespace of the camera, which tells those apart that share the detection
    tracking: TrackingParams = IMAGE_TRACKING  # in images, where people are not tracked in space
    bodies: Optional[BodyLandmarkNetwork] = None  # places people of images without depth


class Extractor:
    """Publishes the joints of all people in view, per person and per frame.

    The thread of a `FrameLoop` takes the newest pair of each camera in turn, finds its people and publishes them; then
    it searches the rest of the image, until the next pair comes. People are tracked for each frame_id of the points;
    ids are unique over these, but not over extractors.

    Args:
        settings: without `auto`, see `settle_camera`.
        networks: find people, hands and faces.
        health, timing, demand: of the node, or of one of its cameras; `timing` has STAGES.
    """

    def __init__(self, settings: ExtractorSettings, networks: Networks, health: Health, timing: TimingReport,
                 demand: Demand) -> None:
        self._params, self._networks = settings.extractor, networks
        self._max_megapixels = settings.limits.max_image_megapixels
        self._health, self._timing, self._demand = health, timing, demand
        self._last_report = -float('inf')
        self._received = self._skipped = 0  # images; pairs that a newer one replaced
        self._chain = PeopleChain(networks.detection, settings.estimator, networks.landmarks, networks.tracking,
                                  networks.bodies)
        self._chain.warm_up()
        frames = self._params.target_frame or self._params.tracking_frame
        lookup = Transforms(_TF_TIMEOUT).lookup if frames else None
        self._transforms = FrameTransforms(self._params, lookup)
        self._echo = InputEcho(NAMESPACE, health, demand)
        self._publisher = PeoplePublisher3D(NAMESPACE, self._transforms, self._params.publish_tf, demand)
        self._publisher_2d: Optional[PeoplePublisher] = None
        if self._params.publish_2d:
            self._publisher_2d = PeoplePublisher(NAMESPACE, settings.draw, settings.images, health, timing, demand)
        in_image = LandmarkPublisher(NAMESPACE if self._params.publish_2d else None, networks.landmarks,
                                     settings.landmarks, networks.target_rate, health, demand)
        self._landmarks = LandmarkStage(NAMESPACE, self._chain, self._transforms, in_image, health, demand)
        self._point_values: Dict[str, str] = {}
        self._health.show(lambda: self._point_values)
        self._health.show(lambda: {'frames skipped': str(self._skipped)})
        self._subscribe(settings.pairing, settings.transport)

    def _subscribe(self, pairing: PairingParams, transport: ImageTransportParams) -> None:
        topics = input_topics(self._params, self._networks.camera)
        self._camera_info = CameraInfoPublisher(NAMESPACE, topics.camera_info, self._health, self._demand,
                                                needed=self._params.points_source != 'point_cloud')
        self._camera_info.degrees = self._params.rotate_image
        images = image_subscriber(self._demand.resolve(topics.image), transport.image_transport)
        if self._params.points_source == 'none':
            points = images
        elif self._params.points_source == 'point_cloud':
            points = InputSubscriber(self._demand.resolve(topics.points), PointCloud2)
        else:
            points = image_subscriber(self._demand.resolve(topics.depth), self._params.depth_transport)
        images.start = points.start = self._camera_info.input.start = topics.driver_line
        if points is images:
            images.registerCallback(lambda image: self._submit(image, image))
        else:
            synchronizer = StampSynchronizer((images, points), pairing, self._health)
            synchronizer.registerCallback(self._submit)
            synchronizer.watch_pairs(self._demand.watch, (images, points), '{}:={}')
        images.registerCallback(self._count)
        self._health.show(lambda: {'images received': str(self._received)})
        by_tf = points is images and self._params.tracking_frame
        self._floor = FloorInput(self._demand.resolve('~floor')) if self._params.use_floor and not by_tf else None
        of_floor = [self._floor.input] if self._floor else []
        self._demand.read(self._camera_info.input, *dict.fromkeys((images, points)), *of_floor)

    def describe(self, estimator: EstimatorSettings) -> Dict[str, str]:
        """Return what is at work, for `introduce`."""
        params = self._params
        points = 'images alone' if params.points_source == 'none' else params.points_source
        switches = {'occlusion': estimator.occlusion.occlusion, 'tracking': estimator.identity.tracking,
                    'smoothing': estimator.smoothing.smoothing}
        return {'detection': f'by {self._networks.name}, joints {self._chain.skeleton.name}',
                'lifting': ', '.join([f'{estimator.lifting.lifting} from {points}',
                                      *(f'{name} {"on" if on else "off"}' for name, on in switches.items())]),
                'frames': f'joints in {params.target_frame or "the frame of the points"}, people followed in '
                          f'{params.tracking_frame or "the frame of the points"}'}

    def _count(self, image: AnyImage) -> None:
        self._received += not image.header.stamp.is_zero()

    def _submit(self, image: AnyImage, points: PointsMessage) -> None:
        pair = _Pair(time.monotonic(), image, points)
        self._skipped += self._networks.loop.submit(self._networks.camera, pair, self._handle)

    def _handle(self, pair: _Pair) -> Iterator[NextPart]:
        """Publish the people of a pair, then search the rest of its image."""
        try:
            self._compute(pair)
            yield from self._timing.timed_search(self._chain.search())
        except Exception as error:  # of this camera, not of those that share the loop
            self._health.frame_failed(error)

    def _compute(self, pair: _Pair) -> None:
        waited, clock = time.monotonic() - pair.received, Stopwatch()
        degrees = self._params.rotate_image
        image, header = raw_image(pair.image, self._max_megapixels, degrees), turned_header(pair.points.header, degrees)
        frame = self._frame(image, pair.points, header)
        clock.lap('prepare')

        def located(frame: Frame) -> Frame:
            clock.lap('detection')
            frame = replace(frame, tracking_from_points=self._transforms.tracking_from_points(header),
                            floor=self._floor.at(header) if self._floor else self._transforms.floor(header))
            clock.lap('locate')
            return frame

        self._echo.submit(frame, pair.points, header)
        result = self._chain.look(frame, locate=located)
        clock.lap('estimate')
        self._publish(result, header)
        clock.lap('publish')
        self._note({'wait': waited, **clock.laps, **result.timing}, waited + sum(clock.laps.values()), header)
        self._complete(result, header)

    def _frame(self, image: Image, points: PointsMessage, header: Header) -> Frame:
        """Return the frame of a pair, whose points have a header; BadInputError: a message can not be used."""
        bgr = convert_2d.image_to_bgr(image, self._max_megapixels)
        if self._params.points_source != 'point_cloud' and self._camera_info.newest is None:
            raise BadInputError(f'no camera info yet on {self._camera_info.source}')
        grid = points_from_message(points, self._camera_info.newest, self._params, self._max_megapixels)
        return Frame((self._networks.camera, header.frame_id), header.stamp.to_sec(), bgr, grid,
                     image_stamp=image.header.stamp.to_sec(), source=image)

    def _note(self, stages: Dict[str, float], total: float, header: Header) -> None:
        """Report how long the stages of a result took, which was published just now."""
        age = (rospy.get_rostime() - header.stamp).to_sec()
        if 0 <= age <= _GREATEST_LATENCY:
            stages = {**stages, 'transport': age - total, 'age': age}
        for stage, seconds in {**stages, 'total': total}.items():
            self._timing.add(stage, seconds)

    def _publish(self, result: Result, header: Header) -> None:
        """Publish the people of a frame whose points have a header."""
        self._report(result)
        image = result.frame.source
        if self._publisher_2d is not None:
            self._publisher_2d.publish(result.people_2d, image.header)
        if self._networks.output is not None:
            self._networks.output.publish(_image_of(result.frame), result.people_2d)
        self._camera_info.publish(image.header, (image.width, image.height),
                                  lambda: _camera_of(result.frame.grid, image))
        self._publisher.publish(result.people_3d, header)
        self._health.frame_done(header.stamp)

    def _complete(self, result: Result, header: Header) -> None:
        """Publish what takes longer: hands and faces, and the annotated image."""
        begin, of_image = time.monotonic(), result.frame.source.header
        drawn = self._publisher_2d is not None and self._publisher_2d.draws
        result = self._landmarks.publish(result, (of_image, header), drawn)
        self._timing.add(LANDMARK_STAGE, time.monotonic() - begin)
        if self._publisher_2d is not None:
            hidden = np.zeros(result.people_2d.present.shape, bool)
            hidden[:len(result.estimate.hidden)] = result.estimate.hidden
            self._publisher_2d.draw(Drawing(of_image, result.frame.image, result.people_2d, hidden,
                                            result.landmarks.in_image))
        if self._networks.output is not None:
            self._networks.output.complete(_image_of(result.frame), result.people_2d)

    def reconfigure(self, settings: ExtractorSettings) -> None:
        """Take new parameters; for the thread of the loop, see `FrameLoop.call`."""
        self._chain.reconfigure(settings.estimator)
        self._landmarks.reconfigure(settings.landmarks)
        if self._publisher_2d is not None:
            self._publisher_2d.reconfigure(settings.draw, settings.images)

    def _report(self, result: Result) -> None:
        points = result.estimate.points
        if points is not None:
            self._point_values = {'share of valid points': f'{points.valid:.3f}',
                                  'median depth of the points [m]': f'{points.depth:.3g}'}
        for doubt in result.doubts:
            self._health.warn(doubt.event, doubt.text)
        now = time.monotonic()
        if self._params.verbose and now - self._last_report >= _REPORT_PERIOD:
            self._last_report = now
            rospy.loginfo('%s', frame_report(result.estimate.people_2d, result.people_3d, result.frame.points))


def _image_of(frame: Frame) -> ImageFrame:
    return ImageFrame(frame.camera, frame.image_time, frame.image, source=frame.source)


def _camera_of(points: PointGrid, image: Image) -> Optional[CameraInfo]:
    """Return the camera info of an image by the camera of the points; None where they do not tell."""
    try:
        camera = points.camera_model()
        return camera and convert.camera_to_message(camera.scaled(image.width, image.height), image.header)
    except BadInputError:
        return None  # lifting by window needs no camera


def bodies_of(params: ExtractorParams, backend: BackendParams, model_folder: str = '') -> Optional[BodyLandmarkNetwork]:
    """Return what places people of images without depth; None where there is depth. Errors as `create_body_landmarks`.
    """
    return create_body_landmarks(backend, model_folder) if params.points_source == 'none' else None


def _make(settings: ExtractorSettings) -> Tuple[Extractor, LiveParameters]:
    """Return the extractor as a node of its own, and its dynamic_reconfigure server."""
    settings = settle_camera(settings)
    health, timing = Health(), TimingReport(STAGES, result='total')
    health.show(timing.medians)
    demand = Demand(settings.is_lazy, health)
    client = DetectionClient('~skeleton_2d_detector', settings.service)
    detection = ServiceDetection(client, joint_set(settings.extractor.pose_model))
    landmarks, loop = create_landmark_detector(settings.landmarks, LiveBackendParams()), FrameLoop(health.frame_failed)
    rospy.on_shutdown(client.end)
    rospy.on_shutdown(loop.stop)  # a thread within a network would end the program with an abort
    node = Extractor(settings, Networks(detection, client.name, landmarks, loop, bodies=bodies_of(
        settings.extractor, LiveBackendParams())), health, timing, demand)
    live = LiveParameters(settings, LIVE_PARAMETERS, lambda new: loop.call(lambda: node.reconfigure(new)))
    introduce(demand.inputs, **node.describe(settings.estimator))
    return node, live


def main() -> None:
    """Run the extractor node."""
    run_node('skeleton_extract_3d_node', ExtractorSettings, _make)

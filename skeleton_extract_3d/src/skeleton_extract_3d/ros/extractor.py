"""The extractor node: pairs images and points, and publishes what the chain knows of the people in them."""
import time
from dataclasses import dataclass
from typing import Dict, Generic, NamedTuple, Optional, Tuple, TypeVar

import numpy as np
import rospy
import tf2_ros
from openpose_ros_msgs.msg import PersonDetection_3d, PersonDetection_3dArray
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.detect.detection import Detection, Wanted
from openpose_ros_pkg.errors import BadInputError, NoTransformError
from openpose_ros_pkg.landmarks.detector import LandmarkDetector, create_landmark_detector
from openpose_ros_pkg.networks.backends import LiveBackendParams
from openpose_ros_pkg.networks.models import find_model
from openpose_ros_pkg.params.nodes import ImageTransportParams
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.camera_info import CameraInfoPublisher
from openpose_ros_pkg.ros.client.service_client import REQUEST_LEAD, DetectionClient
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import AnyImage, InputSubscriber, image_subscriber, raw_image
from openpose_ros_pkg.ros.live_parameters import LiveParameters
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.ros.people_publisher import (
    DRAW_STAGE,
    LANDMARK_STAGE,
    PERSONS_QUEUE,
    RESULTS_QUEUE,
    Drawing,
    LandmarkPublisher,
    PeoplePublisher,
)
from openpose_ros_pkg.ros.timing_report import TimingReport
from openpose_ros_pkg.stream.pairing import PairingParams
from openpose_ros_pkg.stream.pipeline import Pipeline, PipelineStages
from skeleton_extract_3d.chain import ComputedFrame, PeopleChain, PreparedFrame, Result
from skeleton_extract_3d.estimator import STAGES as ESTIMATOR_STAGES
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.node_params import LIVE_PARAMETERS, ExtractorSettings
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.plausibility import PointSummary
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.camera_inputs import input_topics, settle_camera
from skeleton_extract_3d.ros.floor_input import FloorInput
from skeleton_extract_3d.ros.frames import FrameTransforms, PointsMessage, points_from_message
from skeleton_extract_3d.ros.input_echo import InputEcho, InputFrame
from skeleton_extract_3d.ros.landmark_stage import LandmarkStage
from skeleton_extract_3d.ros.service_detection import ServiceDetection
from skeleton_extract_3d.ros.synchronizer import StampSynchronizer
from skeleton_extract_3d.ros.transforms import Transforms
from skeleton_extract_3d.settings import EstimatorSettings
from skeleton_extract_3d.show.report import frame_report

NAMESPACE = 'openpose_ros/skeleton_3d'
# A greater latency [s] is that of a recording played without its clock, and not reported.
_GREATEST_LATENCY = 10.0
_REPORT_PERIOD = 1.0  # least time between two of the original's reports [s]
# Stages of the timing report whose durations add up to the age of a result; docs/ros_api.md says what each is.
AGE_STAGES = ('transport', 'wait', 'prepare', 'detection', 'wait_for_lifting', 'estimate', 'publish')
STAGES = (*AGE_STAGES[:3], 'wait_for_network', 'network', 'decode', *AGE_STAGES[3:5], *ESTIMATOR_STAGES,
          *AGE_STAGES[5:], 'total', 'age', 'search', LANDMARK_STAGE, DRAW_STAGE)
State = TypeVar('State', PreparedFrame, ComputedFrame)


class _Pair(NamedTuple):
    """Image and points of one moment."""

    received: float  # when the second of them arrived [s], time.monotonic()
    image: AnyImage
    points: PointsMessage
    interval: float  # since the pair before, whatever became of that one [s]; inf: the first


class Networks(NamedTuple):
    """What finds people, hands and faces for an extractor."""

    detection: Detection  # of people in images
    name: str  # of the service that detects, or that offers this detection to others
    landmarks: LandmarkDetector  # finds hands and faces
    lead: float = 0.0  # of the detection, see `Pipeline` [s]
    target_rate: float = 0.0  # of the images [Hz]; 0: none
    camera: str = ''  # namespace of the camera, which tells those apart that share the detection


@dataclass(frozen=True, eq=False)
class _Step(Generic[State]):
    """A pair on its way through the pipeline."""

    pair: _Pair  # its image is raw
    state: State  # of its frame in the chain
    stages: Dict[str, float]  # duration of each stage so far [s]
    end: float  # of the newest stage [s], time.monotonic()


class Extractor:
    """Publishes the joints of all people in view, per person and per frame.

    While the networks see one frame, the next is prepared and the one before is lifted and published; then the networks
    search a frame for new people, until the next one comes. People are tracked for each frame_id of the points; ids are
    unique over these, but not over extractors.

    Args:
        settings: without `auto`, see `settle_camera`.
        networks: find people, hands and faces.
        health, timing, demand: of the node, or of one of its cameras; `timing` has STAGES.
    """

    def __init__(self, settings: ExtractorSettings, networks: Networks, health: Health, timing: TimingReport,
                 demand: Demand) -> None:
        self._params, self._networks = settings.extractor, networks
        self._most = settings.limits.max_image_megapixels
        self._health, self._timing, self._demand = health, timing, demand
        self._last_report = -float('inf')
        self._newest = -float('inf')  # stamp of the newest pair [s]
        self._chain = PeopleChain(networks.detection, settings.estimator, networks.landmarks)
        self._chain.warm_up()
        frames = self._params.target_frame or self._params.tracking_frame
        lookup = Transforms(self._params.tf_timeout).lookup if frames else None
        self._transforms = FrameTransforms(self._params, lookup)
        self._advertise()
        self._publisher_2d: Optional[PeoplePublisher] = None
        if self._params.publish_2d:
            self._publisher_2d = PeoplePublisher(NAMESPACE, settings.draw, settings.images, health, timing, demand)
        in_image = LandmarkPublisher(NAMESPACE if self._params.publish_2d else None, networks.landmarks,
                                     settings.landmarks, networks.target_rate, health, demand)
        self._landmarks = LandmarkStage(NAMESPACE, self._chain, self._transforms, in_image, demand)
        self._pipeline = Pipeline(PipelineStages(self._prepare, self._compute, self._finish, self._search, self._add),
                                  health.frame_failed, networks.detection.lock, networks.lead)
        self._summary: Optional[PointSummary] = None
        self._health.show(self._values_of_points)
        self._health.show(lambda: {'frames skipped': str(self._pipeline.replaced)})
        self._subscribe(settings.pairing, settings.transport)

    def stop(self) -> None:
        """Let what is computed end, and begin nothing any more."""
        self._pipeline.stop()

    def _advertise(self) -> None:
        self._echo = InputEcho(NAMESPACE, self._health, self._demand)
        self._person_publisher = self._demand.advertise(f'{NAMESPACE}/detected_poses_keypoints_3d', PersonDetection_3d,
                                                        queue_size=PERSONS_QUEUE)
        self._array_publisher = self._demand.advertise(f'{NAMESPACE}/detected_poses_3d', PersonDetection_3dArray,
                                                       queue_size=RESULTS_QUEUE)
        if self._params.publish_tf:
            self._tf_broadcaster = tf2_ros.TransformBroadcaster()

    def _subscribe(self, pairing: PairingParams, transport: ImageTransportParams) -> None:
        topics = input_topics(self._params, self._networks.camera)
        self._camera_info = CameraInfoPublisher(NAMESPACE, topics.camera_info, self._health, self._demand,
                                                needed=self._params.points_source == 'depth_image')
        images = image_subscriber(self._demand.resolve(topics.image), transport.image_transport)
        if self._params.points_source == 'point_cloud':
            points = InputSubscriber(self._demand.resolve(topics.points), PointCloud2)
        else:
            points = image_subscriber(self._demand.resolve(topics.depth), self._params.depth_transport)
        images.start = points.start = self._camera_info.input.start = topics.driver_line
        self._synchronizer = StampSynchronizer((images, points), pairing, self._health)
        self._synchronizer.registerCallback(self._submit)
        self._synchronizer.watch_pairs(self._demand.watch, (images, points), '{}:={}')
        self._health.show(lambda: {'images received': str(self._synchronizer.received[0])})
        self._floor = FloorInput(self._demand.resolve('~floor')) if self._params.use_floor else None
        self._demand.read(self._camera_info.input, images, points, *([self._floor.input] if self._floor else []))

    def describe(self, estimator: EstimatorSettings) -> Dict[str, str]:
        """Return what is at work, for `introduce`."""
        params = self._params
        switches = {'occlusion': estimator.occlusion.occlusion, 'tracking': estimator.identity.tracking,
                    'smoothing': estimator.smoothing.smoothing}
        return {'detection': f'by {self._networks.name}, joints {self._chain.skeleton.name}',
                'lifting': ', '.join([f'{estimator.lifting.lifting} from {params.points_source}',
                                      *(f'{name} {"on" if on else "off"}' for name, on in switches.items())]),
                'frames': f'joints in {params.target_frame or "the frame of the points"}, people followed in '
                          f'{params.tracking_frame or "the frame of the points"}'}

    def _submit(self, image: AnyImage, points: PointsMessage) -> None:
        stamp = points.header.stamp.to_sec()
        interval, self._newest = stamp - self._newest, stamp
        self._pipeline.submit(_Pair(time.monotonic(), image, points, interval))

    def _prepare(self, pair: _Pair) -> _Step[PreparedFrame]:
        begin, image = time.monotonic(), raw_image(pair.image, self._most)
        bgr = convert_2d.image_to_bgr(image, self._most)
        header = pair.points.header
        frame = Frame((self._networks.camera, header.frame_id), header.stamp.to_sec(), bgr, self._points(pair.points),
                      image_stamp=image.header.stamp.to_sec(), source=image, interval=pair.interval)
        prepared, end = self._chain.prepare(frame), time.monotonic()
        return _Step(pair._replace(image=image), prepared, {'wait': begin - pair.received, 'prepare': end - begin}, end)

    def _compute(self, step: _Step[PreparedFrame]) -> _Step[ComputedFrame]:
        begin, pair, frame = time.monotonic(), step.pair, step.state.frame
        self._echo.submit(InputFrame(pair.image, frame.bgr, pair.points, frame.points))
        computed, stages = self._chain.compute(step.state), dict(step.stages)
        end = time.monotonic()
        network = getattr(computed.found, 'network_seconds', None)
        if network is not None:
            stages.update(wait_for_network=begin - step.end, network=network, decode=end - begin - network)
        return _Step(pair, computed, {**stages, 'detection': end - step.end}, end)

    def _finish(self, step: _Step[ComputedFrame]) -> Tuple[Result, _Pair]:
        """Lift and publish the people of a pair, and report the duration of each stage."""
        begin, pair = time.monotonic(), step.pair
        header, image = pair.points.header, pair.image
        result = self._chain.finish(step.state)
        found = time.monotonic()
        result = result.located(self._transforms.tracking_from_points(header),
                                self._floor.at(header) if self._floor else None)
        located = time.monotonic()
        result = self._chain.lift(result)
        estimated = time.monotonic()
        self._report(result)
        if self._publisher_2d is not None:
            self._publisher_2d.publish(convert_2d.people_to_messages(result.people_2d, image.header), image.header,
                                       result.people_2d.skeleton)
        points = result.frame.points
        self._camera_info.publish(image.header, (image.width, image.height), lambda: _camera_of(points, image))
        self._publish(result.people_3d, header)
        end = time.monotonic()
        detecting = {stage: seconds + (found - begin if stage in ('detection', 'decode') else 0.0)
                     for stage, seconds in step.stages.items()}
        self._note({**detecting, 'wait_for_lifting': begin - step.end + located - found, **result.timing,
                    'estimate': estimated - located, 'publish': end - estimated, 'total': end - pair.received}, header)
        return result, pair

    def _search(self, step: _Step[ComputedFrame], wanted: Wanted) -> None:
        begin = time.monotonic()
        if self._chain.search(step.state, wanted):
            self._timing.add('search', time.monotonic() - begin)

    def _add(self, published: Tuple[Result, _Pair]) -> None:
        """Publish what takes longer: hands and faces, and the annotated image."""
        begin, (result, pair) = time.monotonic(), published
        result = self._with_landmarks(result, (pair.image.header, pair.points.header))
        self._timing.add(LANDMARK_STAGE, time.monotonic() - begin)
        self._draw(result, pair.image.header)

    def _note(self, stages: Dict[str, float], header: Header) -> None:
        """Report how long the stages of a result took, which was published just now."""
        age = (rospy.get_rostime() - header.stamp).to_sec()
        if 0 <= age <= _GREATEST_LATENCY:
            stages = {**stages, 'transport': age - stages['total'], 'age': age}
        for stage, seconds in stages.items():
            self._timing.add(stage, seconds)

    def _points(self, message: PointsMessage) -> PointGrid:
        if self._params.points_source == 'depth_image' and self._camera_info.newest is None:
            raise BadInputError(f'no camera info yet on {self._camera_info.source}')
        return points_from_message(message, self._camera_info.newest, self._params, self._most)

    def _publish(self, people: People3D, cloud_header: Header) -> None:
        people, header = self._transforms.in_target_frame(people, cloud_header)
        array = convert.people_to_array(people, header)
        self._array_publisher.publish(array)
        for person in array.persons:
            self._person_publisher.publish(person)
        if self._params.publish_tf and len(people) > 0:
            self._tf_broadcaster.sendTransform(convert.people_to_transforms(people, header))
        self._health.frame_done(header.stamp)

    def _with_landmarks(self, result: Result, headers: Tuple[Header, Header]) -> Result:
        """Publish hands and faces of a frame, with the headers of image and points; return the result with them."""
        drawn = self._publisher_2d is not None and self._publisher_2d.draws
        try:
            return self._landmarks.publish(result, headers, drawn)
        except NoTransformError:  # publishing the people says so
            return result
        except Exception as error:  # people are published whatever becomes of hands and faces
            self._health.warn('no hands and faces', str(error) if isinstance(error, BadInputError) else repr(error))
            return result

    def _draw(self, result: Result, header: Header) -> None:
        if self._publisher_2d is not None:
            hidden = np.zeros(result.people_2d.present.shape, bool)
            hidden[:len(result.estimate.hidden)] = result.estimate.hidden
            self._publisher_2d.draw(Drawing(header, result.frame.bgr, result.people_2d, hidden,
                                            result.landmarks.in_image))

    def reconfigure(self, settings: ExtractorSettings) -> None:
        """Take new parameters; they hold from the next frame on."""
        self._chain.reconfigure(settings.estimator)
        self._landmarks.reconfigure(settings.landmarks)
        if self._publisher_2d is not None:
            self._publisher_2d.reconfigure(settings.draw, settings.images)

    def _report(self, result: Result) -> None:
        self._summary = result.estimate.points
        for doubt in result.doubts:
            self._health.warn(doubt.event, doubt.text)
        now = time.monotonic()
        if self._params.verbose and now - self._last_report >= _REPORT_PERIOD:
            self._last_report = now
            rospy.loginfo('%s', frame_report(result.estimate.people_2d, result.people_3d, result.frame.points))

    def _values_of_points(self) -> Dict[str, str]:
        summary = self._summary
        return {} if summary is None else {'share of valid points': f'{summary.valid:.3f}',
                                           'median depth of the points [m]': f'{summary.depth:.3g}'}


def _camera_of(points: PointGrid, image: Image) -> Optional[CameraInfo]:
    """Return the camera info of an image by the camera of the points; None where they do not tell."""
    try:
        camera = points.camera_model()
        return camera and convert.camera_to_message(camera.scaled(image.width, image.height), image.header)
    except BadInputError:
        return None  # lifting by window needs no camera


def _make(settings: ExtractorSettings) -> Tuple[Extractor, LiveParameters]:
    """Return the extractor as a node of its own, and its dynamic_reconfigure server."""
    settings = settle_camera(settings)
    health, timing = Health(), TimingReport(STAGES, result='total')
    health.show(timing.medians)
    demand = Demand(settings.is_lazy, health)
    client = DetectionClient('~skeleton_2d_detector', settings.service)
    detection = ServiceDetection(client, find_model(settings.extractor.pose_model).skeleton)
    networks = Networks(detection, client.name, create_landmark_detector(settings.landmarks, LiveBackendParams()),
                        REQUEST_LEAD)
    node = Extractor(settings, networks, health, timing, demand)
    live = LiveParameters(settings, LIVE_PARAMETERS, node.reconfigure)
    introduce(demand.inputs, **node.describe(settings.estimator))
    return node, live


def main() -> None:
    """Run the extractor node."""
    run_node('skeleton_extract_3d_node', ExtractorSettings, _make)

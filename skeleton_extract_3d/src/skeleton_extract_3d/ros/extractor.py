"""The extractor node: pairs images and points, calls the detection service, and tracks people in 3D."""
import threading
import time
from typing import NamedTuple, Optional

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from openpose_ros_msgs.msg import PersonDetection_3d, PersonDetection_3dArray
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.networks.models import find_model
from openpose_ros_pkg.params.nodes import ImageTransportParams
from openpose_ros_pkg.ros import convert as convert_2d
from openpose_ros_pkg.ros.camera_info import CameraInfoPublisher
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import AnyImage, InputSubscriber, image_subscriber, raw_image
from openpose_ros_pkg.ros.live_parameters import LiveParameters
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.ros.people_publisher import DRAW_STAGE, PERSONS_QUEUE, PeoplePublisher
from openpose_ros_pkg.ros.service_client import DetectionClient, ServiceCallError
from openpose_ros_pkg.ros.timing_report import TimingReport
from openpose_ros_pkg.stream.newest_wins import NewestWinsWorker
from openpose_ros_pkg.stream.pairing import PairingParams
from openpose_ros_pkg.stream.stage_timing import Stopwatch
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.estimator import STAGES, Estimate
from skeleton_extract_3d.node_params import LIVE_PARAMETERS, ExtractorSettings
from skeleton_extract_3d.people import INFERRED, People3D
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.floor_input import FloorInput
from skeleton_extract_3d.ros.input_echo import InputEcho, InputFrame
from skeleton_extract_3d.ros.lifter import Lifter, PointsMessage
from skeleton_extract_3d.ros.synchronizer import StampSynchronizer
from skeleton_extract_3d.show.report import frame_report

# Period at which the node checks that its inputs arrive and pair [s].
WATCH_PERIOD = 5.0
_NAMESPACE = 'openpose_ros/skeleton_3d'
# Stages of the timing report. estimate: the sum of the estimator's stages, which precede it; total: from the callback
# that found the pair to the published result; age: latency, from the stamp of the points to the published result.
_STAGES = ('detection', *STAGES, 'estimate', 'publish', 'total', 'age', DRAW_STAGE)
# A greater latency [s] is that of a recording played without its clock, and not reported.
_GREATEST_LATENCY = 10.0


class _Pair(NamedTuple):
    """Image and points of one moment.

    Attributes:
        received: when the second of them arrived [s], time.monotonic().
    """

    received: float
    image: AnyImage
    points: PointsMessage


class Extractor:
    """Publishes the joints of everybody in view, per person and per frame.

    People are tracked per camera; the frame_id of the points names the camera. Ids are unique over all cameras.
    """

    def __init__(self, settings: ExtractorSettings) -> None:
        self._params = settings.extractor
        self._health = Health()
        self._timing = TimingReport(_STAGES, result='total')
        self._health.show(self._timing.medians)
        self._client = DetectionClient('~skeleton_2d_detector', settings.service)
        self._last_report = -float('inf')
        self._chain = PeopleChain(find_model(self._params.pose_model).skeleton, settings.estimator)
        self._lifter = Lifter(self._params, self._chain, self._lookup)
        self._demand = Demand(settings.demand.lazy and not (self._params.publish_tf or self._params.verbose),
                              self._health)
        self._advertise()
        self._publisher_2d: Optional[PeoplePublisher] = None
        if self._params.publish_2d:
            self._publisher_2d = PeoplePublisher(_NAMESPACE, settings.draw, settings.images, self._health, self._timing,
                                                 self._demand)
        self._live = LiveParameters(settings, LIVE_PARAMETERS, self._reconfigure)
        self._worker = NewestWinsWorker(self._process, self._failed, 'extractor')
        self._subscribe(settings.pairing, settings.transport)
        self._introduce(settings)
        threading.Thread(target=self._watch_inputs, name='input watch', daemon=True).start()

    def _advertise(self) -> None:
        self._echo = InputEcho(_NAMESPACE, self._health, self._demand)
        self._person_publisher = self._demand.advertise(f'{_NAMESPACE}/detected_poses_keypoints_3d', PersonDetection_3d,
                                                        queue_size=PERSONS_QUEUE)
        self._array_publisher = self._demand.advertise(f'{_NAMESPACE}/detected_poses_3d', PersonDetection_3dArray,
                                                       queue_size=10)
        if self._params.publish_tf:
            self._tf_broadcaster = tf2_ros.TransformBroadcaster()

    def _subscribe(self, pairing: PairingParams, transport: ImageTransportParams) -> None:
        if self._params.target_frame or self._params.tracking_frame:
            self._tf_buffer = tf2_ros.Buffer()
            self._tf_listener = tf2_ros.TransformListener(self._tf_buffer)
        self._camera_info = CameraInfoPublisher(_NAMESPACE, '~camera_info', self._health, self._demand)
        images = image_subscriber('~image', transport.image_transport)
        if self._params.points_source == 'point_cloud':
            points = InputSubscriber('~point_cloud', PointCloud2)
        else:
            points = image_subscriber('~depth_image', self._params.depth_transport)
        self._inputs = (images, points)
        self._synchronizer = StampSynchronizer(self._inputs, pairing, self._health)
        self._synchronizer.registerCallback(self._submit)
        self._floor = FloorInput() if self._params.use_floor else None
        self._demand.read(self._camera_info.input, *self._inputs, *([self._floor.input] if self._floor else []))

    def _introduce(self, settings: ExtractorSettings) -> None:
        params, estimator = settings.extractor, settings.estimator
        switches = {'occlusion': estimator.occlusion.occlusion, 'tracking': estimator.identity.tracking,
                    'smoothing': estimator.smoothing.smoothing}
        introduce(self._demand.inputs, detection=f'by {self._client.name}, joints {self._chain.skeleton.name}',
                  lifting=', '.join([f'{estimator.lifting.lifting} from {params.points_source}',
                                     *(f'{name} {"on" if on else "off"}' for name, on in switches.items())]),
                  frames=f'joints in {params.target_frame or "the frame of the points"}, people followed in '
                         f'{params.tracking_frame or "the frame of the points"}')

    def _submit(self, image: AnyImage, points: PointsMessage) -> None:
        self._worker.submit(_Pair(time.monotonic(), image, points))

    def _process(self, pair: _Pair) -> None:
        """Detect, estimate and publish the people of a pair, and report the duration of each stage."""
        image, header = raw_image(pair.image), pair.points.header
        points, bgr = self._points(pair.points), convert_2d.image_to_bgr(image)
        self._echo.submit(InputFrame(image, bgr, pair.points, points))
        stopwatch = Stopwatch()
        detections = self._client.detect(image)
        stopwatch.lap('detection')
        tracking_from_points = self._lifter.tracking_from_points(header)
        stopwatch.restart()
        floor = self._floor.at(header) if self._floor else None
        estimate = self._lifter.estimate(detections, points, header, bgr, tracking_from_points, floor)
        stopwatch.lap('estimate')
        self._report(estimate, points)
        stopwatch.restart()
        self._publish_2d(estimate, image.header, bgr)
        self._camera_info.publish(image.header, (image.width, image.height), lambda: _camera_of(points, image))
        self._publish(estimate.people, header)
        stopwatch.lap('publish')
        latency = (rospy.get_rostime() - header.stamp).to_sec()
        stages = {**stopwatch.laps, **estimate.timing, 'total': time.monotonic() - pair.received}
        if 0 <= latency <= _GREATEST_LATENCY:
            stages['age'] = latency
        for stage, seconds in stages.items():
            self._timing.add(stage, seconds)

    def _points(self, message: PointsMessage) -> PointGrid:
        if self._params.points_source == 'depth_image' and self._camera_info.newest is None:
            raise BadInputError(f'no camera info yet on {self._camera_info.source}')
        return self._lifter.points(message, self._camera_info.newest)

    def _lookup(self, target: str, source: str, stamp: rospy.Time) -> TransformStamped:
        return self._tf_buffer.lookup_transform(target, source, stamp, rospy.Duration(self._params.tf_timeout))

    def _publish(self, people: People3D, cloud_header: Header) -> None:
        people, header = self._lifter.in_target_frame(people, cloud_header)
        array = convert.people_to_array(people, header)
        self._array_publisher.publish(array)
        for person in array.persons:
            self._person_publisher.publish(person)
        if self._params.publish_tf and len(people) > 0:
            self._tf_broadcaster.sendTransform(convert.people_to_transforms(people, header))
        self._health.frame_done(header.stamp)

    def _publish_2d(self, estimate: Estimate, header: Header, bgr: np.ndarray) -> None:
        if self._publisher_2d is not None:
            people = estimate.people_2d
            self._publisher_2d.publish(people, convert_2d.people_to_messages(people, header), header, bgr,
                                       hidden=estimate.people.status[:len(people)] == INFERRED)

    def _reconfigure(self, settings: ExtractorSettings) -> None:
        """Take new parameters; they hold from the next frame on."""
        self._chain.reconfigure(settings.estimator)
        if self._publisher_2d is not None:
            self._publisher_2d.reconfigure(settings.draw, settings.images)

    def _report(self, estimate: Estimate, points: PointGrid) -> None:
        now = time.monotonic()
        if self._params.verbose and now - self._last_report >= self._params.verbose_period:
            self._last_report = now
            rospy.loginfo('%s', frame_report(estimate.people_2d, estimate.people, points))

    def _failed(self, error: Exception) -> None:
        if isinstance(error, ServiceCallError):
            self._health.warn('service call failed', str(error))
        elif isinstance(error, BadInputError):
            self._health.warn('bad input', str(error))
        elif isinstance(error, tf2_ros.TransformException):
            self._health.warn('no transform', f'the frame is dropped: {error}')
        else:
            self._health.warn('frame failed', repr(error))

    def _watch_inputs(self) -> None:
        names = [source.resolved_name for source in self._inputs]
        before, pairs_before = (0, 0), 0
        while not rospy.is_shutdown():
            time.sleep(WATCH_PERIOD)
            received, pairs = self._synchronizer.received, self._synchronizer.pairs
            if self._demand.seconds < WATCH_PERIOD:
                before, pairs_before = received, pairs
                continue
            came = [now > then for now, then in zip(received, before)]
            if came[0] != came[1]:
                there, absent = (names[0], names[1]) if came[0] else (names[1], names[0])
                self._health.warn('input missing', f'messages come on {there} but none on {absent}')
            elif all(came) and pairs == pairs_before:
                self._health.warn('no pairs', f'{names[0]} and {names[1]} both come, but no two stamps are within '
                                              f'{self._synchronizer.slop:.3f} s of each other')
            before, pairs_before = received, pairs


def _camera_of(points: PointGrid, image: Image) -> Optional[CameraInfo]:
    """Return the camera info of an image by the camera of the points; None where they do not tell."""
    try:
        camera = points.camera_model()
        return camera and convert.camera_to_message(camera.scaled(image.width, image.height), image.header)
    except BadInputError:
        return None  # lifting by window needs no camera


def main() -> None:
    """Run the extractor node."""
    run_node('skeleton_extract_3d_node', ExtractorSettings, Extractor)

"""From a bag to its results: each frame once, in order."""
import itertools
import logging
from collections import deque
from concurrent.futures import Future
from contextlib import ExitStack, closing
from dataclasses import astuple, replace
from pathlib import Path
from typing import Any, Callable, Deque, Dict, Iterable, Iterator, List, NamedTuple, Optional, Tuple, Union

import genpy
import rosbag

from openpose_ros_pkg.detect.detection import DepthView
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.errors import BadInputError, ModelError, NoTransformError
from openpose_ros_pkg.landmarks.detector import create_landmark_detector
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.ros import convert
from openpose_ros_pkg.throttle import Throttle
from openpose_ros_tools.outputs import PartFiles
from openpose_ros_tools.parallel.detector_pool import DetectorPool, with_threads
from openpose_ros_tools.parallel.threads import prefetched
from openpose_ros_tools.ros.bag_files import StampedMessage, open_bag, topic_types
from openpose_ros_tools.ros.camera_topics import TopicFinder, is_within
from openpose_ros_tools.ros.process_bag.input import Frame, Recording, Transforms, copied_topics, find_topics
from openpose_ros_tools.ros.process_bag.job import BagJob, BagReport, BagSettings, Topics, build_settings
from openpose_ros_tools.ros.process_bag.output import Published, Results, finished_record, is_json_of
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.points.depth_view import depth_view
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.ros.lifter import Lifter, camera_frame

_log = logging.getLogger(__name__)

# Number of frames that are read before they are needed, and bytes of copied messages that wait for earlier frames.
_AHEAD = 3
_MOST_COPIED = 256 << 20
_Event = Union[Frame, BadInputError, StampedMessage]


def process(job: BagJob, on_frame: Callable[[int, int], None] = lambda done, total: None) -> BagReport:
    """Make the results of a bag; they appear all at once, at the end.

    Args:
        on_frame: gets the number of images that are done, and of all.

    Raises:
        BadInputError: the bag can not be read, has not what is wanted, or no frame gave a result.
        ParameterError, ModelError: a parameter or a network is wrong.
        ProcessLostError: processes end again and again.
        OSError: a result can not be written.
    """
    settings = build_settings(job.values)
    made = finished_record(job) or job.made_from()
    with ExitStack() as stack:
        view = open_view(job, settings, stack)
        networks = Networks(job, settings, stack)
        parts = stack.enter_context(PartFiles(job.run))
        json = None if job.json is None else parts.folder(job.json, lambda name: is_json_of(job.source.stem, name))
        csv = None if job.csv is None else parts.file(job.csv)
        # the bag is the last one to be moved: where it is, all outputs are
        unfinished = replace(job, output=parts.file(job.output), csv=csv, json=json)
        return process_camera(unfinished, view, made, networks, on_frame)


class View(NamedTuple):
    """An open bag, the topics of the camera in it, and those to copy."""

    bag: rosbag.Bag
    topics: Topics
    copied: List[str]

    @property
    def images(self) -> int:
        """Number of images."""
        return self.bag.get_message_count(self.topics.image)


def open_view(job: BagJob, settings: BagSettings, stack: ExitStack) -> View:
    """Open the bag of a camera and find its topics.

    Raises:
        BadInputError: the bag can not be read, or has not what is wanted.
    """
    bag = stack.enter_context(open_bag(job.source))
    namespace = job.camera
    if namespace and job.is_alone and not any(is_within(topic, namespace) for topic in topic_types(bag)):
        namespace = ''
    finder = TopicFinder(bag, namespace)
    if not finder.types and namespace:
        raise BadInputError(f'{job.source} has no topics in the namespace /{namespace}; it has '
                            f"{', '.join(sorted(topic_types(bag)))}")
    topics = job.topics
    if namespace:
        topics = Topics(*(topic and f"/{namespace}/{topic.strip('/')}" for topic in astuple(topics)))
    found = find_topics(finder, topics, job.only_2d, settings.extractor.points_source == 'depth_image')
    if job.camera and not found.in_space:
        beside = topics.camera_info or finder.camera_info_of(found.image) or ''
        found = replace(found, camera_info=finder.required('camera_info', beside, finder.candidates['camera_info']))
    return View(bag, found, copied_topics(bag, job.copied))


class Networks:
    """What finds people, hands and faces in the images of any number of cameras.

    Args:
        job: of one of the cameras.
        settings: of all.
        stack: ends the processes.

    Attributes:
        settings: those.
        pool: what finds people in several images at a time; None where chains follow them, one image at a time.

    Raises:
        ParameterError, ModelError: a parameter or a network is wrong.
    """

    def __init__(self, job: BagJob, settings: BagSettings, stack: ExitStack) -> None:
        self.settings = settings
        detector = with_threads(settings.detector, job.threads)
        self._landmarks = create_landmark_detector(settings.landmarks, detector.backend, detector.detector.model_folder)
        if self._landmarks.missing:
            raise ModelError(self._landmarks.faults)
        self.pool: Optional[DetectorPool] = None
        self._detector: Optional[Detector] = None
        if settings.following.wanted(detector.detector):
            self._detector = job.create(detector)
        else:
            self.pool = stack.enter_context(DetectorPool(job.jobs, detector, job.create))

    def chain(self) -> PeopleChain:
        """Return the chain of a camera that nobody has seen yet."""
        settings, landmarks = self.settings, self._landmarks
        if self._detector is not None:
            stream = NetworkDetection(self._detector, settings.tracking, settings.following)
            return PeopleChain(stream.skeleton, settings.estimator, stream=stream, landmarks=landmarks)
        return PeopleChain(self.pool.skeleton, settings.estimator, settings.tracking, landmarks=landmarks)


def process_camera(job: BagJob, view: View, made: Dict[str, Any], networks: Networks,
                   on_frame: Callable[[int, int], None]) -> BagReport:
    """Write the results of a camera; arguments and errors as `process`.

    Args:
        job: its outputs are written in place.
        view: of the camera.
        made: what the results are made from.
    """
    settings, images, chain = networks.settings, view.images, networks.chain()
    with ExitStack() as stack:
        lifter, transforms = _lifter(job.source, settings, view.topics, chain, stack)
        results = stack.enter_context(Results(job, settings, view.topics.in_space))
        recording = Recording(*view, settings.pairing, lifter, settings.limits.max_image_megapixels)
        frames = _Frames(chain, lifter, transforms, results, BagReport(counts=recording.counts, topics=view.topics))
        events = stack.enter_context(closing(prefetched(recording, _AHEAD)))
        for done in frames.run(events, networks.pool):
            on_frame(min(done, images), images)
        results.record(made, genpy.Time.from_sec(view.bag.get_start_time()))
        on_frame(images, images)
    if frames.report.frames == 0:
        raise BadInputError(f'{job.source} gave no frame with a result: {frames.report.text()}')
    return frames.report


def _lifter(source: Path, settings: BagSettings, topics: Topics, chain: PeopleChain,
            stack: ExitStack) -> Tuple[Optional[Lifter], Optional[Transforms]]:
    """Return what lifts, and the transforms where some are wanted; None in 2D."""
    if not topics.in_space:
        return None, None
    extractor = replace(settings.extractor, points_source='depth_image' if topics.depth else 'point_cloud')
    most = settings.limits.max_image_megapixels
    if not (extractor.target_frame or extractor.tracking_frame):
        return Lifter(extractor, chain, None, most), None  # nothing is looked up
    transforms = Transforms(stack.enter_context(open_bag(source)))
    return Lifter(extractor, chain, transforms.lookup, most), transforms


class _Frames:
    """Finds the people of frames and writes them; see `process`."""

    def __init__(self, chain: PeopleChain, lifter: Optional[Lifter], transforms: Optional[Transforms],
                 results: Results, report: BagReport) -> None:
        self._chain, self._lifter, self._transforms, self._results = chain, lifter, transforms, results
        self._numbers, self._throttle = itertools.count(), Throttle()
        self.report = report

    def run(self, events: Iterable[_Event], pool: Optional[DetectorPool]) -> Iterator[int]:
        """Process all frames; yield the number of images that are done, after each frame."""
        # with the people of frames, which are being found
        waiting: Deque[Tuple[_Event, Optional[Future[People2D]]]] = deque()
        frames = copied = 0
        capacity = 0 if pool is None else pool.capacity
        for event in itertools.chain(events, (None,)):
            if event is not None:
                searched = (pool.submit(event.bgr, _depth_of(event)) if pool is not None and isinstance(event, Frame)
                            else None)
                waiting.append((event, searched))
                frames += isinstance(event, Frame)
                copied += len(event.raw[1]) if isinstance(event, StampedMessage) else 0
            while waiting and (event is None or frames > capacity or copied > _MOST_COPIED
                               or waiting[0][1] is None or waiting[0][1].done()):
                first, people = waiting.popleft()
                if isinstance(first, StampedMessage):
                    self._results.copy(first)
                    copied -= len(first.raw[1])
                    continue
                number = next(self._numbers)
                self._finish(first, people, number)
                frames -= isinstance(first, Frame)
                yield number + 1 + self.report.counts.alone[0]

    def _finish(self, frame: Union[Frame, BadInputError], found: Optional['Future[People2D]'], number: int) -> None:
        """Write the results of a frame, or count why there are none."""
        try:
            if isinstance(frame, BadInputError):
                raise frame
            people = self._in_image(frame, found)
            if self._lifter is not None and frame.points is not None:
                count = self._lift(self._lifter, frame, frame.points, number, people)
            else:
                header = frame.header
                landmarks = self._chain.landmarks_in_image(frame.bgr, people, header.frame_id, header.stamp.to_sec())
                self._results.write_2d(frame, number, people, landmarks)
                count = len(people)
        except BadInputError as error:
            self._drop('they can not be used', error, number)
        except NoTransformError as error:
            self._drop('no transform', error, number)
        else:
            self.report.frames += 1
            self.report.people += count

    def _in_image(self, frame: Frame, found: Optional['Future[People2D]']) -> People2D:
        stamp = frame.header.stamp.to_sec()
        if found is not None:
            return self._chain.in_image(found.result(), frame.header.frame_id, stamp)
        camera = frame.header if frame.points_header is None else frame.points_header
        return self._chain.detect(frame.bgr, camera.frame_id, stamp, _depth_of(frame))

    def _lift(self, lifter: Lifter, frame: Frame, points: PointGrid, number: int, people_2d: People2D) -> int:
        """Write the people of a frame in the image and in space; return their number. The steps of the extractor."""
        if self._transforms is not None:
            self._transforms.read_until(frame.time)
        # through messages, as the service answers
        detections = convert.people_to_messages(people_2d, frame.header)
        camera = camera_frame(frame.bgr, points, frame.points_header,
                              lifter.tracking_from_points(frame.points_header))
        estimate = lifter.estimate(detections, camera)
        landmarks = self._chain.landmarks(frame.bgr, estimate, camera)
        for doubt in estimate.doubts:
            self.report.doubts[doubt.event] += 1
            if self._throttle.is_due(doubt.event):
                _log.warning('frame %d: %s: %s', number, doubt.event, doubt.text)
        self._results.write_estimate(frame, number, estimate)
        people, header = lifter.in_target_frame(estimate.people, frame.points_header)
        in_space, _ = lifter.landmarks_in_target_frame(landmarks.in_space, frame.points_header)
        landmarks = landmarks._replace(in_space=in_space)
        self._results.write_3d(frame, number, estimate, Published(people, landmarks, header))
        return len(people)

    def _drop(self, reason: str, error: Exception, number: int) -> None:
        self.report.dropped[reason] += 1
        if self._throttle.is_due(reason):
            _log.warning('frame %d is dropped (%d in all): %s', number, self.report.dropped[reason], error)


def _depth_of(frame: Frame) -> Optional[DepthView]:
    return None if frame.points is None else depth_view(frame.points)

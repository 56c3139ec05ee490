"""From a bag to its results: each frame once, in order."""
import itertools
import logging
import os
from collections import deque
from contextlib import ExitStack, closing
from dataclasses import astuple, replace
from functools import partial
from pathlib import Path
from typing import Any, Callable, Deque, Dict, Iterable, Iterator, List, NamedTuple, Optional, Tuple, Union

import genpy
import rosbag

from openpose_ros_pkg.detect.detection import Detection, ImageFrame, IndependentDetection
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.detect.recipe_choice import recipe_of
from openpose_ros_pkg.errors import BadInputError, ModelError, NoTransformError
from openpose_ros_pkg.landmarks.detector import create_landmark_detector
from openpose_ros_pkg.people import ExpectedPeople, People2D
from openpose_ros_pkg.throttle import Throttle
from openpose_ros_tools.outputs import PartFiles
from openpose_ros_tools.parallel.detector_pool import DetectorPool, with_threads
from openpose_ros_tools.parallel.threads import prefetched
from openpose_ros_tools.ros.bag_files import StampedMessage, open_bag, topic_types
from openpose_ros_tools.ros.camera_topics import TopicFinder, is_within
from openpose_ros_tools.ros.process_bag.input import (
    FrameReader,
    RecordedFrame,
    RecordedTransforms,
    copied_topics,
    find_topics,
)
from openpose_ros_tools.ros.process_bag.job import BagJob, BagReport, BagSettings, CameraTopics, build_settings
from openpose_ros_tools.ros.process_bag.output import Published, Results, finished_record, json_names
from openpose_ros_tools.ros.process_bag.preset import with_preset
from skeleton_extract_3d.chain import PeopleChain, PreparedFrame, Result
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.node_params import ExtractorParams
from skeleton_extract_3d.ros.frames import FrameTransforms, points_from_message

_log = logging.getLogger(__name__)

# Number of frames that are read before they are needed, and bytes of copied messages that wait for earlier frames.
_AHEAD = 3
_MOST_COPIED = 256 << 20
# One process per core is faster than one network with threads on all cores. Beyond 8, reading the bag and writing,
# which one process does, are the bottleneck.
_MOST_JOBS = 8
_Event = Union[RecordedFrame, BadInputError, StampedMessage]


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
    made = finished_record(job) or job.made_from()
    job = with_preset(job)
    settings = build_settings(job.values)
    with ExitStack() as stack:
        view = open_camera(job, settings, stack)
        networks = Networks(job, settings, view.topics.in_space, stack)
        parts = stack.enter_context(PartFiles(job.run))
        json = None if job.json is None else parts.folder(job.json, json_names(job))
        csv = None if job.csv is None else parts.file(job.csv)
        # the bag is the last one to be moved: where it is, all outputs are
        unfinished = replace(job, output=parts.file(job.output), csv=csv, json=json)
        return process_camera(unfinished, view, made, networks, on_frame)


class OpenCamera(NamedTuple):
    """An open bag, the topics of the camera in it, and those to copy."""

    bag: rosbag.Bag
    topics: CameraTopics
    copied: List[str]

    @property
    def images(self) -> int:
        """Number of images."""
        return self.bag.get_message_count(self.topics.image)


def open_camera(job: BagJob, settings: BagSettings, stack: ExitStack) -> OpenCamera:
    """Open the bag of a camera and find its topics; errors as `process`."""
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
        topics = CameraTopics(*(topic and f"/{namespace}/{topic.strip('/')}" for topic in astuple(topics)))
    found = find_topics(finder, topics, job.only_2d, settings.extractor.points_source == 'depth_image')
    if job.camera and not found.in_space:
        beside = topics.camera_info or finder.camera_info_of(found.image) or ''
        found = replace(found, camera_info=finder.required('camera_info', beside, finder.candidates['camera_info']))
    return OpenCamera(bag, found, copied_topics(bag, job.copied))


class Networks:
    """What finds people, hands and faces in the images of any number of cameras.

    Args:
        job: of one of the cameras.
        settings: of all.
        in_space: whether there are points: then tracks in space tell where people are expected, unless several
            processes search ahead.
        stack: ends the processes.

    Attributes:
        settings: those.
        capacity: number of images that have to be in progress, so that no network waits; 0: one after the other, where
            the history of a camera tells where to look.
    """

    def __init__(self, job: BagJob, settings: BagSettings, in_space: bool, stack: ExitStack) -> None:
        self.settings = settings
        params = with_threads(settings.detector, job.threads)
        recipe = recipe_of(params.detector)
        self._landmarks = create_landmark_detector(settings.landmarks, params.backend, params.detector.model_folder,
                                                   recipe.whole_body)
        if self._landmarks.missing:
            raise ModelError(self._landmarks.faults)
        self._make: Callable[[], Detection]
        jobs, skeleton = job.jobs or (1 if in_space else _most_jobs()), recipe.skeleton
        if settings.following.wanted(params.detector):
            self.capacity = 0
            self._make = partial(NetworkDetection, job.create(params), settings.tracking, settings.following)
        elif in_space and jobs == 1:
            self.capacity, detect = 0, job.create(params).detect
            self._make = partial(IndependentDetection, skeleton,
                                 lambda image: partial(detect, image.bgr, image.depth), settings.tracking)
        else:
            pool = stack.enter_context(DetectorPool(jobs, params, job.create))
            self.capacity = pool.capacity
            self._make = partial(IndependentDetection, skeleton, partial(_search_ahead, pool), settings.tracking)

    def chain(self) -> PeopleChain:
        """Return the chain of a camera that has no history yet."""
        return PeopleChain(self._make(), self.settings.estimator, self._landmarks)


def _most_jobs() -> int:
    return min(os.cpu_count() or 1, _MOST_JOBS)


def _search_ahead(pool: DetectorPool, image: ImageFrame) -> Callable[[Optional[ExpectedPeople]], People2D]:
    result = pool.submit(image.bgr, image.depth).result
    return lambda expected: result()


def process_camera(job: BagJob, view: OpenCamera, made: Dict[str, Any], networks: Networks,
                   on_frame: Callable[[int, int], None]) -> BagReport:
    """Write the results of a camera, in place; arguments and errors as `process`.

    Args:
        made: what the results are made from.
    """
    settings, images, chain = networks.settings, view.images, networks.chain()
    with ExitStack() as stack:
        params = replace(settings.extractor, points_source='depth_image' if view.topics.depth else 'point_cloud')
        most = settings.limits.max_image_megapixels
        points = partial(points_from_message, params=params, most=most) if view.topics.in_space else None
        recording = FrameReader(*view, settings.pairing, points, most)
        results = stack.enter_context(Results(job, settings, view.topics.in_space))
        frames = _Frames(chain, networks.capacity, _transforms(job.source, params, stack), results,
                         BagReport(counts=recording.counts, topics=view.topics))
        events = stack.enter_context(closing(prefetched(recording, _AHEAD)))
        for done in frames.run(events):
            on_frame(min(done, images), images)
        results.record(made, genpy.Time.from_sec(view.bag.get_start_time()))
        on_frame(images, images)
    if frames.report.frames == 0:
        raise BadInputError(f'{job.source} gave no frame with a result: {frames.report.text()}')
    return frames.report


def _transforms(source: Path, params: ExtractorParams, stack: ExitStack
                ) -> Tuple[FrameTransforms, Callable[[genpy.Time], None]]:
    """Return the transforms in a bag, which is read only where some are wanted, and what reads them until a time."""
    if not (params.target_frame or params.tracking_frame):
        return FrameTransforms(params, None), lambda time: None
    recorded = RecordedTransforms(stack.enter_context(open_bag(source)))
    return FrameTransforms(params, recorded.lookup), recorded.read_until


class _Pending(NamedTuple):
    """A frame whose image is being searched."""

    frame: RecordedFrame
    prepared: PreparedFrame


class _Frames:
    """Runs the chain over the frames of a camera and writes the results; see `process`.

    Args:
        capacity: see `Networks`.
        transforms: of `_transforms`.
    """

    def __init__(self, chain: PeopleChain, capacity: int,
                 transforms: Tuple[FrameTransforms, Callable[[genpy.Time], None]], results: Results, report: BagReport
                 ) -> None:
        self._chain, self._capacity, self._transforms, self._results = chain, capacity, transforms, results
        self._numbers, self._throttle = itertools.count(), Throttle()
        self.report = report

    def run(self, events: Iterable[_Event]) -> Iterator[int]:
        """Process all frames; yield the number of images that are done, after each frame."""
        waiting: Deque[Union[_Pending, BadInputError, StampedMessage]] = deque()
        frames = copied = 0
        for event in itertools.chain(events, (None,)):
            if event is not None:
                waiting.append(self._begun(event) if isinstance(event, RecordedFrame) else event)
                frames += isinstance(waiting[-1], _Pending)
                copied += len(event.raw[1]) if isinstance(event, StampedMessage) else 0
            while waiting and (event is None or frames > self._capacity or copied > _MOST_COPIED
                               or not isinstance(waiting[0], _Pending)):
                first = waiting.popleft()
                if isinstance(first, StampedMessage):
                    self._results.copy(first)
                    copied -= len(first.raw[1])
                    continue
                number = next(self._numbers)
                self._finish(first, number)
                frames -= isinstance(first, _Pending)
                yield number + 1 + self.report.counts.alone[0]

    def _begun(self, frame: RecordedFrame) -> Union[_Pending, BadInputError]:
        """Begin to search the image of a frame; return why that can not be where it is so."""
        image = frame.header.stamp.to_sec()
        points = frame.header if frame.points_header is None else frame.points_header
        try:
            return _Pending(frame, self._chain.prepare(Frame(
                points.frame_id, points.stamp.to_sec(), frame.bgr, frame.points, image_stamp=image)))
        except BadInputError as error:
            return error

    def _finish(self, pending: Union[_Pending, BadInputError], number: int) -> None:
        """Write the results of a frame, or count why there are none."""
        try:
            if isinstance(pending, BadInputError):
                raise pending
            with self._chain.detection.lock:
                computed = self._chain.compute(pending.prepared)
                self._chain.search(computed)
            result = self._chain.finish(computed)
            if pending.frame.points is None:
                result = self._chain.add_landmarks(result)
                self._results.write_2d(pending.frame, number, result.people_2d, result.landmarks.in_image)
            else:
                result = self._lifted(pending.frame, number, result)
        except BadInputError as error:
            self._drop('they can not be used', error, number)
        except NoTransformError as error:
            self._drop('no transform', error, number)
        else:
            self.report.frames += 1
            self.report.people += len(result.people_2d if result.people_3d is None else result.people_3d)

    def _lifted(self, frame: RecordedFrame, number: int, result: Result) -> Result:
        """Write the people of a frame in the image and in space; return the result with them."""
        (transforms, read_until), header = self._transforms, frame.points_header
        read_until(frame.time)
        result = self._chain.add_landmarks(self._chain.lift(result.located(transforms.tracking_from_points(header))))
        for doubt in result.doubts:
            self.report.doubts[doubt.event] += 1
            if self._throttle.is_due(doubt.event):
                _log.warning('frame %d: %s: %s', number, doubt.event, doubt.text)
        self._results.write_estimate(frame, number, result.estimate)
        people, header = transforms.in_target_frame(result.people_3d, header)
        in_space, _ = transforms.landmarks_in_target_frame(result.landmarks.in_space, frame.points_header)
        landmarks = result.landmarks._replace(in_space=in_space)
        self._results.write_3d(frame, number, result.estimate, Published(people, landmarks, header))
        return result

    def _drop(self, reason: str, error: Exception, number: int) -> None:
        self.report.dropped[reason] += 1
        if self._throttle.is_due(reason):
            _log.warning('frame %d is dropped (%d in all): %s', number, self.report.dropped[reason], error)


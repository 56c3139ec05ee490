"""From a bag to its results: each frame once, in order."""
import itertools
import logging
from contextlib import ExitStack, closing
from dataclasses import astuple, replace
from functools import partial
from typing import Any, Callable, Dict, Iterable, Iterator, List, Optional, Sequence, Tuple, Union

import genpy
import numpy as np

from openpose_ros_pkg.detect.recipe_choice import recipe_of
from openpose_ros_pkg.errors import BadInputError, ModelError, NoTransformError, OpenposeRosError
from openpose_ros_pkg.landmarks.detector import create_landmark_detector
from openpose_ros_pkg.ros.convert import turned_header
from openpose_ros_pkg.throttle import Throttle
from openpose_ros_tools.outputs import PartFiles
from openpose_ros_tools.parallel.threads import prefetched
from openpose_ros_tools.ros.bag_files import StampedMessage, open_bag, topic_types
from openpose_ros_tools.ros.camera_topics import TopicFinder, is_within
from openpose_ros_tools.ros.process_bag.input import (
    FrameReader,
    OpenCamera,
    RecordedFrame,
    RecordedTransforms,
    copied_topics,
    find_topics,
)
from openpose_ros_tools.ros.process_bag.job import BagJob, BagReport, BagSettings, CameraTopics, build_settings
from openpose_ros_tools.ros.process_bag.output import Published, Results, finished_record, json_names
from openpose_ros_tools.ros.process_bag.preset import with_preset
from skeleton_extract_3d.chain import PeopleChain, Result
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.node_params import ExtractorParams
from skeleton_extract_3d.ros.frames import FrameTransforms, points_from_message

_log = logging.getLogger(__name__)

# Number of frames that are read before they are needed.
_AHEAD = 3
_Event = Union[RecordedFrame, BadInputError, StampedMessage]


def process_parts(jobs: Sequence[BagJob]) -> List[Union[BagReport, Exception]]:
    """Make the results of the parts of a recording, in which people keep their ids; errors as `process`."""
    if len(jobs) == 1:
        return [process(jobs[0])]
    first = with_preset(jobs[0])
    results: List[Union[BagReport, Exception]] = []
    networks = Networks(first, build_settings(first.values))
    for job in jobs:
        try:
            results.append(process(job, networks=networks))
        except (OpenposeRosError, OSError) as error:  # of this part alone
            results.append(error)
    return results


def process(job: BagJob, on_frame: Callable[[int, int], None] = lambda done, total: None,
            networks: Optional['Networks'] = None) -> BagReport:
    """Make the results of a bag; they appear all at once, at the end.

    Args:
        on_frame: gets the number of images that are done, and of all.
        networks: of the parts of its recording; None: new ones.

    Raises:
        BadInputError: the bag can not be read, has not what is wanted, or no frame gave a result.
        ParameterError, ModelError: a parameter or a network is wrong.
        OSError: a result can not be written.
    """
    made = finished_record(job) or job.made_from()
    job = with_preset(job)
    settings = build_settings(job.values)
    with ExitStack() as stack:
        view = open_camera(job, settings, stack)
        networks = networks or Networks(job, settings)
        parts = stack.enter_context(PartFiles(job.run))
        json = None if job.json is None else parts.folder(job.json, json_names(job))
        csv = None if job.csv is None else parts.file(job.csv)
        # the bag is the last one to be moved: where it is, all outputs are
        unfinished = replace(job, output=parts.file(job.output), csv=csv, json=json)
        return process_camera(unfinished, view, made, networks, on_frame)


def open_camera(job: BagJob, settings: BagSettings, stack: ExitStack) -> OpenCamera:
    """Open the bag of a camera and find its topics; errors as `process`."""
    bag = stack.enter_context(open_bag(job.source))
    namespace = job.camera
    if namespace and job.is_alone and not any(is_within(topic, namespace) for topic in topic_types(bag)):
        namespace = ''
    earlier = [stack.enter_context(open_bag(path)) for path in job.earlier]
    finder = TopicFinder((*earlier, bag)[0], namespace)  # camera infos may be latched, so in the first part alone
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
    for topic in (found.image, found.points or found.depth):
        if topic and topic not in topic_types(bag):
            raise BadInputError(f'{job.source} has no topic {topic}, which the part before it has')
    return OpenCamera(bag, found, copied_topics(bag, job.copied), earlier)


class Networks:
    """What finds people, hands and faces in the images of any number of cameras, one after the other.

    Args:
        job: of one of the cameras.
        settings: of all.

    Attributes:
        settings: those.
    """

    def __init__(self, job: BagJob, settings: BagSettings) -> None:
        self.settings = settings
        params = settings.detector
        if params.backend.threads == 0:
            params = replace(params, backend=replace(params.backend, threads=job.threads))
        self._landmarks = create_landmark_detector(settings.landmarks, params.backend, params.detector.model_folder,
                                                   recipe_of(params.detector).whole_body)
        if self._landmarks.missing:
            raise ModelError(self._landmarks.faults)
        self._detection = job.create(params)
        self._chain: Optional[PeopleChain] = None

    def chain(self, job: BagJob) -> PeopleChain:
        """Return the chain of a camera: without a history, or with that of the parts of its recording before."""
        if self._chain is None or not job.earlier:
            self._chain = PeopleChain(self._detection, self.settings.estimator, self._landmarks, self.settings.tracking)
        return self._chain


def process_camera(job: BagJob, view: OpenCamera, made: Dict[str, Any], networks: Networks,
                   on_frame: Callable[[int, int], None]) -> BagReport:
    """Write the results of a camera, in place; arguments and errors as `process`.

    Args:
        made: what the results are made from.
    """
    settings, images, chain = networks.settings, view.images, networks.chain(job)
    with ExitStack() as stack:
        params = replace(settings.extractor, points_source='depth_image' if view.topics.depth else 'point_cloud')
        most = settings.limits.max_image_megapixels
        points = partial(points_from_message, params=params, most=most)
        recording = FrameReader(view, settings.pairing, points, params.rectified == 'true', most)
        results = stack.enter_context(Results(job, settings, view.topics.in_space))
        frames = _Frames(chain, job.camera, _transforms(job, params, stack), results,
                         BagReport(counts=recording.counts, topics=view.topics), params.rotate_image)
        events = stack.enter_context(closing(prefetched(recording, _AHEAD)))
        for done in frames.run(events):
            on_frame(min(done, images), images)
        results.record(made, genpy.Time.from_sec(view.bag.get_start_time()))
        on_frame(images, images)
    if frames.report.frames == 0:
        raise BadInputError(f'{job.source} gave no frame with a result: {frames.report.text()}')
    return frames.report


def _transforms(job: BagJob, params: ExtractorParams, stack: ExitStack
                ) -> Tuple[FrameTransforms, Callable[[genpy.Time], None]]:
    """Return the transforms in a bag, which is read only where some are wanted, and what reads them until a time."""
    if not (params.target_frame or params.tracking_frame):
        return FrameTransforms(params, None), lambda time: None
    recorded = RecordedTransforms(*(stack.enter_context(open_bag(path)) for path in (job.source, *job.earlier)))
    return FrameTransforms(params, recorded.lookup), recorded.read_until


def _turned(frame: RecordedFrame, degrees: int) -> RecordedFrame:
    points = frame.points_header and turned_header(frame.points_header, degrees)
    return replace(frame, bgr=np.ascontiguousarray(np.rot90(frame.bgr, -degrees // 90)), points_header=points,
                   header=turned_header(frame.header, degrees))


class _Frames:
    """Runs the chain over the frames of a camera and writes the results; see `process`.

    Args:
        camera: namespace of the camera.
        transforms: of `_transforms`.
        degrees: by which images are turned clockwise; the points are turned already.
    """

    def __init__(self, chain: PeopleChain, camera: str,
                 transforms: Tuple[FrameTransforms, Callable[[genpy.Time], None]], results: Results, report: BagReport,
                 degrees: int) -> None:
        self._chain, self._camera, self._transforms, self._results = chain, camera, transforms, results
        self._numbers, self._throttle, self._degrees = itertools.count(), Throttle(), degrees
        self.report = report

    def run(self, events: Iterable[_Event]) -> Iterator[int]:
        """Process all frames; yield the number of images that are done, after each frame."""
        for event in events:
            if isinstance(event, StampedMessage):
                self._results.copy(event)
                continue
            number = next(self._numbers)
            self._process(event, number)
            yield number + 1 + self.report.counts.alone[0]

    def _process(self, frame: Union[RecordedFrame, BadInputError], number: int) -> None:
        """Write the results of a frame, or count why there are none."""
        try:
            if isinstance(frame, BadInputError):
                raise frame
            frame = _turned(frame, self._degrees)
            result = self._chain.update(self._located(frame))
            for doubt in result.doubts:
                self.report.doubts[doubt.event] += 1
                if self._throttle.is_due(doubt.event):
                    _log.warning('frame %d: %s: %s', number, doubt.event, doubt.text)
            if frame.points is None:
                self._results.write_2d(frame, number, result.people_2d, result.landmarks.in_image)
            else:
                self._write_3d(frame, number, result)
        except BadInputError as error:
            self._drop('they can not be used', error, number)
        except NoTransformError as error:
            self._drop('no transform', error, number)
        else:
            self.report.frames += 1
            self.report.people += len(result.people_2d if result.people_3d is None else result.people_3d)

    def _located(self, recorded: RecordedFrame) -> Frame:
        """Return a frame for the chain, with the motion of the camera by tf; NoTransformError: there is none."""
        (transforms, read_until), points = self._transforms, recorded.points_header
        header = recorded.header if points is None else points
        frame = Frame((self._camera, header.frame_id), header.stamp.to_sec(), recorded.bgr, recorded.points,
                      image_stamp=recorded.header.stamp.to_sec())
        if points is None:
            return frame
        read_until(recorded.time)
        return replace(frame, tracking_from_points=transforms.tracking_from_points(points))

    def _write_3d(self, frame: RecordedFrame, number: int, result: Result) -> None:
        """Write the people of a frame in the image and in space."""
        transforms, _ = self._transforms
        self._results.write_estimate(frame, number, result.estimate)
        self._results.write_tf(frame, transforms.of_camera(frame.points_header))
        people, header = transforms.in_target_frame(result.people_3d, frame.points_header)
        in_space, _ = transforms.in_target_frame(result.landmarks.in_space, frame.points_header)
        landmarks = result.landmarks._replace(in_space=in_space)
        self._results.write_3d(frame, number, result.estimate, Published(people, landmarks, header))

    def _drop(self, reason: str, error: Exception, number: int) -> None:
        self.report.dropped[reason] += 1
        if self._throttle.is_due(reason):
            _log.warning('frame %d is dropped (%d in all): %s', number, self.report.dropped[reason], error)

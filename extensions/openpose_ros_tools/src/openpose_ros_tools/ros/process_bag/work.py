"""From a bag to its results: each frame once, in order."""
import itertools
import logging
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from functools import partial
from typing import Callable, Iterable, Iterator, List, Optional, Sequence, Union

import numpy as np

from openpose_ros_pkg.allocator import keep_large_blocks
from openpose_ros_pkg.detect.recipe_choice import recipe_of
from openpose_ros_pkg.errors import BadInputError, ModelError, NoTransformError
from openpose_ros_pkg.landmarks.body_landmarks import create_body_landmarks
from openpose_ros_pkg.landmarks.detector import create_landmark_detector
from openpose_ros_pkg.ros.convert import turned_header
from openpose_ros_pkg.throttle import Throttle
from openpose_ros_tools.outputs import PartFiles
from openpose_ros_tools.parallel import prefetched
from openpose_ros_tools.ros.bag_files import StampedMessage, open_bag
from openpose_ros_tools.ros.process_bag.input import FrameReader, OpenCamera, RecordedFrame, open_camera
from openpose_ros_tools.ros.process_bag.job import BagJob, BagReport, Input, Outputs, Settings, build_settings
from openpose_ros_tools.ros.process_bag.output import Results, json_names
from openpose_ros_tools.ros.process_bag.transforms import RecordedTransforms
from skeleton_extract_3d.chain import PeopleChain, Result
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.ros.frames import FrameTransforms, points_from_message

_log = logging.getLogger(__name__)

# Number of frames that are read before they are needed.
_AHEAD = 3
_Event = Union[RecordedFrame, BadInputError, StampedMessage]
OnFrame = Callable[[int, int], None]
"""Gets the number of images that are done, and of all."""


def process_parts(jobs: Sequence[BagJob]) -> List[Union[BagReport, Exception]]:
    """Make the results of the parts of a recording, in which people keep their ids; errors as `process`."""
    results: List[Union[BagReport, Exception]] = []
    networks = Networks(jobs[0].settings)
    for job in jobs:
        try:
            results.append(process(job, networks=networks))
        except Exception as error:  # of this part alone: those before are done
            results.append(error)
    return results


def process(job: BagJob, on_frame: OnFrame = lambda done, total: None, networks: Optional['Networks'] = None
            ) -> BagReport:
    """Make the results of a camera; they appear all at once, at the end.

    Args:
        networks: of the parts of its recording; None: new ones.

    Raises:
        BadInputError: the bag can not be read, has not what is wanted, or no frame gave a result.
        ParameterError, ModelError: a parameter or a network is wrong.
        OSError: a result can not be written.
    """
    camera = job.cameras[0]
    points_source = build_settings(job.settings.values).extractor.points_source
    with ExitStack() as stack:
        view = open_camera(camera, stack, job.outputs.copied, points_source)
        parts = stack.enter_context(PartFiles())
        json = job.outputs.json and parts.folder(job.outputs.json, json_names(camera))
        csv = job.outputs.csv and parts.file(job.outputs.csv)
        unfinished = replace(job.outputs, bag=parts.file(job.outputs.bag), csv=csv, json=json)
        return process_camera(camera, unfinished, view, networks or Networks(job.settings), on_frame)


class Networks:
    """What finds people, hands and faces in the images of any number of cameras, one after the other.

    Attributes:
        settings: of all.
    """

    def __init__(self, settings: Settings, publish_tf: Optional[bool] = None) -> None:
        keep_large_blocks()
        self.settings = build_settings(settings.values)
        if publish_tf is not None:
            self.settings = replace(self.settings, extractor=replace(self.settings.extractor, publish_tf=publish_tf))
        params = self.settings.detector
        if params.backend.threads == 0:
            params = replace(params, backend=replace(params.backend, threads=settings.threads))
        self._landmarks = create_landmark_detector(self.settings.landmarks, params.backend,
                                                   params.detector.model_folder, recipe_of(params.detector).whole_body)
        if self._landmarks.missing:
            raise ModelError(self._landmarks.faults)
        self._bodies = None
        if self.settings.extractor.points_source == 'none':
            self._bodies = create_body_landmarks(params.backend, params.detector.model_folder)
        self._detection = settings.create(params)
        self._chain: Optional[PeopleChain] = None

    def chain(self, camera: Input) -> PeopleChain:
        """Return the chain of a camera: without a history, or with that of the parts of its recording before."""
        if self._chain is None or not camera.earlier:
            self._chain = PeopleChain(self._detection, self.settings.estimator, self._landmarks, self.settings.tracking,
                                      self._bodies)
        return self._chain


def process_camera(camera: Input, outputs: Outputs, view: OpenCamera, networks: Networks, on_frame: OnFrame
                   ) -> BagReport:
    """Write the results of a camera, in place; errors as `process`."""
    settings, images, chain = networks.settings, view.images, networks.chain(camera)
    with ExitStack() as stack:
        params = replace(settings.extractor, points_source='none' if view.is_monocular else
                         'depth_image' if view.topics.depth else 'point_cloud')
        if view.is_rectified and params.rectified == 'auto':
            params = replace(params, rectified='true')
        most = settings.limits.max_image_megapixels
        points = partial(points_from_message, params=params, most=most)
        recording = FrameReader(view, settings.pairing, points, params.rectified == 'true', most)
        recorded = None  # tf is read only where it is wanted
        if params.target_frame or params.tracking_frame:
            recorded = RecordedTransforms(*(stack.enter_context(open_bag(path))
                                            for path in (camera.bag, *camera.earlier)))
        transforms = FrameTransforms(params, None if recorded is None else recorded.lookup)
        results = Results(camera, outputs, settings, view.in_space, stack)
        frames = _Frames(chain, camera.camera, transforms, recorded, results, recording.report, params.rotate_image)
        events = stack.enter_context(closing(prefetched(recording, _AHEAD)))
        for done in frames.run(events):
            on_frame(min(done, images), images)
        on_frame(images, images)
    if frames.report.frames == 0:
        raise BadInputError(f'{camera.bag} gave no frame with a result: {frames.report.text()}')
    return frames.report


def _turned(frame: RecordedFrame, degrees: int) -> RecordedFrame:
    points = frame.points_header and turned_header(frame.points_header, degrees)
    return replace(frame, bgr=np.ascontiguousarray(np.rot90(frame.bgr, -degrees // 90)), points_header=points,
                   header=turned_header(frame.header, degrees))


@dataclass
class _Frames:
    """Runs the chain over the frames of a camera and writes the results; see `process`."""

    chain: PeopleChain
    camera: str  # its namespace
    transforms: FrameTransforms
    recorded: Optional[RecordedTransforms]
    results: Results
    report: BagReport
    degrees: int  # by which images are turned clockwise; the points are turned already

    def run(self, events: Iterable[_Event]) -> Iterator[int]:
        """Process all frames; yield the number of images that are done, after each frame."""
        numbers, throttle = itertools.count(), Throttle()
        for event in events:
            if isinstance(event, StampedMessage):
                self.results.copy(event)
                continue
            number = next(numbers)
            try:
                self._process(event, number, throttle)
            except (BadInputError, NoTransformError) as error:
                reason = 'no transform' if isinstance(error, NoTransformError) else 'they can not be used'
                self.report.dropped[reason] += 1
                if throttle.is_due(reason):
                    _log.warning('frame %d is dropped (%d in all): %s', number, self.report.dropped[reason], error)
            yield number + 1 + self.report.alone[0]

    def _process(self, frame: Union[RecordedFrame, BadInputError], number: int, throttle: Throttle) -> None:
        if isinstance(frame, BadInputError):
            raise frame
        frame = _turned(frame, self.degrees)
        result = self.chain.update(self._located(frame))
        for doubt in result.doubts:
            self.report.doubts[doubt.event] += 1
            if throttle.is_due(doubt.event):
                _log.warning('frame %d: %s: %s', number, doubt.event, doubt.text)
        if frame.points is None:
            self.results.write_2d(frame, number, result.people_2d, result.landmarks.in_image)
        else:
            self._write_3d(frame, number, result)
        self.report.frames += 1
        self.report.people += len(result.people_2d if result.people_3d is None else result.people_3d)

    def _located(self, recorded: RecordedFrame) -> Frame:
        """Return a frame for the chain, with the motion of the camera by tf; NoTransformError: there is none."""
        points = recorded.points_header
        header = recorded.header if points is None else points
        frame = Frame((self.camera, header.frame_id), header.stamp.to_sec(), recorded.bgr, recorded.points,
                      image_stamp=recorded.header.stamp.to_sec())
        if points is None:
            return frame
        if self.recorded is not None:
            self.recorded.read_until(recorded.time, points.stamp)
        return replace(frame, tracking_from_points=self.transforms.tracking_from_points(points),
                       floor=self.transforms.floor(points))

    def _write_3d(self, frame: RecordedFrame, number: int, result: Result) -> None:
        self.results.write_estimate(frame, number, result.estimate, self.transforms.of_camera(frame.points_header))
        people, header = self.transforms.in_target_frame(result.people_3d, frame.points_header)
        in_space, _ = self.transforms.in_target_frame(result.landmarks.in_space, frame.points_header)
        landmarks = result.landmarks._replace(in_space=in_space)
        self.results.write_3d(frame, number, result.estimate, people, landmarks, header)

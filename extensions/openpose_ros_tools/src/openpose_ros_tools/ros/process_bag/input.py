"""The input of process_bag: the topics of a camera in a bag, its frames, transforms."""
import itertools
import logging
from collections import deque
from dataclasses import dataclass
from typing import Any, Callable, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Union

import genpy
import numpy as np
import rosbag
import tf2_py
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from openpose_ros_pkg.errors import BadInputError, NoTransformError
from openpose_ros_pkg.ros.convert import any_image_to_bgr
from openpose_ros_pkg.stream.image_decoding import MOST_MEGAPIXELS
from openpose_ros_pkg.stream.pairing import PAIRING, PairingParams, StampMatcher
from openpose_ros_pkg.stream.pairing_report import pairing_report
from openpose_ros_tools.ros.bag_files import StampedMessage, deserialized, stamped_messages, topic_types
from openpose_ros_tools.ros.camera_topics import TopicFinder, depth_unit, is_result
from openpose_ros_tools.ros.process_bag.job import CameraTopics, Counts
from openpose_ros_tools.ros.process_bag.registration import TF_TOPICS, Registration, first_message
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.ros.transforms import check_stamp

_log = logging.getLogger(__name__)

# Number of stamps of each stream, from the time when both are there, from which the usual difference between them is
# learnt before the first pair is made.
_LEARNT = 9
# Number of images and clouds that may wait for their partner where `queue_size` leaves it open: enough for any
# recording, as its reader can wait.
_QUEUE = 50
# Transforms are read ahead of the frame by this time [ns], as they may be recorded later than the image; and kept for
# this time.
_TF_AHEAD, _TF_KEPT = 3_000_000_000, genpy.Duration(30)
_CLASSES = {kind._type: kind for kind in (Image, CompressedImage, PointCloud2, CameraInfo)}
# Makes a grid of points of a message and its calibration.
MakePoints = Callable[[Any, Optional[CameraInfo]], PointGrid]


@dataclass(frozen=True)
class RecordedFrame:
    """An image, and the points of the same view where the recording has some."""

    time: genpy.Time  # of recording, of the later of both
    header: Header  # of the image
    bgr: np.ndarray  # (H, W, 3) uint8
    points: Optional[PointGrid]  # None in 2D
    points_header: Optional[Header]


class _Part(NamedTuple):
    """A message of a frame, the time of its recording [ns], and the calibration at that time."""

    message: Any
    time: int
    info: Optional[CameraInfo] = None


def find_topics(finder: TopicFinder, wanted: CameraTopics, only_2d: bool = False, prefer_depth: bool = False
                ) -> CameraTopics:
    """Return the topics of the camera in a bag.

    Args:
        finder: of the bag.
        wanted: those that are named are taken; the others are found by their types and names.
        only_2d: whether to ignore points.
        prefer_depth: whether to take depth images where there are clouds as well.

    Raises:
        BadInputError: a topic is not there or has another type, or it is not clear which one to take.
    """
    image = finder.required('colour', wanted.image, finder.candidates['colour'])
    image_info = finder.camera_info_of(image) or ''
    if only_2d:
        return CameraTopics(image)
    organized = [] if wanted.points or wanted.depth or prefer_depth else finder.organized_clouds()
    if wanted.points or organized:
        return CameraTopics(image, finder.required('points', wanted.points, organized), image_info=image_info)
    depths = [topic for topic in finder.candidates['depth'] if topic != image]
    if depths or wanted.depth or prefer_depth:
        depth = finder.required('depth', wanted.depth, depths)
        beside = wanted.camera_info or finder.camera_info_of(depth) or image_info
        return CameraTopics(image, '', depth,
                            finder.required('camera_info', beside, finder.candidates['camera_info']), image_info)
    finder.warn_without_depth()
    return CameraTopics(image)


def copied_topics(bag: rosbag.Bag, wanted: Sequence[str]) -> List[str]:
    """Return the topics to be copied: those that are named, or with 'all' everything but results of this project.

    Raises:
        BadInputError: a topic that is named is not there, can not be read, or is a result that is made anew.
    """
    types, copied = topic_types(bag), []
    every = 'all' in wanted
    for topic in (topic for topic in sorted(types) if not is_result(topic)) if every else wanted:
        try:
            if topic not in types:
                raise BadInputError(f"not in the bag, which has {', '.join(sorted(types))}")
            if is_result(topic):
                raise BadInputError('that is a result, which is made anew')
            if ' and ' in types[topic]:
                raise BadInputError(f'its messages are of several types, {types[topic]}')
            next(stamped_messages(bag, [topic]))
            copied.append(topic)
        except BadInputError as error:
            if not every:
                raise BadInputError(f'--copy {topic}: {error}') from error
            _log.warning('%s is not copied: %s', topic, error)
    return copied


class OpenCamera(NamedTuple):
    """An open bag, the topics of the camera in it, those to copy, and the open bags that were recorded before it."""

    bag: rosbag.Bag
    topics: CameraTopics
    copied: List[str]
    earlier: Sequence[rosbag.Bag] = ()

    @property
    def images(self) -> int:
        """Number of images."""
        return self.bag.get_message_count(self.topics.image)


class FrameReader:
    """The frames of a bag, in its order.

    Args:
        camera: in the bag; messages to be copied come as well, between the frames.
        pairing: how images and points are paired.
        points: makes points of a message and the camera info at its time; not called in 2D.
        rectified: the images are.
        most: pixels of an image, `max_image_megapixels`.

    Attributes:
        counts: of what has been read.
    """

    def __init__(self, camera: OpenCamera, pairing: PairingParams, points: MakePoints, rectified: bool,
                 most: float = MOST_MEGAPIXELS) -> None:
        self._bag, self._topics, copied, earlier = camera
        topics = self._topics
        self._make_points, self._most = points, most
        self._copied = frozenset(copied)
        self._points_topic = topics.points or topics.depth
        self.counts = Counts()
        self._matcher = self._prepared(pairing) if topics.in_space else None
        self._info: Optional[CameraInfo] = None
        self._unit = 1.0
        bags = (self._bag, *earlier)
        if topics.in_space:
            self._registration = Registration(bags, topics, rectified)
        if topics.depth:
            # holds for the depth images before it as well
            self._info = deserialized(first_message(bags, topics.camera_info), CameraInfo)
            self._unit = depth_unit(self._bag, topics.depth) / 0.001

    def __iter__(self) -> Iterator[Union[RecordedFrame, BadInputError, StampedMessage]]:
        """Yield the frames, the errors of frames that can not be used, and the messages that are to be copied.

        Raises:
            BadInputError: the bag is damaged.
        """
        inputs = [topic for topic in (self._topics.image, self._points_topic, self._topics.camera_info) if topic]
        for message in stamped_messages(self._bag, [*inputs, *self._copied]):
            if message.topic in self._copied:
                yield message
            if message.topic in inputs:
                yield from self._frames_of(message)
        if self._matcher is not None:
            for pair in self._matcher.finish():
                self.counts.pairs += 1
                yield self._frame(*pair)
            self.counts.alone = self._matcher.unpaired
            report = pairing_report(self._matcher) if self.counts.few_pairs else None
            if report is not None:
                self.counts.advice = report.text((self._topics.image, self._points_topic), '--set {}={}')

    def _frames_of(self, stored: StampedMessage) -> Iterator[Union[RecordedFrame, BadInputError]]:
        """Yield the frame, or error, that a message completes, if any."""
        message = deserialized(stored, _CLASSES[stored.raw[0]])
        if stored.topic == self._topics.camera_info:
            self._info = message
            return
        is_image = stored.topic == self._topics.image
        self.counts.images += is_image
        part = _Part(message, stored.time, None if is_image else self._info)
        matcher = self._matcher
        if matcher is None:
            yield self._frame(part)
        elif not stored.stamp:
            self.counts.unusable += 1
        else:
            before = matcher.out_of_order
            pair = matcher.add(0 if is_image else 1, stored.stamp, part)
            self.counts.unusable += matcher.out_of_order - before
            self.counts.alone, self.counts.resets = matcher.unpaired, matcher.resets
            if pair is not None:
                self.counts.pairs += 1
                yield self._frame(*pair)

    def _frame(self, image: _Part, points: Optional[_Part] = None) -> Union[RecordedFrame, BadInputError]:
        """Return a frame, or why its messages can not be used."""
        grid, points_header = None, None
        try:
            bgr = any_image_to_bgr(image.message, self._most)
            if points is not None:
                grid = self._make_points(points.message, points.info)
                if self._unit != 1:
                    grid = grid.scaled(self._unit)
                grid, points_header = self._registration(grid, points.message.header)
            time = max(part.time for part in (image, points) if part is not None)
            return RecordedFrame(genpy.Time(0, time), image.message.header, bgr, grid, points_header)
        except BadInputError as error:
            return error

    def _prepared(self, params: PairingParams) -> StampMatcher:
        """Return a matcher that knows the usual difference between the stamps, from the first ones of each stream."""
        if params.queue_size == 0:
            params = PairingParams(slop=params.slop, queue_size=_QUEUE)
        matcher = StampMatcher(params)
        topics = (self._topics.image, self._points_topic)
        first = [first_message([self._bag], topic) for topic in topics]
        if first[0].stamp == first[1].stamp:
            return matcher  # one driver stamps both
        both = genpy.Time(0, max(message.time for message in first))
        stamps = [(message.stamp or 0, stream) for stream, topic in enumerate(topics)
                  for message in itertools.islice(stamped_messages(self._bag, [topic], both), _LEARNT)]
        for stamp, stream in sorted(item for item in stamps if item[0]):
            matcher.add(stream, stamp, None)
        matcher.restart()
        return matcher


class _ClockRun:
    """What tf knew between two resets of the clock.

    Args:
        time: from which on it is of the bag [ns].
        static: transforms that do not change.
        backstep: by which the stamps jump back where the clock was reset [ns].

    Attributes:
        begun, ended: time of recording of the first and the last transforms [ns].
        transforms: these, and the static ones.
    """

    def __init__(self, time: int, static: Iterable[TransformStamped], backstep: int) -> None:
        self.begun = self.ended = time
        self._backstep = backstep
        self.transforms = tf2_py.BufferCore(_TF_KEPT)
        self.set_static(static)
        self._stamps: Dict[str, int] = {}  # newest one of each child frame [ns]

    def set_static(self, transforms: Iterable[TransformStamped]) -> None:
        """Take transforms that do not change."""
        for transform in transforms:
            self.transforms.set_transform_static(transform, 'bag')

    def add(self, transforms: Sequence[TransformStamped], time: int) -> bool:
        """Take the transforms of a message, recorded at a time [ns]; false: their stamps jump back, none is taken."""
        stamps = {transform.child_frame_id: transform.header.stamp.to_nsec() for transform in transforms}
        if any(stamp < self._stamps.get(frame, stamp) - self._backstep for frame, stamp in stamps.items()):
            return False
        self._stamps.update(stamps)
        self.ended = time
        for transform in transforms:
            self.transforms.set_transform(transform, 'bag')
        return True


class RecordedTransforms:
    """The transforms of a bag, read on as the frames come.

    Where stamps jump back, as in recordings of a simulation that was restarted and of a bag that was played in a loop,
    all but static transforms are forgotten. Those of the next run of the clock are read before its first frame comes.

    Args:
        bag: open; this is its only reader meanwhile.
        earlier: the parts of its recording before, whose static transforms hold and whose last ones may still count.
        backstep: by which stamps jump back where the clock was reset [ns].
    """

    def __init__(self, bag: rosbag.Bag, *earlier: rosbag.Bag, backstep: int = PAIRING.reset_backstep) -> None:
        ends = [genpy.Time.from_sec(max(part.get_end_time() - 1e-9 * _TF_AHEAD, 0)) for part in earlier]
        self._messages = itertools.chain(
            *(stamped_messages(part, ('/tf_static', 'tf_static')) for part in earlier),
            *(stamped_messages(part, ('/tf', 'tf'), start) for part, start in zip(earlier, ends)),
            stamped_messages(bag, TF_TOPICS))
        self._next = next(self._messages, None)
        self._static: Dict[str, TransformStamped] = {}  # by child frame
        self._backstep = backstep
        self._runs = deque([_ClockRun(0, (), backstep)])  # that of the frames, and those that may come after it
        self._time = 0  # of recording of the newest frame [ns]
        self._newest: Optional[int] = None  # stamp of the frames in their run [ns]; None: their run has to be found

    def read_until(self, time: genpy.Time) -> None:
        """Read what was recorded until a while after this time, at which a frame was recorded."""
        self._time = time.to_nsec()
        while self._next is not None and self._next.time <= self._time + _TF_AHEAD:
            transforms = deserialized(self._next, TFMessage).transforms
            if self._next.topic.endswith('tf_static'):
                self._static.update({transform.child_frame_id: transform for transform in transforms})
                self._runs[-1].set_static(transforms)
            else:
                self._add(transforms, self._next.time)
            self._next = next(self._messages, None)
        while len(self._runs) > 1 and self._runs[1].begun + _TF_AHEAD < self._time:
            if self._runs[0].ended >= self._runs[1].begun:
                del self._runs[1]  # neither frames nor the other transforms jumped: it was no reset
            else:
                self._runs.popleft()
                self._newest = None

    def _add(self, transforms: Sequence[TransformStamped], time: int) -> None:
        taken = [run.add(transforms, time) for run in list(self._runs)[::max(len(self._runs) - 1, 1)]]
        if not taken[-1]:
            self._runs.append(_ClockRun(time, self._static.values(), self._backstep))
            self._runs[-1].add(transforms, time)

    def _find_run(self, stamp: int) -> None:
        """Go on to the run of the newest frame, by its stamp [ns]."""
        if self._newest is not None and stamp >= self._newest - self._backstep:
            self._newest = max(stamp, self._newest)
            return
        if self._newest is not None:
            if len(self._runs) == 1:  # no transform was recorded since the reset
                self._runs.append(_ClockRun(self._time, self._static.values(), self._backstep))
            self._runs.popleft()
        while len(self._runs) > 1 and self._runs[1].begun <= self._time:
            self._runs.popleft()
        self._newest = stamp

    def lookup(self, target: str, source: str, stamp: genpy.Time) -> TransformStamped:
        """Return the transform from `source` to `target` at a time, that of the frame for which was read.

        Raises:
            NoTransformError: there is none.
        """
        check_stamp(stamp)
        self._find_run(stamp.to_nsec())
        try:
            return self._runs[0].transforms.lookup_transform_core(target, source, stamp)
        except tf2_py.TransformException as error:
            raise NoTransformError(str(error)) from error

"""The input of process_bag: an open bag with the topics of a camera, and its frames."""
import itertools
import logging
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, Callable, Iterator, List, NamedTuple, Optional, Sequence, Union

import genpy
import numpy as np
import rosbag
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.convert import any_image_to_bgr
from openpose_ros_pkg.ros.topics import CameraTopics, is_result, is_within
from openpose_ros_pkg.stream.image_decoding import MOST_MEGAPIXELS
from openpose_ros_pkg.stream.pairing import PairingParams, StampMatcher, pairing_report
from openpose_ros_tools.ros.bag_files import (
    StampedMessage,
    deserialized,
    message_count,
    open_bag,
    stamped_messages,
    topic_finder,
    topic_types,
)
from openpose_ros_tools.ros.process_bag.job import BagReport, Input
from openpose_ros_tools.ros.process_bag.registration import Registration, first_message
from skeleton_extract_3d.points.point_grid import PointGrid

_log = logging.getLogger(__name__)

# Number of stamps of each stream, from the time when both are there, from which the usual difference between them is
# learnt before the first pair is made.
_LEARNT = 9
# Number of images and clouds that may wait for their partner where `queue_size` leaves it open: enough for any
# recording, as its reader can wait.
_QUEUE = 50
_CLASSES = {kind._type: kind for kind in (Image, CompressedImage, PointCloud2, CameraInfo)}
# Makes a grid of points of a message and its calibration.
MakePoints = Callable[[Any, Optional[CameraInfo]], PointGrid]


class OpenCamera(NamedTuple):
    """An open bag, and what is read of it."""

    bag: rosbag.Bag
    topics: CameraTopics
    is_rectified: bool  # by the preset of the camera
    copied: List[str]  # topics
    earlier: Sequence[rosbag.Bag] = ()  # parts that were recorded before
    is_monocular: bool = False  # people are placed in space by images and their calibration alone

    @property
    def in_space(self) -> bool:
        """Whether people have places in space."""
        return self.topics.in_space or self.is_monocular

    @property
    def images(self) -> int:
        """Number of images."""
        return message_count(self.bag, self.topics.image)


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


def open_camera(camera: Input, stack: ExitStack, copied: Sequence[str] = (), points_source: str = 'auto') -> OpenCamera:
    """Open the bag of a camera and find its topics.

    Args:
        stack: closes the bags.
        copied: topics that are wanted beside.
        points_source: of `ExtractorParams`: depth_image prefers depth images to clouds, none takes neither.

    Raises:
        BadInputError: the bag can not be read, or has not what is wanted.
    """
    bag = stack.enter_context(open_bag(camera.bag))
    types = topic_types(bag)
    namespace = camera.camera
    if camera.is_alone and not any(is_within(topic, namespace) for topic in types):
        namespace = ''
    earlier = [stack.enter_context(open_bag(path)) for path in camera.earlier]
    finder = topic_finder((*earlier, bag)[0], namespace)  # camera infos may be latched, so in the first part alone
    if not finder.types and namespace:
        raise BadInputError(f"{camera.bag} has no topics in the namespace /{namespace}; it has "
                            f"{', '.join(sorted(types))}")
    is_monocular = points_source == 'none' and not camera.only_2d
    topics, is_rectified = finder.camera(camera.topics, camera.preset, camera.only_2d or is_monocular,
                                         points_source == 'depth_image', bool(camera.camera) or is_monocular)
    for topic in (topics.image, topics.points or topics.depth):
        if topic and topic not in types:
            raise BadInputError(f'{camera.bag} has no topic {topic}, which the part before it has')
    return OpenCamera(bag, topics, is_rectified, copied_topics(bag, copied), earlier, is_monocular)


def copied_topics(bag: rosbag.Bag, wanted: Sequence[str]) -> List[str]:
    """Return the topics to be copied: those that are named, or with 'all' everything but results of this project.

    Raises:
        BadInputError: a topic that is named is not there, can not be read, or is a result that is made anew.
    """
    types, copied = topic_types(bag), []
    every = 'all' in wanted
    for topic in (topic for topic in sorted(types) if not is_result(topic)) if every else wanted:
        try:
            if topic not in types or is_result(topic):
                reason = 'that is a result, which is made anew' if topic in types else (
                    f"not in the bag, which has {', '.join(sorted(types))}")
                raise BadInputError(reason)
            next(stamped_messages(bag, [topic]))
            copied.append(topic)
        except BadInputError as error:
            if not every:
                raise BadInputError(f'--copy {topic}: {error}') from error
            _log.warning('%s is not copied: %s', topic, error)
    return copied


class FrameReader:
    """The frames of a bag, in its order.

    Args:
        camera: in the bag; messages to be copied come as well, between the frames.
        pairing: how images and points are paired.
        points: makes points of a message and the camera info at its time; not called in 2D.
        rectified: the images are.
        most: pixels of an image, `max_image_megapixels`.

    Attributes:
        report: counts messages that became no frame.
    """

    def __init__(self, camera: OpenCamera, pairing: PairingParams, points: MakePoints, rectified: bool,
                 most: float = MOST_MEGAPIXELS) -> None:
        self._bag, self._topics, self._copied = camera.bag, camera.topics, frozenset(camera.copied)
        topics = self._topics
        self._make_points, self._most = points, most
        self._points_topic = topics.points or topics.depth
        self.report, self._pairs = BagReport(topics), 0
        self._matcher = self._prepared(pairing) if topics.in_space else None
        if self._matcher is not None:
            self.report.alone = self._matcher.unpaired
        self._info: Optional[CameraInfo] = None
        bags = (self._bag, *camera.earlier)
        self._registration = Registration(bags, topics, rectified) if topics.in_space else None
        self._is_monocular = camera.is_monocular
        if topics.depth or camera.is_monocular:  # holds for the images before it as well
            self._info = deserialized(first_message(bags, topics.camera_info), CameraInfo)

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
            yield from itertools.starmap(self._frame, self._matcher.finish())
            self.report.unusable += self._matcher.out_of_order
            self.report.resets = self._matcher.resets
            report = pairing_report(self._matcher) if 0 < min(self.report.alone) >= self._pairs else None
            if report is not None:
                self.report.advice = report.text((self._topics.image, self._points_topic), '--set {}={}')

    def _frames_of(self, stored: StampedMessage) -> Iterator[Union[RecordedFrame, BadInputError]]:
        message = deserialized(stored, _CLASSES[stored.raw[0]])
        if stored.topic == self._topics.camera_info:
            self._info = message
            return
        is_image = stored.topic == self._topics.image
        part = _Part(message, stored.time, None if is_image else self._info)
        if self._matcher is None:
            yield self._frame(part, part._replace(info=self._info) if self._is_monocular else None)
        elif not stored.stamp:
            self.report.unusable += 1
        else:
            pair = self._matcher.add(0 if is_image else 1, stored.stamp, part)
            if pair is not None:
                yield self._frame(*pair)

    def _frame(self, image: _Part, points: Optional[_Part] = None) -> Union[RecordedFrame, BadInputError]:
        grid, points_header = None, None
        self._pairs += points is not None
        try:
            bgr = any_image_to_bgr(image.message, self._most)
            if points is not None:
                grid, points_header = self._make_points(points.message, points.info), points.message.header
                if self._registration is not None:
                    grid, points_header = self._registration(grid, points_header)
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

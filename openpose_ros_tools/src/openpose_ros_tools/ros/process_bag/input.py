"""What process_bag reads: the topics of a camera in a bag, its frames, transforms."""
import itertools
import logging
import struct
from dataclasses import dataclass, field
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Type, Union

import genpy
import numpy as np
import rosbag
import tf2_py
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.convert import any_image_to_bgr, compressed_depth_to_image
from openpose_ros_pkg.stream.pairing import PairingParams, StampMatcher
from openpose_ros_tools.ros.bag_files import stamped_messages, topic_types, undamaged
from openpose_ros_tools.ros.camera_topics import (
    camera_of,
    clouds,
    image_topics,
    is_result,
    listed,
    organized_clouds,
    preferred,
)
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.ros.lifter import Lifter

_log = logging.getLogger(__name__)

# First stamps of each stream, of when both are there, that the usual difference between them is learnt from, before
# the first pair is made.
_LEARNT = 9
# Images and clouds that may wait for their partner where `queue_size` leaves it open: a recording has the time.
_QUEUE = 50
# Transforms are read so far ahead of the frame [s], as they may be recorded later than the image; and kept so long.
_TF_AHEAD, _TF_KEPT = 3.0, 30.0
_CLASSES = {kind._type: kind for kind in (Image, CompressedImage, PointCloud2, CameraInfo)}
# secs and nsecs in the header that a message begins with, behind seq.
_STAMP, _STAMP_OFFSET = struct.Struct('<II'), 4


@dataclass(frozen=True)
class Topics:
    """The topics of a camera; empty: to be found, or none.

    Attributes:
        image: raw or compressed.
        points: of clouds.
        depth: of depth images aligned to the image, raw or compressed, in place of clouds.
        camera_info: of the depth images.
    """

    image: str = ''
    points: str = ''
    depth: str = ''
    camera_info: str = ''

    @property
    def in_space(self) -> bool:
        """Whether there are points."""
        return bool(self.points or self.depth)


@dataclass
class Frame:
    """An image, and the points of the same view where the recording has some.

    Attributes:
        time: of recording, of the later of both.
        header: of the image.
        bgr: (H, W, 3) uint8; None with an error.
        points, points_header: None in 2D.
        error: why it can not be used.
    """

    time: genpy.Time
    header: Header
    bgr: Optional[np.ndarray] = None
    points: Optional[PointGrid] = None
    points_header: Optional[Header] = None
    error: Optional[BadInputError] = None


@dataclass(frozen=True)
class Original:
    """A message that is copied: as `rosbag.Bag.write` takes it."""

    topic: str
    message: Tuple[Any, ...]
    time: genpy.Time
    connection: Dict[str, Any]


@dataclass
class Counts:
    """What a recording has that became no frame.

    Attributes:
        images: all images that were read.
        alone: images, and points, without a partner.
        unusable: messages without a stamp, or not newer than the one before.
        resets: times that the stamps jumped back.
    """

    images: int = 0
    alone: List[int] = field(default_factory=lambda: [0, 0])
    unusable: int = 0
    resets: int = 0


def find_topics(bag: rosbag.Bag, wanted: Topics, only_2d: bool = False, prefer_depth: bool = False) -> Topics:
    """Return the topics of the camera in a bag.

    Args:
        wanted: those that are named are taken; the others are found by their types and names.
        only_2d: whether to leave points alone.
        prefer_depth: whether to take depth images where there are clouds as well.

    Raises:
        BadInputError: a topic is not there or has another type, or it is not clear which one to take.
    """
    types = topic_types(bag)
    images = image_topics(bag, types)
    image = wanted.image
    if image:
        _check_type(bag, types, '--image', image, (Image, CompressedImage))
    else:
        image = _chosen(bag, types, 'images', '--image', images['colour'], 'colour')
    if only_2d:
        return Topics(image)
    if wanted.points:
        _check_type(bag, types, '--points', wanted.points, (PointCloud2,))
        return Topics(image, points=wanted.points)
    organized = organized_clouds(bag, types)
    if organized and not wanted.depth and not prefer_depth:
        return Topics(image, points=_chosen(bag, types, 'clouds', '--points', organized, 'points'))
    depth = [topic for topic in images['depth'] if topic != image]
    if depth or wanted.depth or prefer_depth:
        return _with_depth(bag, types, image, depth, wanted)
    if clouds(types):
        _log.warning('people are found in the images alone: the clouds on %s have not the rows of an image; drivers '
                     'give such ones when asked for ordered or registered clouds', ', '.join(clouds(types)))
    return Topics(image)


class Recording:
    """The frames of a bag, in its order.

    Args:
        bag: open.
        topics: of the camera.
        copied: topics whose messages come as well, between the frames.
        pairing: how images and points are paired.
        lifter: makes points of messages; None in 2D.

    Attributes:
        counts: of what was read so far.
    """

    def __init__(self, bag: rosbag.Bag, topics: Topics, copied: Sequence[str], pairing: PairingParams,
                 lifter: Optional[Lifter]) -> None:
        self._bag, self._topics, self._lifter = bag, topics, lifter
        self._copied = frozenset(copied)
        self._points_topic = topics.points or topics.depth
        self.counts = Counts()
        self._info: Optional[CameraInfo] = None
        self._matcher: Optional[StampMatcher] = None
        if topics.in_space:
            self._matcher = self._prepared(pairing)
        if topics.depth:
            # holds for the depth images before it as well
            self._info = _deserialized(next(_read(bag, [topics.camera_info])).message)
            self._check_frames()

    def __iter__(self) -> Iterator[Union[Frame, Original]]:
        """Read everything once.

        Raises:
            BadInputError: the bag is damaged.
        """
        topics = self._topics
        inputs = {topics.image: self._image, self._points_topic: self._points, topics.camera_info: self._camera_info}
        inputs.pop('', None)
        for message in _read(self._bag, [*inputs, *self._copied]):
            if message.topic in self._copied:
                yield Original(message.topic, message.message, message.timestamp, message.connection_header)
            if message.topic in inputs:
                yield from inputs[message.topic](_deserialized(message.message), message.timestamp)
        if self._matcher is not None:
            for pair in self._matcher.finish():
                yield self._frame(*pair)
            self.counts.alone = self._matcher.unpaired

    def _image(self, message: Union[Image, CompressedImage], time: genpy.Time) -> Iterator[Frame]:
        self.counts.images += 1
        if self._matcher is not None:
            return self._matched(0, message, time)
        return iter([self._frame((message, time))])

    def _points(self, message: Union[PointCloud2, Image, CompressedImage], time: genpy.Time) -> Iterator[Frame]:
        return self._matched(1, message, time, self._info)

    def _camera_info(self, message: CameraInfo, _time: genpy.Time) -> Iterator[Frame]:
        self._info = message
        return iter(())

    def _matched(self, stream: int, message: Any, *rest: Any) -> Iterator[Frame]:
        matcher, stamp = self._matcher, message.header.stamp
        if stamp.is_zero():
            self.counts.unusable += 1
            return
        before = matcher.out_of_order
        pair = matcher.add(stream, stamp.to_nsec(), (message, *rest))
        self.counts.unusable += matcher.out_of_order - before
        self.counts.alone, self.counts.resets = matcher.unpaired, matcher.resets
        if pair is not None:
            yield self._frame(*pair)

    def _frame(self, of_image: Tuple[Any, genpy.Time], of_points: Optional[Tuple[Any, genpy.Time, Any]] = None
               ) -> Frame:
        """Return the frame of an image and points, each with its time of recording."""
        image, time = of_image
        frame = Frame(time if of_points is None else max(time, of_points[1]), image.header)
        try:
            if of_points is not None:
                points, _, info = of_points
                if points._type == CompressedImage._type:
                    points = compressed_depth_to_image(points)
                frame.points, frame.points_header = self._lifter.points(points, info), points.header
            frame.bgr = any_image_to_bgr(image)
        except BadInputError as error:
            frame.error = error
        return frame

    def _prepared(self, params: PairingParams) -> StampMatcher:
        """Return a matcher that knows the usual difference between the stamps, from the first ones of each stream."""
        if params.queue_size == 0:
            params = PairingParams(slop=params.slop, queue_size=_QUEUE)
        matcher = StampMatcher(params)
        topics = (self._topics.image, self._points_topic)
        first = [next(_read(self._bag, [topic])) for topic in topics]
        if _stamp(first[0]) == _stamp(first[1]):
            return matcher  # one driver stamps both
        both = max(message.timestamp for message in first)
        stamps = [(_stamp(message).to_nsec(), stream) for stream, topic in enumerate(topics)
                  for message in itertools.islice(_read(self._bag, [topic], both), _LEARNT)]
        for stamp, stream in sorted(item for item in stamps if item[0]):
            matcher.add(stream, stamp, None)
        matcher.restart()
        return matcher

    def _check_frames(self) -> None:
        """Say where depth images seem to be none of the view of the images; nothing in a message tells for sure."""
        names = [next(stamped_messages(self._bag, [topic])).frame_id for topic in (self._topics.image,
                                                                                   self._topics.depth)]
        if names[0].lstrip('/') != names[1].lstrip('/'):
            _log.warning("%s is of frame '%s', but %s of '%s': joints are right in space only where the depth images "
                         'are aligned to the images', self._topics.image, names[0], self._topics.depth, names[1])


class Transforms:
    """The transforms of a bag, read on as the frames come.

    Args:
        bag: open, and read by nobody else meanwhile.
    """

    def __init__(self, bag: rosbag.Bag) -> None:
        types = bag.get_type_and_topic_info().topics
        topics = [topic for topic in ('/tf', '/tf_static', 'tf', 'tf_static') if topic in types]
        self._messages = _read(bag, topics) if topics else iter(())
        self._next = next(self._messages, None)
        self._buffer = tf2_py.BufferCore(genpy.Duration.from_sec(_TF_KEPT))

    def read_until(self, time: genpy.Time) -> None:
        """Read what was recorded until a while after this time."""
        until = time + genpy.Duration.from_sec(_TF_AHEAD)
        while self._next is not None and self._next.timestamp <= until:
            message = _deserialized(self._next.message, TFMessage)
            for transform in message.transforms:
                if self._next.topic.endswith('tf_static'):
                    self._buffer.set_transform_static(transform, 'bag')
                else:
                    self._buffer.set_transform(transform, 'bag')
            self._next = next(self._messages, None)

    def lookup(self, target: str, source: str, stamp: genpy.Time) -> TransformStamped:
        """Return the transform from `source` to `target` at a time.

        Raises:
            tf2_py.TransformException: there is none.
        """
        return self._buffer.lookup_transform_core(target, source, stamp)


def copied_topics(bag: rosbag.Bag, wanted: Sequence[str]) -> List[str]:
    """Return the topics to be copied: those that are named, or with 'all' everything but results of this project.

    Raises:
        BadInputError: a topic is not there, or is a result that is made anew.
    """
    there = sorted(bag.get_type_and_topic_info().topics)
    if 'all' in wanted:
        return [topic for topic in there if not is_result(topic)]
    for topic in wanted:
        if topic not in there:
            raise BadInputError(f"--copy {topic}: not in the bag, which has {', '.join(there)}")
        if is_result(topic):
            raise BadInputError(f'--copy {topic}: that is a result, which is made anew')
    return list(wanted)


def _with_depth(bag: rosbag.Bag, types: Mapping[str, str], image: str, candidates: Sequence[str], wanted: Topics
                ) -> Topics:
    """Return the topics of a camera with depth images; see `find_topics`."""
    depth = wanted.depth
    if depth:
        _check_type(bag, types, '--depth', depth, (Image, CompressedImage))
    else:
        depth = _chosen(bag, types, 'depth images', '--depth', candidates, 'depth')
    info = wanted.camera_info
    if info:
        _check_type(bag, types, '--camera-info', info, (CameraInfo,))
        return Topics(image, depth=depth, camera_info=info)
    infos = [topic for topic, name in types.items() if name == CameraInfo._type]
    for beside in (depth, image):
        sibling = f'{camera_of(beside)}/camera_info'
        if sibling in infos:
            return Topics(image, depth=depth, camera_info=sibling)
    return Topics(image, depth=depth, camera_info=_chosen(
        bag, types, f'camera infos for the depth images {depth}', '--camera-info', infos, 'colour'))


def _chosen(bag: rosbag.Bag, types: Mapping[str, str], what: str, option: str, candidates: Sequence[str],
            stream: str) -> str:
    """Return the only candidate, or the only one that is preferred."""
    best = preferred(candidates, stream)
    if len(best) == 1:
        return best[0]
    if candidates:
        raise BadInputError(f"{bag.filename} has several topics of {what}, choose one with {option}: "
                            f"{', '.join(sorted(candidates))}")
    raise BadInputError(f'{bag.filename} has no topic of {what}; it has {listed(types)}')


def _check_type(bag: rosbag.Bag, types: Mapping[str, str], option: str, topic: str,
                kinds: Sequence[Type[genpy.Message]]) -> None:
    if topic not in types:
        raise BadInputError(f'{option} {topic}: {bag.filename} has no such topic; it has {listed(types)}')
    if types[topic] not in [kind._type for kind in kinds]:
        raise BadInputError(f"{option} {topic} is of type {types[topic]}, expected "
                            f"{' or '.join(kind._type for kind in kinds)}")


def _read(bag: rosbag.Bag, topics: Sequence[str], start: Optional[genpy.Time] = None) -> Iterator[Any]:
    """Return the messages of topics as they are stored: topic, message, timestamp, connection_header.

    Args:
        start: time of the recording; None: all.

    Raises:
        BadInputError: the bag is damaged.
    """
    return undamaged(bag, bag.read_messages(topics=list(topics), start_time=start, raw=True,
                                            return_connection_header=True))


def _stamp(message: Any) -> genpy.Time:
    """Return the stamp of a stored message that begins with a header."""
    data = message.message[1]
    if len(data) < _STAMP_OFFSET + _STAMP.size:
        raise BadInputError(f'the bag is damaged: a message of {message.topic} has {len(data)} bytes')
    return genpy.Time(*_STAMP.unpack_from(data, _STAMP_OFFSET))


def _deserialized(message: Tuple[Any, ...], kind: Optional[Type[genpy.Message]] = None) -> Any:
    """Return a message of the class that this project knows it by.

    Raises:
        BadInputError: it has another definition, or is damaged.
    """
    name, data, checksum = message[:3]
    kind = kind or _CLASSES[name]
    if checksum != kind._md5sum:
        raise BadInputError(f'messages of type {name} in the bag have another definition than {kind._type} here')
    try:
        return kind().deserialize(data)
    except genpy.DeserializationError as error:
        raise BadInputError(f'a {name} in the bag is damaged: {error}') from error

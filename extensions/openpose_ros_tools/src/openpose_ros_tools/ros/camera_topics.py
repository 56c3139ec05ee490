"""The topics of a camera in a bag, found by their types, encodings and names."""
import logging
import re
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import rosbag

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.camera_presets import CAMERA_INFO, CLOUD, COMPRESSED, IMAGE
from openpose_ros_pkg.ros.convert import is_png_of_depth
from openpose_ros_tools.ros.bag_files import messages_of, topic_types

DEPTH_ENCODINGS = ('16UC1', '32FC1', 'mono16')

CAMERA_NAMESPACE = '/kinect2/qhd'
"""Namespace of the topics that the launch files of this project subscribe to."""
TOPICS = {'camera_info': 'camera_info', 'image': 'image_color', 'depth': 'image_depth_rect', 'points': 'points'}
"""Topics in the camera's namespace, in the order in which messages with one stamp are written."""

# Topics of this project are results, of an earlier run or of a live recording, and no input.
_RESULTS = re.compile(r'(^|/)openpose_ros/')
_DEPTH_NAME, _OTHER_NAME = (re.compile(pattern, re.IGNORECASE) for pattern in (
    'depth|disparity', r'mask|(^|[/_])(ir|infra\d?|confidence)($|[/_])'))
# Types of depth that are not read.
_UNREAD = ('theora_image_transport/Packet', 'stereo_msgs/DisparityImage')
_log = logging.getLogger(__name__)


class _Stream(NamedTuple):
    title: str  # in errors
    option: str  # that names its topic
    kinds: Tuple[str, ...]  # types of its messages
    # of several topics the one with such a name is preferred
    likely: str


_STREAMS = {
    'colour': _Stream('colour images', '--image', (IMAGE, COMPRESSED), 'colou?r|rgb'),
    # that a driver has aligned to the colour image
    'depth': _Stream('depth images', '--depth', (IMAGE, COMPRESSED), 'aligned|registered|depth_to_(rgb|colou?r)'),
    'points': _Stream('clouds', '--points', (CLOUD,), 'colou?r|rgb|registered'),
    'camera_info': _Stream('camera infos', '--camera-info', (CAMERA_INFO,), 'colou?r|rgb')}


def is_result(topic: str) -> bool:
    """Return whether a topic is one that this project publishes."""
    return bool(_RESULTS.search(topic))


def is_within(topic: str, namespace: str) -> bool:
    """Return whether a topic is in a namespace, with or without the leading slash of both."""
    return f"/{topic.strip('/')}".startswith(f"/{namespace.strip('/')}/")


def is_depth(topic: str, encoding: str) -> bool:
    """Return whether images with this encoding are depth: infrared cameras have mono16 as well."""
    return encoding in DEPTH_ENCODINGS and (encoding != 'mono16' or bool(_DEPTH_NAME.search(topic)))


def raw_topic(topic: str) -> str:
    """Return the topic of the raw images that a topic has compressed; the topic of raw images as it is."""
    head, _, last = topic.rpartition('/')
    return head if last in ('compressed', 'compressedDepth', 'theora') else topic


def depth_unit(bag: rosbag.Bag, depth: str) -> float:
    """Return the unit of 16-bit depth images [m]: mm (REP 118), or that which the RealSense Viewer has written."""
    option = re.sub('/[^/]+/image/data$', '/option/Depth_Units/value', depth)
    if option == depth or option not in topic_types(bag):
        return 0.001
    return round(float(next(messages_of(bag, [option])).message.data), 9)  # it is float32


class TopicFinder:
    """Finds the topics of a camera in a bag; streams are 'colour', 'depth', 'points' and 'camera_info'.

    Args:
        bag: open.
        namespace: topics outside of it are not there; empty: all are.

    Attributes:
        types: type of each topic, see `topic_types`.
        candidates: by stream the topics that may be it: without results of this project, and without compressed images
            where the raw ones are there. Of 'points' also clouds that are not organized.

    Raises:
        BadInputError: the bag is damaged.
    """

    def __init__(self, bag: rosbag.Bag, namespace: str = '') -> None:
        self._bag = bag
        self.types = {topic: kind for topic, kind in topic_types(bag).items()
                      if not namespace or is_within(topic, namespace)}
        self._passed_over: Dict[str, str] = {}  # topics that may hold depth, and why they are not taken
        self.candidates: Dict[str, List[str]] = {stream: [] for stream in _STREAMS}
        for topic, kind in sorted(self.types.items()):
            stream = None if is_result(topic) else self._stream_of(topic, kind)
            if stream is not None:
                self.candidates[stream].append(topic)

    def organized_clouds(self) -> List[str]:
        """Return the topics of clouds that have the rows of an image."""
        return [topic for topic in self.candidates['points'] if self._first(topic).height != 1]

    def named(self, stream: str, topic: str, *other_kinds: str) -> str:
        """Return a topic that the user has named; its type is one of the stream's, or of `other_kinds`.

        Raises:
            BadInputError: it is not there, or has another type.
        """
        _, option, kinds, _ = _STREAMS[stream]
        if topic not in self.types:
            raise BadInputError(f'{option} {topic}: {self._bag.filename} has no such topic; it has {self.listed()}')
        if self.types[topic] not in (*kinds, *other_kinds):
            raise BadInputError(f'{option} {topic} is of type {self.types[topic]}, expected '
                                + ' or '.join((*kinds, *other_kinds)))
        return topic

    def choose(self, stream: str, candidates: Sequence[str]) -> Optional[str]:
        """Return the only candidate for a stream, or the only preferred one; None if there is no candidate.

        Raises:
            BadInputError: several come into question.
        """
        title, option, _, likely = _STREAMS[stream]
        usual = [f'{CAMERA_NAMESPACE}/{name}' for name in TOPICS.values()]
        best = list(candidates)
        for test in (lambda topic: raw_topic(topic) in usual, re.compile(likely, re.IGNORECASE).search):
            if len(best) > 1:
                best = [topic for topic in candidates if test(topic)] or list(candidates)
        if len(best) > 1:
            raise BadInputError(f'{self._bag.filename} has {len(candidates)} topics of {title}, choose one with '
                                f"{option}: {', '.join(sorted(candidates))}")
        return best[0] if best else None

    def required(self, stream: str, wanted: str, candidates: Sequence[str]) -> str:
        """Return the topic that the user wants, or where that is empty what `choose` does.

        Raises:
            BadInputError: it is not there, there is no candidate, or several come into question.
        """
        topic = self.named(stream, wanted) if wanted else self.choose(stream, candidates)
        if topic is None:
            raise BadInputError(f'{self._bag.filename} has no topic of {_STREAMS[stream].title}; it has '
                                f'{self.listed()}')
        return topic

    def camera_info_of(self, *images: str) -> Optional[str]:
        """Return the topic of the calibration in the namespace of the first of these topics that has one, or None.

        The RealSense Viewer writes /device_0/sensor_1/Color_0/image/data, and /info/camera_info beside /image.
        """
        beside = (name for topic in images for name in (
            f'{raw_topic(topic).rpartition("/")[0]}/camera_info', topic.replace('/image/data', '/info/camera_info')))
        return next((topic for topic in beside if topic in self.candidates['camera_info']), None)

    def listed(self) -> str:
        """Return topics and types for an error message."""
        return ', '.join(f'{topic} ({kind})' for topic, kind in sorted(self.types.items())) or 'no messages at all'

    def warn_without_depth(self) -> None:
        """Say which topics may hold depth, and why they are passed over."""
        no_rows = 'it has not the rows of an image, as drivers send when asked for ordered or registered clouds'
        passed = {**dict.fromkeys(self.candidates['points'], no_rows), **self._passed_over}
        if passed:
            _log.warning('there is no depth: %s; --depth names another topic',
                         '; '.join(f'{topic}: {why}' for topic, why in passed.items()))

    def _stream_of(self, topic: str, kind: str) -> Optional[str]:
        if kind in (CLOUD, CAMERA_INFO):
            return 'points' if kind == CLOUD else 'camera_info'
        if (raw_topic(topic) != topic and self.types.get(raw_topic(topic)) == IMAGE) or f'{topic}Depth' in self.types:
            return None
        if kind not in (IMAGE, COMPRESSED):
            if kind in _UNREAD and _DEPTH_NAME.search(topic):
                self._passed_over[topic] = f'{kind} is not read'
            return None
        first = self._first(topic)
        encoding = first.encoding if kind == IMAGE else first.format.partition(';')[0].strip()
        if is_depth(topic, encoding) if kind == IMAGE else topic.endswith('/compressedDepth') or (
                is_png_of_depth(first.data) and (encoding == '16UC1' or _DEPTH_NAME.search(topic))):
            return 'depth'
        if _OTHER_NAME.search(topic):
            return None
        # only its name says what a compressed image shows; raw images that are no depth may be of a camera named so
        name = topic if kind == COMPRESSED else topic.rpartition('/')[2]
        if not (encoding in ('16UC1', '32FC1') or _DEPTH_NAME.search(name)):
            return 'colour'
        self._passed_over[topic] = f'its encoding {encoding} is no depth' if kind == IMAGE else (
            f"'{first.format.strip()}' has lost the depth; record compressedDepth, or compressed as png")
        return None

    def _first(self, topic: str) -> Any:
        return next(messages_of(self._bag, [topic])).message

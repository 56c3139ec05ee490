"""The finders of topics: of a camera in a bag, by names, types and content; with people, in a bag or at a master."""
import logging
import re
from typing import Any, Callable, Dict, Iterable, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.camera_presets import (
    AUTO,
    CAMERA_INFO,
    CLOUD,
    COMPRESSED,
    IMAGE,
    CameraPreset,
    choose_camera,
    find_preset,
    info_beside,
    raw_topic,
)
from openpose_ros_pkg.ros.convert import is_png_of_depth

_log = logging.getLogger(__name__)

IN_IMAGE, IN_SPACE = 'openpose_ros', 'openpose_ros/skeleton_3d'
"""Namespaces of people, in that of their camera."""
FUSED = 'people'
"""Namespace of the people of several cameras, as cameras.launch has it."""
DEPTH_ENCODINGS = ('16UC1', '32FC1', 'mono16')
CAMERA_NAMESPACE = '/kinect2/qhd'
"""Namespace of the topics that the launch files of this project subscribe to."""
TOPICS = {'camera_info': 'camera_info', 'image': 'image_color', 'depth': 'image_depth_rect', 'points': 'points'}
"""Topics in the camera's namespace, in the order in which messages with one stamp are written."""

# Types with people, hands, faces and signals, and their dimensions, in the order of preference: space before image, and
# single people before arrays, as both contain the same people.
PARTS: Dict[str, Dict[str, int]] = {
    'people': {'openpose_ros_msgs/PersonDetection_3d': 3, 'openpose_ros_msgs/PersonDetection_3dArray': 3,
               'openpose_ros_msgs/PersonDetection': 2, 'openpose_ros_msgs/PersonDetectionArray': 2},
    'hands': {'openpose_ros_msgs/HandDetection_3dArray': 3, 'openpose_ros_msgs/HandDetectionArray': 2},
    'faces': {'openpose_ros_msgs/FaceDetection_3dArray': 3, 'openpose_ros_msgs/FaceDetectionArray': 2},
    'signals': {'openpose_ros_msgs/PersonSignalsArray': 3}}
DIMENSIONS = PARTS['people']
# Beside the people of the fusion node there is a topic `cameras` of this type.
_FUSED_CAMERAS = 'openpose_ros_msgs/FusedCameraArray'
_DEPTH_NAME, _OTHER_NAME = (re.compile(pattern, re.IGNORECASE) for pattern in (
    'depth|disparity', r'mask|(^|[/_])(ir|infra\d?|confidence)($|[/_])'))
_LISTED = 8  # topics in an error message


class CameraTopics(NamedTuple):
    """The topics of a camera; empty: to be found, or none."""

    image: str = ''  # raw or compressed
    points: str = ''  # of clouds
    depth: str = ''  # of depth images aligned to the image, raw or compressed, in place of clouds
    camera_info: str = ''  # of the depth images, and of a camera without depth that is fused with others
    image_info: str = ''  # calibration of the images, beside which points are

    @property
    def in_space(self) -> bool:
        """Whether there are points."""
        return bool(self.points or self.depth)


FOUND = CameraTopics()
"""No topic is named: all are found."""


class KeypointTopic(NamedTuple):
    """A topic with people, hands, faces or signals; dimensions: 3 in space, 2 in the image; part: one of `PARTS`."""

    name: str
    kind: str
    dimensions: int
    part: str = 'people'

    @property
    def namespace(self) -> str:
        """Namespace of the topic."""
        return self.name.rpartition('/')[0]


class _Stream(NamedTuple):
    title: str  # in errors
    option: str  # that names its topic
    kinds: Tuple[str, ...]  # types of its messages
    likely: str  # of several topics the one with such a name is preferred


_STREAMS = {
    'colour': _Stream('colour images', '--image', (IMAGE, COMPRESSED), 'colou?r|rgb'),
    # that a driver has aligned to the colour image
    'depth': _Stream('depth images', '--depth', (IMAGE, COMPRESSED), 'aligned|registered|depth_to_(rgb|colou?r)'),
    'points': _Stream('clouds', '--points', (CLOUD,), 'colou?r|rgb|registered'),
    'camera_info': _Stream('camera infos', '--camera-info', (CAMERA_INFO,), 'colou?r|rgb')}


def absolute(topic: str) -> str:
    """Return the name of a topic with its leading slash, which bags made by programs may lack."""
    return '/' + topic.strip('/')


def is_result(topic: str) -> bool:
    """Return whether a topic is one that this project publishes."""
    return f'/{IN_IMAGE}/' in absolute(topic)


def is_within(topic: str, namespace: str) -> bool:
    """Return whether a topic is in a namespace, with or without the leading slash of both; all are in the empty one."""
    return absolute(topic).startswith(f'{absolute(namespace)}/' if namespace.strip('/') else '/')


class TopicFinder:
    """Finds the topics of a camera; streams are 'colour', 'depth', 'points' and 'camera_info'.

    Args:
        types: type of each topic.
        first: gets the first message of a topic.
        where: these topics are, for errors.
        namespace: topics outside of it are not there.

    Attributes:
        types: of the topics in the namespace.
        candidates: by stream the topics that may be it: without results of this project, and without compressed images
            where the raw ones are there. Of 'points' also clouds that are not organized.
    """

    def __init__(self, types: Mapping[str, str], first: Callable[[str], Any], where: str, namespace: str = '') -> None:
        self._first, self._where, self._namespace = first, where, namespace
        self.types = {topic: kind for topic, kind in types.items() if is_within(topic, namespace)}
        self._unused: List[str] = []  # that may hold depth, but are not taken
        self.candidates: Dict[str, List[str]] = {stream: [] for stream in _STREAMS}
        for topic, kind in sorted(self.types.items()):
            stream = None if is_result(topic) else self._stream_of(topic, kind)
            if stream is not None:
                self.candidates[stream].append(topic)

    def camera(self, named: CameraTopics = FOUND, preset: str = '', only_2d: bool = False,
               prefer_depth: bool = False, needs_info: bool = False) -> Tuple[CameraTopics, bool]:
        """Return the topics of the camera, and whether its preset says that images are rectified.

        Args:
            named: topics that are taken, in the namespace; the others are those of the preset, or are found.
            preset: name of the camera, or auto.
            only_2d: whether to ignore points.
            prefer_depth: whether to take depth images where there are clouds as well.
            needs_info: whether a camera without depth needs a calibration.

        Raises:
            BadInputError: a topic is not there or has another type, or it is not clear which one to take.
            ParameterError: there is no such preset.
        """
        named = CameraTopics(*(topic and (absolute(f'{self._namespace}/{topic.strip("/")}') if self._namespace
                                          else topic) for topic in named))
        found = self._preset(preset, only_2d) if preset else None
        if found is not None:
            only_2d = only_2d or found[0].dimensions == 2
            named = self._with_preset(named, *found, only_2d)
        topics = self._camera(named, only_2d, prefer_depth)
        if needs_info and not topics.in_space:
            topics = topics._replace(camera_info=self.required(
                'camera_info', named.camera_info or topics.image_info, self.candidates['camera_info']))
        return topics, found is not None and found[0].rectified

    def _camera(self, named: CameraTopics, only_2d: bool, prefer_depth: bool) -> CameraTopics:
        image = self.required('colour', named.image, self.candidates['colour'])
        image_info = self.camera_info_of(image) or ''
        if only_2d:
            return CameraTopics(image, image_info=image_info)
        organized = [] if named.in_space or prefer_depth else self.organized_clouds()
        if named.points or organized:
            return CameraTopics(image, self.required('points', named.points, organized), image_info=image_info)
        depths = [topic for topic in self.candidates['depth'] if topic != image]
        if depths or named.depth or prefer_depth:
            depth = self.required('depth', named.depth, depths)
            info = named.camera_info or self.camera_info_of(depth) or image_info
            return CameraTopics(image, '', depth, self.required(
                'camera_info', info, self.candidates['camera_info']), image_info)
        self.warn_without_depth()
        return CameraTopics(image, image_info=image_info)

    def _preset(self, name: str, only_2d: bool) -> Tuple[CameraPreset, str]:
        """Return the preset of the camera, and the namespace of its topics."""
        if name != AUTO:
            preset = find_preset(name)
            return preset, self._namespace or preset.ns
        raw = {raw_topic(topic): IMAGE if kind == COMPRESSED else kind for topic, kind in self.types.items()}
        choice = choose_camera(raw, 2 if only_2d else 3)
        if choice.chosen is None:
            raise BadInputError(f'--camera auto: {self._where} has the topics of no camera; there is: {choice}')
        return choice.chosen.preset, choice.chosen.ns

    def _with_preset(self, named: CameraTopics, preset: CameraPreset, namespace: str, only_2d: bool) -> CameraTopics:
        """Return the topics that are named, and those of a preset; depth images where its cloud was not recorded."""
        has_cloud = preset.points_source == 'point_cloud' and (
            preset.topic('points', namespace) in self.types or not preset.depth)
        roles: Tuple[str, ...] = ('image', 'points') if has_cloud else ('image', 'depth', 'camera_info')
        if named.in_space:
            roles = ('image',)
        elif only_2d or not preset.points_source:
            roles = ('image', 'camera_info') if preset.topic('camera_info', namespace) in self.types else ('image',)
        return named._replace(**{role: self._recorded(preset.topic(role, namespace)) for role in roles
                                 if not getattr(named, role)})

    def _recorded(self, topic: str) -> str:
        """Return a topic as it is there, raw or compressed."""
        return next((name for name in (topic, f'{topic}/compressedDepth', f'{topic}/compressed')
                     if name in self.types), topic)

    def organized_clouds(self) -> List[str]:
        """Return the topics of clouds that have the rows of an image."""
        return [topic for topic in self.candidates['points'] if self._first(topic).height != 1]

    def named(self, stream: str, topic: str) -> str:
        """Return a topic that the user has named; its type is one of the stream's.

        Raises:
            BadInputError: it is not there, or has another type.
        """
        _, option, kinds, _ = _STREAMS[stream]
        if topic not in self.types:
            raise BadInputError(f'{option} {topic}: {self._where} has no such topic; it has {self.listed()}')
        if self.types[topic] not in kinds:
            raise BadInputError(f'{option} {topic} is of type {self.types[topic]}, expected '
                                + ' or '.join(kinds))
        return topic

    def required(self, stream: str, wanted: str, candidates: Sequence[str]) -> str:
        """Return the topic that the user wants, or where that is empty the only candidate, or the only preferred one.

        Raises:
            BadInputError: it is not there, there is no candidate, or several come into question.
        """
        if wanted:
            return self.named(stream, wanted)
        title, option, _, likely = _STREAMS[stream]
        if not candidates:
            raise BadInputError(f'{self._where} has no topic of {title}; it has {self.listed()}')
        usual = [f'{CAMERA_NAMESPACE}/{name}' for name in TOPICS.values()]
        best = list(candidates)
        for test in (lambda topic: raw_topic(topic) in usual, re.compile(likely, re.IGNORECASE).search):
            if len(best) > 1:
                best = [topic for topic in candidates if test(topic)] or list(candidates)
        if len(best) > 1:
            raise BadInputError(f'{self._where} has {len(candidates)} topics of {title}, choose one with {option}: '
                                f"{', '.join(sorted(candidates))}")
        return best[0]

    def camera_info_of(self, image: str) -> Optional[str]:
        """Return the topic of the calibration in the namespace of an image, or None."""
        return info_beside(image) if info_beside(image) in self.candidates['camera_info'] else None

    def listed(self) -> str:
        """Return topics and types for an error message."""
        return ', '.join(f'{topic} ({kind})' for topic, kind in sorted(self.types.items())) or 'no messages at all'

    def warn_without_depth(self) -> None:
        """Say which topics may hold depth, but are not taken."""
        unused = [*self.candidates['points'], *self._unused]
        if unused:
            _log.warning('there is no depth: neither a cloud with the rows of an image nor readable depth images are '
                         'on %s; --depth names another topic', ', '.join(unused))

    def _stream_of(self, topic: str, kind: str) -> Optional[str]:
        if kind in (CLOUD, CAMERA_INFO):
            return 'points' if kind == CLOUD else 'camera_info'
        if kind not in (IMAGE, COMPRESSED) or f'{topic}Depth' in self.types or (
                raw_topic(topic) != topic and self.types.get(raw_topic(topic)) == IMAGE):
            return None
        first, is_named_depth = self._first(topic), bool(_DEPTH_NAME.search(topic))
        encoding = first.encoding if kind == IMAGE else first.format.partition(';')[0].strip()
        if kind == IMAGE:  # infrared cameras have mono16 as well
            is_depth = is_named_depth if encoding in ('', 'mono16') else encoding in DEPTH_ENCODINGS
        else:
            is_depth = topic.endswith('/compressedDepth') or (
                is_png_of_depth(first.data) and (encoding == '16UC1' or is_named_depth))
        if is_depth or _OTHER_NAME.search(topic):
            return 'depth' if is_depth else None
        # only its name says what a compressed image shows; raw images that are no depth may be of a camera named so
        name = topic if kind == COMPRESSED else topic.rpartition('/')[2]
        if encoding in ('16UC1', '32FC1') or _DEPTH_NAME.search(name):
            self._unused.append(topic)
            return None
        return 'colour'


def people_topics(types: Mapping[str, str]) -> Dict[str, str]:
    """Return the topic with people of each camera's namespace ('' is the root), with depth before without.

    Fused people are those of no camera: what has the namespace of `process_bag` for them, or comes from a fusion node.
    """
    found: Dict[str, str] = {}
    for ending in (f'{IN_SPACE}/detected_poses_3d', f'{IN_IMAGE}/detected_poses'):
        for topic in sorted(types):
            match = re.fullmatch(f'/?(.*?)/?{ending}', topic)
            name = match.group(1) if match else FUSED
            if name != FUSED and types[topic] in DIMENSIONS and types.get(f'/{name}/cameras') != _FUSED_CAMERAS:
                found.setdefault(name, topic)
    return found


def choose_topic(types: Mapping[str, str], where: str, topic: Optional[str] = None, part: str = 'people'
                 ) -> KeypointTopic:
    """Return the topic with keypoints to read.

    Args:
        types: type of each topic.
        where: these topics are, for errors.
        topic: name; None: the only one of the most preferred type that is there, see `PARTS`.
        part: what is in it, one of `PARTS`.

    Raises:
        BadInputError: it is not there or holds no people, or several come into question.
    """
    kinds = PARTS[part]
    known = {absolute(name): kind for name, kind in types.items()}
    with_people = {name: kind for name, kind in sorted(known.items()) if kind in kinds}
    if topic is not None:
        name = absolute(topic)
        if name not in with_people:
            reason = f'topic {name} in {where} is of type {known[name]}' if name in known else (
                f'there is no topic {name} in {where}')
            raise BadInputError(f'{reason}; {_listed(with_people, known, kinds)}')
        return KeypointTopic(name, known[name], kinds[known[name]], part)
    for kind, dimensions in kinds.items():
        names = [name for name in with_people if with_people[name] == kind]
        if len(names) > 1:
            raise BadInputError(f'{where} has several topics of type {kind}: {", ".join(names)}; choose with --topic')
        if names:
            return KeypointTopic(names[0], kind, dimensions, part)
    raise BadInputError(f'there are no {"keypoints" if part == "people" else part} in {where}; '
                        f'{_listed(with_people, known, kinds)}')


def _listed(with_people: Mapping[str, str], types: Mapping[str, str], kinds: Iterable[str]) -> str:
    if with_people:
        return 'keypoints are in ' + ', '.join(f'{name} ({kind})' for name, kind in with_people.items())
    if not types:
        return 'it has no topics'
    shown = [f'{name} ({kind})' for name, kind in sorted(types.items())]
    more = f' and {len(shown) - _LISTED} more' if len(shown) > _LISTED else ''
    return f'its topics are {", ".join(shown[:_LISTED])}{more}; types with keypoints are {", ".join(kinds)}'

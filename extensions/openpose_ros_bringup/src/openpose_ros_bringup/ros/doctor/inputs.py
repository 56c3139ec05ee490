"""Which topics are those of a camera: what nodes read, what the user names, or what a preset says."""
import re
from dataclasses import replace
from difflib import SequenceMatcher
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2

from openpose_ros_bringup.doctor.findings import says_registered
from openpose_ros_bringup.doctor.snapshot import Camera, ChainNode, Stream
from openpose_ros_bringup.ros.camera_driver import is_installed
from openpose_ros_bringup.ros.doctor.chain import IMAGES, inputs_of
from openpose_ros_pkg.params.camera_presets import AUTO, CameraPreset, choose_camera, find_preset, read_presets
from openpose_ros_pkg.stream.silent_topic import PublishedTopic

# Share of a preset's topics that is published where the others may be misspelt.
_LEAST_SHARE = 0.5
# Parts of the names of topics: of images without colour, and of colour images.
_NO_COLOUR, _COLOUR = re.compile('depth|infra|/ir|disparity|mono'), re.compile('colou?r|rgb')


class Wanted(NamedTuple):
    """What the user names: a camera preset or 'auto', topics by their roles, and a namespace; empty: none."""

    camera: str
    topics: Mapping[str, str]
    namespace: str


class Source(NamedTuple):
    """A camera, and whether its images are rectified."""

    camera: Camera
    rectified: bool


def nodes_within(namespace: str, nodes: Sequence[ChainNode]) -> List[ChainNode]:
    """Return the nodes in a namespace, and those that read topics there."""
    return [node for node in nodes
            if any(_is_within(name, namespace) for name in (node.name, *(topic for topic, _ in inputs_of(node))))]


def find_cameras(wanted: Wanted, nodes: Sequence[ChainNode], published: Mapping[str, PublishedTopic]) -> List[Source]:
    """Return the cameras to check; none where the topics are those of no camera.

    Raises:
        ParameterError: there is no such preset.
    """
    if wanted.topics:
        return [_with_node(_of_topics(wanted.topics), nodes)]
    if wanted.camera != AUTO:
        return [_with_node(_of_preset(find_preset(wanted.camera), wanted.namespace or None), nodes)]
    read = [_of_node(node) for node in nodes]
    if read:
        return list({source.camera.image.topic: source for source in read}.values())
    kinds = {topic: there.kind for topic, there in published.items() if _is_within(topic, wanted.namespace)}
    known = _known_camera(kinds)
    topics = {} if known else _guess(kinds)
    return [known] if known else [_of_topics(topics)] if topics else []


def _is_within(name: str, namespace: str) -> bool:
    return name.startswith(f'/{namespace.strip("/")}/') if namespace.strip('/') else True


def _known_camera(kinds: Mapping[str, str]) -> Optional[Source]:
    """Return the preset of which all topics are published, or most of them; None: not half of any."""
    bases = {topic[:-len('/compressed')] if topic.endswith('/compressed') else topic for topic in kinds}
    seen: List[Tuple[CameraPreset, Optional[str]]] = []
    presets = read_presets()
    for dimensions in (3, 2):
        choice = choose_camera(kinds, dimensions, presets)
        if choice.chosen is not None and choice.chosen.preset.dimensions == dimensions:
            return _of_preset(choice.chosen.preset, choice.chosen.ns)
        seen += [(other.preset, other.ns) for other in choice.others]
    seen += [(preset, None) for preset in presets.values()]
    shares = [sum(topic in bases for topic in (*preset.inputs(ns=ns), preset.topic('unregistered', ns)))
              / len(preset.inputs()) for preset, ns in seen]
    best = shares.index(max(shares))
    return _of_preset(*seen[best]) if shares[best] >= _LEAST_SHARE else None


def _guess(kinds: Mapping[str, str]) -> Dict[str, str]:
    """Return the topics of a camera without a preset, by their names and types; none where there is no image."""
    own = {topic: kind for topic, kind in kinds.items() if '/openpose_ros/' not in topic}
    raw = [topic for topic, kind in own.items() if kind == Image._type]
    images = [topic for topic in raw if not _NO_COLOUR.search(topic)] or [
        topic[:-len('/compressed')] for topic, kind in own.items() if kind == CompressedImage._type
        and topic.endswith('/compressed') and not _NO_COLOUR.search(topic)]
    if not images:
        return {}
    image = min(images, key=lambda topic: (not _COLOUR.search(topic), topic))

    def order(topic: str) -> Tuple[bool, float, str]:
        return not says_registered(topic), -SequenceMatcher(None, topic, image).ratio(), topic

    depth = min((topic for topic in raw if 'depth' in topic), key=order, default='')
    points = min((topic for topic, kind in own.items() if kind == PointCloud2._type), key=order, default='')
    if not depth:
        return {'image': image, **({'points': points} if points else {})}
    infos = [topic for topic in (_sibling(depth), _sibling(image)) if topic in own]
    return {'image': image, 'depth': depth, **({'camera_info': infos[0]} if infos else {})}


def _of_preset(preset: CameraPreset, namespace: Optional[str]) -> Source:
    topics = list(preset.inputs(ns=namespace).items())
    info = Stream('camera_info', *topics[2]) if len(topics) > 2 else None
    role = 'depth' if preset.points_source == 'depth_image' else 'points'
    points = Stream(role, *topics[1]) if len(topics) > 1 else None
    other = '' if namespace in (None, preset.ns) else str(namespace)
    camera = Camera(Stream('image', *topics[0]), points, info, _beside(topics[0][0], info), preset.name, other,
                    _driver_line(preset, other))
    return Source(camera, preset.rectified)


def _driver_line(preset: CameraPreset, namespace: str) -> str:
    line = preset.driver_line(namespace)
    return line if not line or is_installed(preset.package) else (
        f'{line}    # the package {preset.package} is not installed on this machine')


def _of_node(node: ChainNode) -> Source:
    """Return the camera that a node reads: image and points in this order, with a camera info before them."""
    inputs = inputs_of(node)
    infos = [topic for topic, kind in inputs if kind == CameraInfo._type]
    image, *others = [(topic, kind) for topic, kind in inputs if kind in (*IMAGES, PointCloud2._type)]
    points = Stream('points' if others[0][1] == PointCloud2._type else 'depth', *others[0]) if others else None
    has_info = points is not None and points.role == 'depth' and infos
    info = Stream('camera_info', infos[0], CameraInfo._type) if has_info else None
    preset, namespace = _preset_of([image[0]] + ([points.topic] if points else []), node)
    camera = Camera(Stream('image', *image), points, info, _beside(image[0], info), preset.name if preset else '',
                    namespace, _driver_line(preset, namespace) if preset else '', node.name)
    rectified = node.parameters.get('rectified', 'auto')
    is_rectified = bool(preset and preset.rectified) if rectified == 'auto' else str(rectified).lower() == 'true'
    return Source(camera, is_rectified)


def _preset_of(topics: Sequence[str], node: ChainNode) -> Tuple[Optional[CameraPreset], str]:
    """Return the preset that has these topics, None: there is none; and their namespace, empty: the preset's."""
    others = {str(node.parameters.get('camera_ns', '')), node.name.rpartition('/')[0].strip('/')} - {''}
    return next(((preset, ns or '') for preset in read_presets().values() for ns in (None, *sorted(others))
                 if list(preset.inputs(ns=ns))[:len(topics)] == topics), (None, ''))


def _of_topics(topics: Mapping[str, str]) -> Source:
    """Return the camera with topics by their roles; the image is among them."""
    image = Stream('image', topics['image'], _image_type(topics['image']))
    if 'depth' not in topics:
        points = Stream('points', topics['points'], PointCloud2._type) if 'points' in topics else None
        return Source(Camera(image, points, colour_info=_beside(image.topic, None)), False)
    depth = Stream('depth', topics['depth'], _image_type(topics['depth']))
    info = Stream('camera_info', topics.get('camera_info') or _sibling(depth.topic), CameraInfo._type)
    return Source(Camera(image, depth, info, _beside(image.topic, info)), False)


def _image_type(topic: str) -> str:
    return CompressedImage._type if topic.endswith(('/compressed', '/compressedDepth')) else Image._type


def _sibling(topic: str) -> str:
    """Return the camera info that drivers publish beside an image."""
    base = topic[:-len('/compressed')] if topic.endswith('/compressed') else topic
    return f'{base.rpartition("/")[0]}/camera_info'


def _beside(image: str, info: Optional[Stream]) -> Optional[Stream]:
    """Return the camera info of the colour image; None: it is that of the depth image."""
    topic = _sibling(image)
    return None if info is not None and info.topic == topic else Stream('', topic, CameraInfo._type)


def _with_node(source: Source, nodes: Sequence[ChainNode]) -> Source:
    """Return a camera with the node that reads it."""
    reader = next((node.name for node in nodes if source.camera.image.topic in dict(inputs_of(node))), '')
    return source._replace(camera=replace(source.camera, node=reader))

"""Which topics are those of a camera: what nodes read, what the user names, or what a preset says."""
from dataclasses import replace
from typing import List, Mapping, Optional, Sequence, Tuple

from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2

from openpose_ros_bringup.doctor.findings import camera_info_of
from openpose_ros_bringup.doctor.snapshot import Camera, ChainNode, Stream
from openpose_ros_bringup.ros.camera_driver import is_installed
from openpose_ros_bringup.ros.doctor.chain import IMAGES, inputs_of
from openpose_ros_pkg.params.camera_presets import AUTO, CameraPreset, choose_camera, find_preset, read_presets
from openpose_ros_pkg.stream.silent_topic import PublishedTopic

# Share of a preset's topics that is published where the others may be misspelt.
_LEAST_SHARE = 0.5


def nodes_within(namespace: str, nodes: Sequence[ChainNode]) -> List[ChainNode]:
    """Return the nodes in a namespace, and those that read topics there."""
    return [node for node in nodes
            if any(_is_within(name, namespace) for name in (node.name, *(topic for topic, _ in inputs_of(node))))]


def find_cameras(name: str, namespace: str, topics: Mapping[str, str], nodes: Sequence[ChainNode],
                 published: Mapping[str, PublishedTopic]) -> List[Camera]:
    """Return the cameras to check; none where the topics are those of no camera.

    Args:
        name, namespace: of a camera preset, or 'auto'; empty: the preset's.
        topics: by their roles, in place of a preset's; empty: none.

    Raises:
        ParameterError: there is no such preset.
    """
    if topics:
        return [_with_node(_of_topics(topics), nodes)]
    if name != AUTO:
        return [_with_node(_of_preset(find_preset(name), namespace or None), nodes)]
    read = {camera.image.topic: camera for camera in map(_of_node, nodes)}
    known = None if read else _known_camera({topic: there.kind for topic, there in published.items()
                                             if _is_within(topic, namespace)})
    return [known] if known else list(read.values())


def _is_within(name: str, namespace: str) -> bool:
    return name.startswith(f'/{namespace.strip("/")}/') if namespace.strip('/') else True


def _known_camera(kinds: Mapping[str, str]) -> Optional[Camera]:
    """Return the preset of which all topics are published, or most of them; None: not half of any."""
    presets = read_presets()
    bases = {topic[:-len('/compressed')] if topic.endswith('/compressed') else topic for topic in kinds}
    seen: List[Tuple[CameraPreset, Optional[str]]] = []
    for dimensions in (3, 2):
        choice = choose_camera(kinds, dimensions, presets)
        seen += [(each.preset, each.ns) for each in (choice.chosen, *choice.others)
                 if each is not None and (dimensions == 3 or each.preset.dimensions == 2)]
    seen += [(preset, None) for preset in presets.values()]

    def share(camera: Tuple[CameraPreset, Optional[str]]) -> float:
        preset, ns = camera
        topics = (*preset.inputs(ns=ns), preset.topic('unregistered', ns))
        return min(sum(topic in bases for topic in topics) / len(preset.inputs()), 1.0)

    best = max(seen, key=share)
    return _of_preset(*best) if share(best) >= _LEAST_SHARE else None


def _of_preset(preset: CameraPreset, namespace: Optional[str]) -> Camera:
    topics = list(preset.inputs(ns=namespace).items())
    info = Stream('camera_info', *topics[2]) if len(topics) > 2 else None
    role = 'depth' if preset.points_source == 'depth_image' else 'points'
    points = Stream(role, *topics[1]) if len(topics) > 1 else None
    other = '' if namespace in (None, preset.ns) else str(namespace)
    return Camera(Stream('image', *topics[0]), points, info, _colour_info(topics[0][0], info), preset.name, other,
                  _driver_line(preset, other), rectified=preset.rectified)


def _driver_line(preset: CameraPreset, namespace: str) -> str:
    line = preset.driver_line(namespace)
    return line if not line or is_installed(preset.package) else (
        f'{line}    # the package {preset.package} is not installed on this machine')


def _of_node(node: ChainNode) -> Camera:
    """Return the camera that a node reads: image and points in this order, with a camera info before them."""
    inputs = inputs_of(node)
    infos = [topic for topic, kind in inputs if kind == CameraInfo._type]
    image, *others = [(topic, kind) for topic, kind in inputs if kind in (*IMAGES, PointCloud2._type)]
    points = Stream('points' if others[0][1] == PointCloud2._type else 'depth', *others[0]) if others else None
    has_info = points is not None and points.role == 'depth' and infos
    info = Stream('camera_info', infos[0], CameraInfo._type) if has_info else None
    preset, namespace = _preset_of([image[0]] + ([points.topic] if points else []), node)
    rectified = node.parameters.get('rectified', 'auto')
    return Camera(Stream('image', *image), points, info, _colour_info(image[0], info), preset.name if preset else '',
                  namespace, _driver_line(preset, namespace) if preset else '', node.name,
                  bool(preset and preset.rectified) if rectified == 'auto' else str(rectified).lower() == 'true')


def _preset_of(topics: Sequence[str], node: ChainNode) -> Tuple[Optional[CameraPreset], str]:
    """Return the preset that has these topics, None: there is none; and their namespace, empty: the preset's."""
    others = {str(node.parameters.get('camera_ns', '')), node.name.rpartition('/')[0].strip('/')} - {''}
    return next(((preset, ns or '') for preset in read_presets().values() for ns in (None, *sorted(others))
                 if list(preset.inputs(ns=ns))[:len(topics)] == topics), (None, ''))


def _of_topics(topics: Mapping[str, str]) -> Camera:
    """Return the camera with topics by their roles; the image is among them."""
    streams = {role: Stream(role, topic, PointCloud2._type if role == 'points' else _image_type(topic))
               for role, topic in topics.items()}
    image, depth = streams['image'], streams.get('depth')
    info = depth and Stream('camera_info', topics.get('camera_info') or camera_info_of(depth.topic), CameraInfo._type)
    return Camera(image, depth or streams.get('points'), info, _colour_info(image.topic, info))


def _image_type(topic: str) -> str:
    return CompressedImage._type if topic.endswith(('/compressed', '/compressedDepth')) else Image._type


def _colour_info(image: str, info: Optional[Stream]) -> Optional[Stream]:
    """Return the camera info of the colour image; None: it is that of the depth image."""
    topic = camera_info_of(image)
    return None if info is not None and info.topic == topic else Stream('', topic, CameraInfo._type)


def _with_node(camera: Camera, nodes: Sequence[ChainNode]) -> Camera:
    """Return a camera with the node that reads it."""
    reader = next((node.name for node in nodes if camera.image.topic in dict(inputs_of(node))), '')
    return replace(camera, node=reader)

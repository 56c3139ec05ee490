"""Which topics are those of a camera: what nodes read, what the user names, or what a preset says."""
from dataclasses import replace
from typing import List, Mapping, Optional, Sequence

from openpose_ros_bringup.doctor.snapshot import Camera, ChainNode, Stream
from openpose_ros_bringup.ros.camera_driver import is_installed
from openpose_ros_bringup.ros.doctor.chain import IMAGES, inputs_of
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
)
from openpose_ros_pkg.ros.topics import is_within
from openpose_ros_pkg.stream.silent_topic import PublishedTopic


def nodes_within(namespace: str, nodes: Sequence[ChainNode]) -> List[ChainNode]:
    """Return the nodes in a namespace, and those that read topics there."""
    return [node for node in nodes
            if any(is_within(name, namespace) for name in (node.name, *(topic for topic, _ in inputs_of(node))))]


def find_cameras(name: str, namespace: str, topics: Mapping[str, str], nodes: Sequence[ChainNode],
                 published: Mapping[str, PublishedTopic]) -> List[Camera]:
    """Return the cameras to check; none where the topics are those of no camera.

    Args:
        name, namespace: of a camera preset, or 'auto'; empty: the preset's.
        topics: by their roles, in place of a preset's; empty: none.

    Raises:
        ParameterError: there is no such preset.
    """
    if topics or name != AUTO:
        camera = _of_topics(topics) if topics else _of_preset(find_preset(name), namespace or None)
        reader = next((node.name for node in nodes if camera.image.topic in dict(inputs_of(node))), '')
        return [replace(camera, node=reader)]
    if nodes:
        return list({camera.image.topic: camera for camera in map(_of_node, nodes)}.values())
    kinds = {topic: there.kind for topic, there in published.items() if is_within(topic, namespace)}
    choices = {dimensions: choose_camera(kinds, dimensions) for dimensions in (3, 2)}
    seen = [camera for dimensions, choice in choices.items() for camera in (choice.chosen, *choice.others)
            if camera is not None and camera.preset.dimensions == dimensions]
    return [_of_preset(seen[0].preset, seen[0].ns)] if seen else []


def _of_preset(preset: CameraPreset, namespace: Optional[str], dimensions: int = 3) -> Camera:
    topics = preset.inputs(dimensions, namespace)
    roles = ('image', 'depth' if preset.points_source == 'depth_image' else 'points', 'camera_info')
    image, *others = (Stream(role, *topic) for role, topic in zip(roles, topics.items()))
    points, info = (*others, None, None)[:2]
    other = '' if namespace in (None, preset.ns) else str(namespace)
    line = preset.driver_line(other)
    if line and not is_installed(preset.package):
        line += f'    # the package {preset.package} is not installed on this machine'
    return Camera(image, points, info, _colour_info(image.topic, info), preset.name, other, line,
                  rectified=preset.rectified)


def _of_node(node: ChainNode) -> Camera:
    """Return the camera that a node reads: image and points in this order, with a camera info before them."""
    inputs = inputs_of(node)
    (image, _), *others = [(topic, kind) for topic, kind in inputs if kind in (*IMAGES, CLOUD)]
    dimensions = 3 if others else 2
    chosen = choose_camera(dict(inputs), dimensions).chosen
    if chosen is not None:
        camera = _of_preset(chosen.preset, chosen.ns, dimensions)
    else:
        read = [('camera_info' if kind == CAMERA_INFO else 'points' if kind == CLOUD else 'depth', topic)
                for topic, kind in inputs if topic != image]
        camera = _of_topics({**dict(reversed(read)), 'image': image})
    rectified = str(node.parameters.get('rectified', 'auto')).lower()
    return replace(camera, node=node.name, rectified=camera.rectified if rectified == 'auto' else rectified == 'true')


def _of_topics(topics: Mapping[str, str]) -> Camera:
    """Return the camera with topics by their roles; the image is among them."""
    streams = {role: Stream(role, topic, CLOUD if role == 'points' else COMPRESSED if topic.endswith(
        ('/compressed', '/compressedDepth')) else IMAGE) for role, topic in topics.items()}
    depth = streams.get('depth')
    info = depth and Stream('camera_info', topics.get('camera_info') or info_beside(depth.topic), CAMERA_INFO)
    return Camera(streams['image'], depth or streams.get('points'), info, _colour_info(topics['image'], info))


def _colour_info(image: str, info: Optional[Stream]) -> Optional[Stream]:
    """Return the camera info of the colour image; None: it is that of the depth image."""
    topic = info_beside(image)
    return None if info is not None and info.topic == topic else Stream('', topic, CAMERA_INFO)

"""A finding of a check, and the lines to type that findings share."""
from difflib import SequenceMatcher
from typing import List, NamedTuple

from openpose_ros_bringup.doctor.snapshot import Camera, Snapshot, Stream
from openpose_ros_pkg.params.camera_presets import IMAGE, info_beside

RIGHT, WRONG, UNKNOWN = 'right', 'WRONG', 'unknown'
BRINGUP = 'roslaunch openpose_ros_bringup people.launch'
# Values that are arguments of people.launch; others are parameters.
_ARGUMENTS = ('camera', 'image', 'points', 'depth', 'fixed_frame', 'mode', 'target_rate', 'rviz')
_TRANSPORTS = ('compressed', 'compressedDepth')
# Words in names of topics whose depth belongs to the pixels of the colour image.
_REGISTERED = ('aligned', 'regist', 'depth_to_rgb', 'depth_to_color')


class Finding(NamedTuple):
    """What a check says: state RIGHT, WRONG or UNKNOWN, what is so, and the line to type where it is wrong."""

    state: str
    text: str
    line: str = ''


def right(text: str) -> Finding:
    return Finding(RIGHT, text)


def wrong(text: str, line: str) -> Finding:
    return Finding(WRONG, text, line)


def unknown(text: str) -> Finding:
    return Finding(UNKNOWN, text)


def launch_line(camera: Camera, **changes: str) -> str:
    """Return the line that starts the chain with the topics of a camera, some values changed; parameters by a file."""
    values = {'camera': camera.preset, 'camera_ns': camera.namespace} if camera.preset else {
        'image': camera.image.topic, **({'points': 'none'} if camera.points is None else
                                        {camera.points.role: camera.points.topic})}
    if {'depth', 'points'} & set(changes):
        values = {key: value for key, value in values.items() if key not in ('depth', 'points')}
    values = {key: value for key, value in {**values, **changes}.items() if value}
    for role in ('image', 'depth'):  # a topic is named without its transport
        base, _, transport = values.get(role, '').rpartition('/')
        if transport in _TRANSPORTS:
            values.update({role: base, f'{role}_transport': transport})
    parameters = ', '.join(f'{key}: {values.pop(key)}' for key in list(values) if key not in _ARGUMENTS)
    line = ' '.join([BRINGUP, *(f'{key}:={value}' for key, value in values.items())])
    if not parameters:
        return line
    is_flat = camera.points is None or values.get('points') == 'none'
    node = 'openpose_ros_service_node' if is_flat else 'skeleton_extract_3d_node'
    return f"echo '{node}: {{{parameters}}}' > config.yaml && {line} config:=$PWD/config.yaml"


def other_topic_line(camera: Camera, stream: Stream, seen: Snapshot, registered: bool = False) -> str:
    """Return the line that starts the chain with another topic in place of one, or with a depth image in place of a
    cloud; empty: there is none.

    Of depth images, those that say that they are registered come first, and alone with `registered` or where the driver
    is known.
    """
    others = others_like(stream, seen)
    if stream.role == 'points' and not others:
        stream = Stream('depth', camera.image.topic, IMAGE)
        others = others_like(stream, seen)
    if registered or (stream.role == 'depth' and camera.driver and camera.points and camera.points.role == 'depth'):
        others = [name for name in others if _says_registered(name)]
    if not others or (stream.role == 'camera_info' and camera.driver):
        return ''
    topics = {stream.role: others[0]}
    if stream.role == 'depth' and info_beside(others[0]) not in seen.published and camera.colour_info is not None:
        topics = {'image': camera.image.topic, **topics, 'camera_info': camera.colour_info.topic}
    if 'camera_info' in topics:
        named = ', '.join(f'{role}: {topic}' for role, topic in topics.items())
        return f'{BRINGUP} camera:=FILE.yaml    # of the form of cameras.yaml, with {named}'
    return launch_line(camera, **topics)


def others_like(stream: Stream, seen: Snapshot) -> List[str]:
    """Return the other topics that may hold the same, the most similar name first; depth images are named so."""
    return sorted((name for name, there in seen.published.items() if there.kind == stream.kind
                   and name != stream.topic and '/openpose_ros/' not in name
                   and (stream.role not in ('image', 'depth') or ('depth' in name) == (stream.role == 'depth'))),
                  key=lambda name: (stream.role == 'depth' and not _says_registered(name),
                                    -SequenceMatcher(None, name, stream.topic).ratio(), name))


def _says_registered(topic: str) -> bool:
    return any(word in topic for word in _REGISTERED)

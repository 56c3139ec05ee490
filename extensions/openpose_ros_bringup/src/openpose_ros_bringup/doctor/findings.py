"""A finding of a check, and the lines to type that findings share."""
from difflib import SequenceMatcher
from typing import Dict, List, NamedTuple

from openpose_ros_bringup.doctor.snapshot import Camera, Snapshot, Stream
from openpose_ros_pkg.params.camera_presets import IMAGE

RIGHT, WRONG, UNKNOWN = 'right', 'WRONG', 'unknown'
BRINGUP = 'roslaunch openpose_ros_bringup people.launch'
# Values that are arguments of people.launch; others are parameters.
_ARGUMENTS = ('camera', 'image', 'points', 'depth', 'fixed_frame', 'mode', 'target_rate', 'rviz')
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
    """Return the line that starts the chain with the topics of a camera, with some values changed.

    Parameters of the node go into a YAML file, as does a camera whose camera info is not beside the depth image.
    """
    values: Dict[str, str] = {}
    if camera.preset:
        values = {'camera': camera.preset, **({'camera_ns': camera.namespace} if camera.namespace else {})}
    else:
        values = {stream.role: stream.topic for stream in camera.streams}
        values.update({'points': 'none'} if camera.points is None else {})
    other_points = {'depth', 'points'} & set(changes)
    values = {key: value for key, value in values.items()
              if not (other_points and key in ('points', 'depth', 'camera_info'))}
    values.update(changes)
    if 'camera_info' in changes and camera.points is not None and camera.points.role == 'depth':
        values.setdefault('depth', camera.points.topic)  # which it is of
    info, depth, before = values.pop('camera_info', ''), values.get('depth', ''), ''
    if depth and info not in ('', camera_info_of(depth)):
        image = values.pop('image', camera.image.topic)
        before = (f"echo 'mine: {{image: {image[1:]}, depth: {values.pop('depth')[1:]}, camera_info: {info[1:]}, "
                  "points_source: depth_image}' > mine.yaml && ")
        values['camera'] = '$PWD/mine.yaml'
    parameters = ', '.join(f'{key}: {values.pop(key)}' for key in list(values) if key not in _ARGUMENTS)
    if parameters:
        node = 'openpose_ros_service_node' if camera.points is None else 'skeleton_extract_3d_node'
        before += f"echo '{node}: {{{parameters}}}' > config.yaml && "
        values['config'] = '$PWD/config.yaml'
    return before + ' '.join([BRINGUP, *(f'{key}:={value}' for key, value in values.items())])


def camera_info_of(topic: str) -> str:
    """Return the camera info that drivers publish beside an image."""
    base = topic[:-len('/compressed')] if topic.endswith('/compressed') else topic
    return f'{base.rpartition("/")[0]}/camera_info'


def depth_line(camera: Camera, depth: str, seen: Snapshot) -> str:
    """Return the line that starts the chain with another depth image, and the camera info beside it if there is one."""
    info = camera_info_of(depth)
    if info not in seen.published and camera.colour_info is not None:
        info = camera.colour_info.topic
    return launch_line(camera, depth=depth, camera_info=info)


def other_topic_line(camera: Camera, stream: Stream, seen: Snapshot, registered: bool = False) -> str:
    """Return the line that starts the chain with another topic in place of one, or with a depth image in place of a
    cloud; empty: there is none.

    Of depth images, those that say that they are registered come first, and alone where the driver is known.

    Args:
        registered: only topics that say that they are registered.
    """
    others = others_like(stream, seen)
    if stream.role == 'points' and not others:
        stream = Stream('depth', camera.image.topic, IMAGE)
        others = others_like(stream, seen)
    if registered or (stream.role == 'depth' and camera.driver and camera.points and camera.points.role == 'depth'):
        others = [name for name in others if _says_registered(name)]
    if not others or (stream.role == 'camera_info' and camera.driver):
        return ''
    return depth_line(camera, others[0], seen) if stream.role == 'depth' else launch_line(
        camera, **{stream.role: others[0]})


def others_like(stream: Stream, seen: Snapshot) -> List[str]:
    """Return the other topics that may hold the same, the most similar name first; depth images are named so."""
    return sorted((name for name, there in seen.published.items() if there.kind == stream.kind
                   and name != stream.topic and '/openpose_ros/' not in name
                   and (stream.role not in ('image', 'depth') or ('depth' in name) == (stream.role == 'depth'))),
                  key=lambda name: (stream.role == 'depth' and not _says_registered(name),
                                    -SequenceMatcher(None, name, stream.topic).ratio(), name))


def _says_registered(topic: str) -> bool:
    return any(word in topic for word in _REGISTERED)

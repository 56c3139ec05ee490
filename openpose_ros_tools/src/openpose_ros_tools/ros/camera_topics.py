"""Which topics of a bag are those of a camera: told by their types, encodings and names."""
import re
from typing import Any, Dict, List, Mapping, Sequence

import rosbag

from openpose_ros_tools.ros.bag_files import undamaged

IMAGE, COMPRESSED, CLOUD, INFO = ('sensor_msgs/Image', 'sensor_msgs/CompressedImage', 'sensor_msgs/PointCloud2',
                                  'sensor_msgs/CameraInfo')
DEPTH_ENCODINGS = ('16UC1', '32FC1', 'mono16')

CAMERA_NAMESPACE = '/kinect2/qhd'
"""Of the topics that the launch files of this project listen to."""
TOPICS = {'camera_info': 'camera_info', 'image': 'image_color', 'depth': 'image_depth_rect', 'mask': 'image_mask',
          'points': 'points'}
"""By what is on it: the topic in the camera's namespace, in the order in which messages with one stamp are written."""

# Topics of this project are results, of an earlier run or recorded live, and no input.
_RESULTS = re.compile(r'(^|/)openpose_ros/')
_DEPTH_NAME, _MASK_NAME, _OTHER_NAME = (re.compile(pattern, re.IGNORECASE) for pattern in (
    'depth|disparity', 'mask', r'(^|[/_])(ir|infra\d?|confidence)($|[/_])'))
# Of several topics the one with such a name; of several depth images that is one which a driver has aligned to the
# colour image.
_LIKELY = {stream: re.compile(pattern, re.IGNORECASE) for stream, pattern in (
    ('colour', 'colou?r|rgb'), ('depth', 'aligned|registered|depth_to_(rgb|colou?r)'), ('mask', '$^'),
    ('points', 'colou?r|rgb|registered'))}


def is_result(topic: str) -> bool:
    """Say whether a topic is one that this project publishes."""
    return bool(_RESULTS.search(topic))


def is_depth(topic: str, encoding: str) -> bool:
    """Say whether images with this encoding are depth: infrared cameras have mono16 as well."""
    return encoding in DEPTH_ENCODINGS and (encoding != 'mono16' or bool(_DEPTH_NAME.search(topic)))


def is_packed_depth(topic: str) -> bool:
    """Say whether compressed images are depth of compressed_depth_image_transport."""
    return topic.endswith('/compressedDepth')


def raw_topic(topic: str) -> str:
    """Return the topic of the raw images that belong to compressed ones; that of raw ones as it is."""
    head, _, last = topic.rpartition('/')
    return head if last in ('compressed', 'compressedDepth') else topic


def camera_of(topic: str) -> str:
    """Return the namespace that a driver gives the topics of a camera."""
    return raw_topic(topic).rpartition('/')[0]


def image_topics(bag: rosbag.Bag, types: Mapping[str, str]) -> Dict[str, List[str]]:
    """Return by stream ('colour', 'depth', 'mask') the topics that may be it, without compressed twins of raw ones.

    Args:
        types: see `topic_types`.

    Raises:
        BadInputError: the bag is damaged.
    """
    found: Dict[str, List[str]] = {'colour': [], 'depth': [], 'mask': []}
    for topic, kind in sorted(types.items()):
        if is_result(topic) or kind not in (IMAGE, COMPRESSED) or (
                raw_topic(topic) != topic and types.get(raw_topic(topic)) == IMAGE):
            continue
        if is_packed_depth(topic) or (kind == IMAGE and is_depth(topic, _first(bag, topic).encoding)):
            found['depth'].append(topic)
        elif _MASK_NAME.search(topic):
            found['mask'].append(topic)
        # what a compressed image holds is known by its name alone; raw ones without depth may be of a camera named so
        elif not _OTHER_NAME.search(topic) and not _DEPTH_NAME.search(
                topic if kind == COMPRESSED else topic.rpartition('/')[2]):
            found['colour'].append(topic)
    return found


def organized_clouds(bag: rosbag.Bag, types: Mapping[str, str]) -> List[str]:
    """Return the topics of clouds that have the rows of an image.

    Raises:
        BadInputError: the bag is damaged.
    """
    return [topic for topic in clouds(types) if _first(bag, topic).height != 1]


def clouds(types: Mapping[str, str]) -> List[str]:
    """Return the topics of all clouds."""
    return sorted(topic for topic, kind in types.items() if kind == CLOUD and not is_result(topic))


def preferred(topics: Sequence[str], stream: str) -> List[str]:
    """Return those of several topics that are most likely meant: that of this project's launch files, or by name.

    Args:
        stream: 'colour', 'depth', 'mask' or 'points'.
    """
    usual = [f'{CAMERA_NAMESPACE}/{name}' for name in TOPICS.values()]
    best = list(topics)
    for test in (lambda topic: raw_topic(topic) in usual, _LIKELY[stream].search):
        if len(best) > 1:
            best = [topic for topic in topics if test(topic)] or list(topics)
    return best


def listed(types: Mapping[str, str]) -> str:
    """Return topics and types for an error message."""
    return ', '.join(f'{topic} ({kind})' for topic, kind in sorted(types.items())) or 'no messages at all'


def _first(bag: rosbag.Bag, topic: str) -> Any:
    """Return the first message of a topic."""
    return next(undamaged(bag, bag.read_messages(topics=[topic]))).message

"""Which paths are those of recordings; knows no ROS."""
from pathlib import Path

MCAP_SUFFIX = '.mcap'
METADATA = 'metadata.yaml'
"""Of a folder of rosbag2."""

_ROS1_SUFFIXES, _ROS2_SUFFIXES = ('.bag', '.bag.active'), (MCAP_SUFFIX, '.db3')


_VIDEO_SUFFIXES = ('.mp4', '.m4v', '.mov', '.avi', '.mkv', '.webm')


def is_bag(path: Path) -> bool:
    """Return whether a path is that of a bag, or of a recording of ROS 2; recording.bag.csv is a table."""
    return path.name.endswith(_ROS1_SUFFIXES) or is_ros2(path)


def is_video(path: Path) -> bool:
    """Return whether a path is that of a video."""
    return path.suffix.lower() in _VIDEO_SUFFIXES and path.is_file()


def is_ros2(path: Path) -> bool:
    """Return whether a path is that of a recording of ROS 2: a folder with metadata.yaml, .mcap or .db3."""
    return (path / METADATA).is_file() or (path.suffix in _ROS2_SUFFIXES and path.is_file())

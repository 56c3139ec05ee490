"""A room that several cameras see: its bag, and what starts the chain on it."""
import subprocess
from pathlib import Path
from typing import List

import rosbag

from openpose_ros_pkg.errors import BadInputError

# What images_to_bag writes for a camera NAME.
_INFO_TOPIC = '/qhd/camera_info'


def write_bag(folder: Path, bag: Path) -> None:
    """Make a bag of a folder that holds a sequence for each camera.

    Raises:
        BadInputError: the folder holds no such sequences, or the pose of a camera is not known.
    """
    made = subprocess.run(['rosrun', 'openpose_ros_tools', 'images_to_bag', str(folder), '--cameras', '--overwrite',
                           '--compression', 'lz4', '-o', str(bag)], check=False)
    if made.returncode not in (0, 1):
        raise BadInputError(f'{folder} is no stage: it has to hold an RGB-D sequence for each camera, '
                            'as NAME/rgb, NAME/depth and NAME/sequence.yaml or NAME/meta.json')


def cameras_of(bag: Path) -> List[str]:
    """Return the names of the cameras in a bag of `write_bag`."""
    with rosbag.Bag(str(bag)) as opened:
        topics = opened.get_type_and_topic_info().topics
    return sorted(topic[1:-len(_INFO_TOPIC)] for topic in topics if topic.endswith(_INFO_TOPIC))


def launch_command(bag: Path, rviz: bool, signals: bool) -> List[str]:
    """Return the roslaunch command that starts the chains of the cameras, their fusion, and the node of signals.

    The parameters of the chains go into a file beside the bag.
    """
    config = bag.with_suffix('.yaml')
    config.write_text('skeleton_extract_3d_node: {points_source: depth_image, target_rate: 0.0}\n')
    return ['roslaunch', 'openpose_ros_bringup', 'cameras.launch', f"cameras:={' '.join(cameras_of(bag))}",
            f'config:={config.resolve()}', f'rviz:={str(rviz).lower()}', f'signals:={str(signals).lower()}']

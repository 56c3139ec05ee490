"""A room that several cameras see: its bag, what starts the chain on it, and the view of RViz."""
import copy
import subprocess
from pathlib import Path
from typing import List

import numpy as np
import rosbag
import rospkg
import yaml

from openpose_ros_pkg.errors import BadInputError
from skeleton_extract_3d.ros.convert import rotation_and_translation

# What images_to_bag writes for a camera NAME.
_INFO_TOPIC = '/qhd/camera_info'
# RViz looks at where the cameras look at this distance from them, and at this height [m].
_LOOKED_AT, _HEIGHT = 3.0, 0.8


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
    """Return the roslaunch command that starts the chains of the cameras, their fusion, and the node of signals."""
    return ['roslaunch', 'openpose_ros_bringup', 'cameras.launch', f"cameras:={' '.join(cameras_of(bag))}",
            'points_source:=depth_image', 'target_rate:=0', f'rviz:={str(rviz).lower()}',
            f'signals:={str(signals).lower()}']


def rviz_configuration(bag: Path, folder: Path) -> Path:
    """Return the RViz configuration for the cameras of a bag; it is written to a folder."""
    package = Path(rospkg.RosPack().get_path('openpose_ros_fusion'))
    values = yaml.safe_load((package / 'rviz' / 'people_fusion.rviz').read_text())
    manager = values['Visualization Manager']
    clouds = [display for display in manager['Displays'] if display['Class'] == 'rviz/PointCloud2']
    others = [display for display in manager['Displays'] if display not in clouds]
    of_cameras = [{**copy.deepcopy(clouds[0]), 'Name': f'Cloud of {camera}',
                   'Topic': f'{camera}/openpose_ros/skeleton_3d/input_pointcloud'} for camera in cameras_of(bag)]
    manager['Displays'] = of_cameras + others
    x, y = _middle(bag)
    manager['Views']['Current']['Focal Point'] = {'X': x, 'Y': y, 'Z': _HEIGHT}
    manager['Views']['Saved'][0].update(X=x, Y=y)
    path = folder / 'stage.rviz'
    path.write_text(yaml.safe_dump(values))
    return path


def _middle(bag: Path) -> List[float]:
    """Return x and y of what the cameras of a bag look at [m]."""
    with rosbag.Bag(str(bag)) as opened:
        poses = [rotation_and_translation(transform) for _, message, _ in opened.read_messages(topics=['/tf_static'])
                 for transform in message.transforms]
    if not poses:
        raise BadInputError(f'{bag}: no camera says where it stands (T_world_camera in sequence.yaml or meta.json)')
    looked_at = [translation + _LOOKED_AT * rotation[:, 2] for rotation, translation in poses]
    return [float(value) for value in np.mean(looked_at, axis=0)[:2]]

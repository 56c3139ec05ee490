"""A camera driver that plays a sequence of 960 x 540 forth and back into running nodes, and what it has played."""
import contextlib
import io
import subprocess
from pathlib import Path
from typing import Iterable, List, Optional, Tuple

from openpose_ros_tools.ros import images_to_bag
from session import Session

NAMESPACE = '/kinect2/qhd'
# What the driver publishes.
TOPICS = ('image_color', 'camera_info', 'image_depth_rect')
PEOPLE_3D = '/openpose_ros/skeleton_3d/detected_poses_3d'


def make_bag(sequence: Path, bag: Path) -> Path:
    """Write a sequence folder into a bag for the driver; return the bag."""
    with contextlib.redirect_stdout(io.StringIO()):
        status = images_to_bag.main([str(sequence), '-o', str(bag), '--overwrite'])
    if status:
        raise OSError(f'{sequence} could not be written into {bag}')
    return bag


def start_camera(session: Session, bag: Path, rate: float, stamps: Optional[Path] = None,
                 names: Tuple[str, str] = ('camera', NAMESPACE), **parameters: object) -> 'subprocess.Popen[bytes]':
    """Start the driver; return its process. See bag_camera.cpp for the parameters.

    Args:
        stamps: file for `played_stamps`; None: beside the bag.
        names: of the node, and namespace of the topics.
    """
    node, namespace = names
    given = {'once': False, **parameters}  # else once is that of the camera before, which stays on the server
    return session.start(node, ['rosrun', 'openpose_ros_nodelets', 'bag_camera', f'__name:={node}', f'_bag:={bag}',
                                f'_rate:={rate}', f'_topics:={" ".join(TOPICS)}',
                                *(f'_{key}:={value}' for key, value in given.items()),
                                *(f'{NAMESPACE}/{topic}:={namespace}/{topic}' for topic in TOPICS)],
                         stamps or bag.with_suffix('.txt'))


def played_stamps(stamps: Path) -> List[int]:
    """Return the stamps of the frames that a driver has published to a subscriber until now [ns]."""
    lines = stamps.read_text().splitlines(keepends=True)
    return [int(line) for line in lines if line.endswith('\n') and line.strip().isdigit()]  # others are the log's


def worth_reading(log: Path) -> Iterable[str]:
    """Return the lines of a log of nodes that say how their figures came about."""
    return (line for line in log.read_text(errors='replace').splitlines()
            if any(word in line for word in ('networks may take', 'WARN', 'ERROR')))

"""What the ROS tests of this package share: pictures with known people, nodes beside the test."""
import contextlib
import json
import signal
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import rospy
from sensor_msgs.msg import Image
from std_msgs.msg import Header

sys.path.append(str(Path(__file__).resolve().parents[2] / 'tests/support'))
from session import await_true

# Two people walk past each other; gt.json holds the true joints.
SEQUENCE = Path(__file__).resolve().parents[2] / 'skeleton_extract_3d' / 'demo' / 'cross'


def picture(number):
    """A frame of the sequence, (540, 960, 3) uint8 BGR."""
    bgr = cv2.imread(str(SEQUENCE / 'rgb' / f'{number:03d}.jpg'))
    if bgr is None:
        raise FileNotFoundError(f'no frame {number} in {SEQUENCE}')
    return bgr


def true_people(number):
    """The people of a frame: a dict from joint name to (x, y) [px] each, of the visible joints."""
    truth = json.loads((SEQUENCE / 'gt.json').read_text())
    return [{joint: np.array(uv) for joint, uv, vis in zip(truth['joints'], person['uv'], person['vis']) if vis == 2}
            for person in truth['frames'][number]['people']]


def image(bgr, stamp=0.0, frame_id='camera', encoding='bgr8'):
    """An Image message of a picture whose bytes are in the order of the encoding."""
    height, width = bgr.shape[:2]
    data = np.ascontiguousarray(bgr)
    return Image(header=Header(stamp=rospy.Time.from_sec(stamp), frame_id=frame_id), height=height, width=width,
                 encoding=encoding, step=data.strides[0], data=data.tobytes())


def joints(detection, scale=(1.0, 1.0)):
    """The detected parts of a PersonDetection: a dict from name to (x, y)."""
    parts = {name: getattr(detection, name) for name in detection.__slots__
             if hasattr(getattr(detection, name), 'confidence')}
    return {name: np.array([part.x, part.y]) * scale for name, part in parts.items() if part.confidence > 0}


def distance(person, other):
    """Median distance of the joints that both have; infinite if they have none in common."""
    common = person.keys() & other.keys()
    return np.median([np.linalg.norm(person[j] - other[j]) for j in common]) if common else np.inf


def publisher(topic, kind):
    """A publisher whose subscriber is there."""
    result = rospy.Publisher(topic, kind, queue_size=10)
    await_true(lambda: result.get_num_connections() > 0, f'a subscriber of {topic}')
    return result


@contextlib.contextmanager
def node(executable, *arguments, name):
    """Run a node of this package beside the test, killed at the end if it still runs."""
    process = subprocess.Popen(['rosrun', 'openpose_ros_pkg', executable, f'__name:={name}', *arguments],
                               stdin=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()

"""What the ROS tests of this package share: pictures with known people, recorders, waiting for conditions."""
import contextlib
import json
import signal
import subprocess
import threading
import time
from pathlib import Path

import cv2
import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from openpose_ros_pkg.ros.session import is_heard

# Two people walk past each other; gt.json holds the true joints.
SEQUENCE = Path(__file__).resolve().parents[2] / 'skeleton_extract_3d' / 'demo' / 'cross'
TIMEOUT = 60.0  # [s] for what takes a few seconds on a machine that is not busy


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


def wait_for(condition, what, timeout=TIMEOUT):
    """Return what condition() returns as soon as that is true; fail after the timeout."""
    deadline = time.monotonic() + timeout
    while True:
        result = condition()
        if result:
            return result
        if time.monotonic() > deadline:
            raise AssertionError(f'not within {timeout:g} s: {what() if callable(what) else what}')
        time.sleep(0.02)


class Recorder:
    """Keeps the messages of a topic; ready when its publishers send to it."""

    def __init__(self, topic, kind, connect=True):
        self.topic = topic
        self.messages = []
        self._subscriber = rospy.Subscriber(topic, kind, self.messages.append, queue_size=100)
        if connect:
            wait_for(lambda: is_heard(topic), f'a publisher of {topic}')

    def wait(self, number, stamp=None):
        """Return the messages so far, of one stamp if given, as soon as there are so many."""
        def chosen():
            return [m for m in self.messages if stamp is None or m.header.stamp == stamp]
        wait_for(lambda: len(chosen()) >= number, lambda: f'{number} messages on {self.topic}; got {len(chosen())}')
        return chosen()

    def close(self):
        self._subscriber.unregister()


def publisher(topic, kind):
    """A publisher whose subscriber is there."""
    result = rospy.Publisher(topic, kind, queue_size=10)
    wait_for(lambda: result.get_num_connections() > 0, f'a subscriber of {topic}')
    return result


class Counters:
    """The counters of a node, as /diagnostics shows them."""

    def __init__(self, node):
        self._node = node.strip('/')
        self._values = {}
        self.texts = set()
        self.level = None
        self._subscriber = rospy.Subscriber('/diagnostics', DiagnosticArray, self._store, queue_size=20)
        wait_for(lambda: self._values, f'diagnostics of {node}')

    def _store(self, message):
        for status in message.status:
            # the updater writes <node>: <task>
            if status.name.split(': ')[-1] == self._node:
                self._values = {pair.key: pair.value for pair in status.values}
                self.texts.add(status.message)
                self.level = status.level

    def __getitem__(self, event):
        return int(self._values.get(event, 0))

    def wait(self, event, number):
        """Wait until the counter has reached the number."""
        wait_for(lambda: self[event] >= number, lambda: f"{number} of '{event}' at {self._node}; {self._values}")

    def wait_value(self, key):
        """Wait until the node shows a value that is no counter; return it."""
        return wait_for(lambda: self._values.get(key), lambda: f"'{key}' at {self._node}; {self._values}")

    def wait_text(self, *parts):
        """Wait until the node has shown a status with all these words."""
        wait_for(lambda: any(all(part in text for part in parts) for text in self.texts.copy()),
                 lambda: f'{parts} in the status of {self._node}; {self.texts}')


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


def at_once(*functions):
    """Run functions at the same time; return their results, or raise the first error."""
    start = threading.Barrier(len(functions))
    results, errors = [None] * len(functions), []

    def run(i):
        try:
            start.wait(TIMEOUT)
            results[i] = functions[i]()
        except Exception as error:
            errors.append(error)
    threads = [threading.Thread(target=run, args=(i,), daemon=True) for i in range(len(functions))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(TIMEOUT)
    if errors:
        raise errors[0]
    if any(thread.is_alive() for thread in threads):
        raise AssertionError(f'not within {TIMEOUT:g} s: the end of all')
    return results

"""Each shell line of README.md and docs/first_hour.md does what the page says, as typed; what it makes is opened.

Without a screen and a webcam: RViz is opened by the test of the demo, and images of the shipped sequence stand in for a
webcam. `./run demo` and `./run camera` have tests of their own.
"""
import json
import os
import re
import signal
import socket
import subprocess
import urllib.request
import zipfile

import cv2
import pytest
import rosbag
import rosgraph

from development import ROOT
from openpose_ros_tools.tables.keypoint_csv import read_keypoint_csv
from session import ENDS_WITH_PARENT, await_true

TESTED_ELSEWHERE = ('./run demo', './run camera', 'source devel/setup.bash')
STAYS = ('./run launch ', './run shell roscore', './run shell rosbag play', './run shell rostopic hz')
STARTED = ('/detected_poses', '/visualization_markers')  # topics of which one is there when a launch is up
IMAGES = ROOT / 'skeleton_extract_3d/demo/cross/rgb'
TIMEOUT = 240.0  # [s] many times what a line takes


def lines_of(*pages):
    """Return the lines of each block of commands, without comments; a line that an earlier block has is left out."""
    seen, blocks = set(), []
    for page in pages:
        for block in re.findall(r'^```sh\n(.*?)^```$', (ROOT / page).read_text(), re.MULTILINE | re.DOTALL):
            lines = [re.sub(r' +#.*', '', line) for line in block.splitlines()]
            blocks.append([line for line in lines if line not in seen and not line.startswith(TESTED_ELSEWHERE)])
            seen.update(lines)
    return [block for block in blocks if block]


def is_published(*names):
    """Return whether a topic of one of these names, in any namespace, has a publisher."""
    try:
        return any(topic.endswith(names) for topic, _ in rosgraph.Master('/hour').getSystemState()[0])
    except OSError:
        return False


def listens(name):
    """Return whether a rostopic of the command line is subscribed to a topic."""
    subscribers = dict(rosgraph.Master('/hour').getSystemState()[1])
    return any(node.startswith('/rostopic') for node in subscribers.get(name, ()))


def free_port():
    with socket.socket() as probe:
        probe.bind(('localhost', 0))
        return probe.getsockname()[1]


class Hour:
    """Types lines in a folder that has what a checkout has."""

    def __init__(self, folder):
        self.folder, self.said, self._stay = folder, {}, []
        for path in ROOT.iterdir():
            if path.name not in ('hour', 'out', 'demo_output'):
                (folder / path.name).symlink_to(path)
        self.web = free_port()
        (folder / 'web.yaml').write_text(f'people_web_node: {{port: {self.web}}}\n')

    def start(self, line):
        """Run a line; return its process, and the file of what it says."""
        typed = line.replace('rviz:=true', '').replace('source:=0', f'source:={IMAGES}')
        typed += f' config:={self.folder}/web.yaml' * typed.startswith('./run launch')
        typed += f" -p {os.environ['ROS_MASTER_URI'].rpartition(':')[2]}" * typed.endswith('roscore')
        log = self.folder / f'line_{len(self._stay)}_{len(self.said)}.log'
        with log.open('w') as output:
            child = subprocess.Popen([*ENDS_WITH_PARENT, 'bash', '-c', f'exec {typed}'], cwd=str(self.folder),
                                     stdin=subprocess.DEVNULL, stdout=output, stderr=output, start_new_session=True)
        self._stay.append(child)
        return child, log

    def type(self, line):
        """Run a line to its end, or until it has said something that shows that it works."""
        child, log = self.start(line)
        if 'roscore' in line:
            await_true(rosgraph.is_master_online, line)
        elif line.startswith('./run launch'):
            await_true(lambda: is_published(*STARTED), log.read_text)
        elif not line.startswith(STAYS):
            allowed = (0, 1) if line.startswith('./run doctor') else (0,)  # 1: it found a fault
            assert child.wait(TIMEOUT) in allowed, f'{line}\n{log.read_text()}'
        self.said[line] = log.read_text()
        return log

    def leave(self):
        """Press Ctrl-C in all terminals."""
        for child in reversed(self._stay):
            if child.poll() is None:
                os.killpg(child.pid, signal.SIGINT)
                child.wait(TIMEOUT)
        self._stay.clear()


@pytest.fixture(scope='module')
def hour(tmp_path_factory):
    folder = tmp_path_factory.mktemp('hour')
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_MASTER_URI', f'http://localhost:{free_port()}')
        patch.setenv('ROS_HOME', str(folder / 'ros'))
        patch.setenv('PYTHONUNBUFFERED', '1')  # rostopic hz says its lines at once, as on a screen
        yield Hour(folder)


@pytest.fixture(autouse=True)
def leave(hour):
    yield
    hour.leave()


@pytest.fixture(scope='module')
def blocks():
    return lines_of('README.md', 'docs/first_hour.md')


def test_photo_and_recording(hour, blocks):
    for line in [line for block in blocks for line in block if ' examples/' in line or ' hour/' in line]:
        if not line.startswith((*STAYS, './run doctor')):
            hour.type(line)
    made = hour.folder / 'hour'
    assert len(json.loads((made / 'photo/photo_keypoints.json').read_text())['people']) == 4
    assert cv2.imread(str(made / 'photo/photo_rendered.png')).shape == (270, 480, 3)
    assert (hour.folder / 'out/photo_keypoints.json').read_text() == (made / 'photo/photo_keypoints.json').read_text()
    for table in map(read_keypoint_csv, (made / 'poses.csv', hour.folder / 'out/poses.csv')):
        assert len(table.stamps) >= 0.95 * 2 * 38 and len(set(table.stamps.tolist())) == 38
    with rosbag.Bag(str(made / 'people.bag')) as bag:
        assert bag.get_message_count(['/openpose_ros/skeleton_3d/detected_poses_3d']) == 38
        assert bag.get_message_count(['/openpose_ros/skeleton_3d/people_signals']) == 38
    assert '<html' in (made / 'people.html').read_text()
    assert cv2.imread(str(made / 'plots/top_view.png')) is not None
    assert [path.name for path in sorted((made / 'trc').iterdir())] == ['person_1.trc', 'person_2.trc']
    rows = (made / 'trc/person_1.trc').read_text().splitlines()
    assert rows[0].startswith('PathFileType') and len(rows) >= 38


def test_live(hour, blocks):
    live, watched = (next(block for block in blocks if word in block[0])
                     for word in ('demo.launch', 'rostopic hz'))
    for line in live:
        hour.type(line)
    rate = hour.type(watched[0])
    await_true(lambda: 'average rate' in rate.read_text(), rate.read_text)
    for line in watched[1:]:
        hour.type(line)
    said = ''.join(hour.said.values())
    assert 'person_ID' in said and 'skeleton_extract_3d_node' in said
    (doctor,) = (said for line, said in hour.said.items() if line.startswith('./run doctor'))
    wrong = re.findall(r'^ *\d* (\w+) +WRONG', doctor, re.MULTILINE)
    assert set(wrong) <= {'load'} and '10 subscribers   right' in doctor, doctor  # what else runs here is busy, too
    with zipfile.ZipFile(str(hour.folder / 'hour/report.zip')) as report:
        assert report.namelist() == ['report.txt'], 'a picture is sent by those alone who ask for it'
        text = report.read('report.txt').decode()
    for word in ('PRETTY_NAME', 'cv2 ', '/kinect2/qhd/points (sensor_msgs/PointCloud2)', '~mode'):
        assert word in text
    with urllib.request.urlopen(f'http://localhost:{hour.web}', timeout=30) as page:
        assert page.status == 200


@pytest.mark.parametrize('first, topic', [('roscore', '/openpose_ros/skeleton_3d/detected_poses_3d'),
                                          ('source:=0', '/openpose_ros/detected_poses')])
def test_people_come_from_a_recording_and_a_webcam(hour, blocks, first, topic):
    lines = next(block for block in blocks if first in block[0])
    played = [line for line in lines if 'rosbag play' in line]
    for line in lines[:len(lines) - len(played)]:
        hour.type(line)
    echo, log = hour.start(f'./run shell rostopic echo -n 1 {topic}')
    await_true(lambda: echo.poll() is not None or listens(topic), log.read_text)
    for line in played:  # it may be over before a slow machine has started what listens
        hour.type(line)
    assert echo.wait(TIMEOUT) == 0 and 'person_ID' in log.read_text()

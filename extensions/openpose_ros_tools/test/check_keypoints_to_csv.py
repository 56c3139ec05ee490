#!/usr/bin/python3
"""keypoints_to_csv listens to running topics as rostopic echo does; Ctrl-C and SIGTERM leave a complete file."""
import contextlib
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rospy
import rostest
from openpose_ros_msgs.msg import PersonDetection, PersonDetection_3d, PersonDetection_3dArray
from std_msgs.msg import Header

sys.path.append(str(Path(__file__).resolve().parents[3] / 'tests/support'))

from openpose_ros_tools.tables.keypoint_csv import columns, read_keypoint_csv
from session import PATIENCE, await_true

FRAMES = 50


@contextlib.contextmanager
def running(*command, **options):
    """A child process, which is ended in the end."""
    child = subprocess.Popen([str(word) for word in command], **options)
    try:
        yield child
    finally:
        if child.poll() is None:
            child.kill()
        child.wait()


def person(kind, number):
    """A message of the one person of a frame."""
    message = kind(header=Header(stamp=rospy.Time(1_700_000_000, number), frame_id='camera'), num_people_detected=1,
                   person_ID=3)
    message.nose.x = number + 0.1
    message.nose.confidence = 0.5
    return message


class KeypointsToCsvTest(unittest.TestCase):

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def test_a_topic_is_written_as_rostopic_echoes_it(self):
        ours, theirs = self.folder / 'ours.csv', self.folder / 'theirs.csv'
        # a topic in the image is not taken, as one in space is there
        other = rospy.Publisher('in_space/image', PersonDetection, queue_size=1)
        publisher = rospy.Publisher('in_space/people', PersonDetection_3d, queue_size=FRAMES)
        self.addCleanup(other.unregister)
        self.addCleanup(publisher.unregister)
        with theirs.open('w') as out, \
                running('rostopic', 'echo', '-p', '/in_space/people', stdout=out) as echo, \
                running('rosrun', 'openpose_ros_tools', 'keypoints_to_csv', '--live', '--extended', '-o', ours,
                        stdout=subprocess.PIPE) as child:
            await_true(lambda: publisher.get_num_connections() == 2, 'both listen')
            for number in range(FRAMES):
                publisher.publish(person(PersonDetection_3d, number))
            await_true(lambda: theirs.read_text().count('\n') == FRAMES + 1, 'all echoed')
            await_true(lambda: ours.read_text().count('\n') == FRAMES + 1, 'a program that reads along has all rows')
            child.send_signal(signal.SIGINT)
            echo.send_signal(signal.SIGINT)
            said = child.communicate(timeout=PATIENCE)[0].decode()
            self.assertEqual(child.returncode, 0)
            echo.wait(PATIENCE)
        self.assertIn(f'{FRAMES} rows of people from /in_space/people', said)
        self.assertEqual(ours.read_text(), theirs.read_text())
        table = read_keypoint_csv(ours)
        self.assertEqual((table.stamps - 1_700_000_000 * 10 ** 9).tolist(), list(range(FRAMES)))

    def test_a_topic_that_begins_later_and_a_name_below_a_namespace(self):
        output = self.folder / 'late.csv'
        with running('rosrun', 'openpose_ros_tools', 'keypoints_to_csv', '--topic', 'late', '-o', output,
                     '__ns:=/robot', stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as child:
            self.assertIn(b'waiting for /robot/late', child.stderr.readline())
            publisher = rospy.Publisher('/robot/late', PersonDetection_3dArray, queue_size=1)
            self.addCleanup(publisher.unregister)
            await_true(lambda: publisher.get_num_connections() == 1, 'it listens')
            publisher.publish(persons=[person(PersonDetection_3d, 1), person(PersonDetection_3d, 2)])
            await_true(lambda: any(path.read_text().count('\n') == 3 for path in self.folder.iterdir()), 'two rows')
            child.send_signal(signal.SIGTERM)
            self.assertEqual(child.wait(PATIENCE), 0)
        names, *rows = output.read_text().splitlines()
        self.assertEqual(names.split(','), columns('original', 3))
        # the header of the array has no stamp
        self.assertEqual([row.split(',')[:4] for row in rows], [['0', '1', '3', '1.100000023841858'],
                                                                ['0', '1', '3', '2.0999999046325684']])

if __name__ == '__main__':
    rospy.init_node('keypoints_to_csv_test')
    rostest.rosrun('openpose_ros_tools', 'keypoints_to_csv', KeypointsToCsvTest, sys.argv)

#!/usr/bin/python3
"""keypoints_to_csv listens to running topics as rostopic echo does; Ctrl-C leaves a complete file."""
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rospy
import rostest
from openpose_ros_msgs.msg import PersonDetection, PersonDetection_3d
from std_msgs.msg import Header

sys.path.append(str(Path(__file__).resolve().parents[3] / 'tests/support'))

from openpose_ros_tools.tables.keypoint_csv import read_keypoint_csv
from session import PATIENCE, await_true

FRAMES = 50


class KeypointsToCsvTest(unittest.TestCase):

    def test_a_topic_is_written_as_rostopic_echoes_it(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        ours, theirs = Path(folder.name) / 'ours.csv', Path(folder.name) / 'theirs.csv'
        # a topic in the image is not taken, as one in space is there
        other = rospy.Publisher('in_space/image', PersonDetection, queue_size=1)
        publisher = rospy.Publisher('in_space/people', PersonDetection_3d, queue_size=FRAMES)
        with theirs.open('w') as out:
            echo = subprocess.Popen(['rostopic', 'echo', '-p', '/in_space/people'], stdout=out)
        child = subprocess.Popen(['rosrun', 'openpose_ros_tools', 'keypoints_to_csv', '--live', '--extended', '-o',
                                  str(ours)], stdout=subprocess.PIPE)
        for process in (echo, child):
            self.addCleanup(process.kill)
        await_true(lambda: publisher.get_num_connections() == 2, 'both listen')
        for number in range(FRAMES):
            person = PersonDetection_3d(header=Header(stamp=rospy.Time(1_700_000_000, number), frame_id='camera'),
                                        num_people_detected=1, person_ID=3)
            person.nose.x, person.nose.confidence = number + 0.1, 0.5
            publisher.publish(person)
        await_true(lambda: theirs.read_text().count('\n') == FRAMES + 1, 'all echoed')
        await_true(lambda: ours.read_text().count('\n') == FRAMES + 1, 'a program that reads along has all rows')
        child.send_signal(signal.SIGINT)
        said = child.communicate(timeout=PATIENCE)[0].decode()
        self.assertEqual(child.returncode, 0)
        other.unregister()
        self.assertIn(f'{FRAMES} rows of people from /in_space/people', said)
        self.assertEqual(ours.read_text(), theirs.read_text())
        table = read_keypoint_csv(ours)
        self.assertEqual((table.stamps - 1_700_000_000 * 10 ** 9).tolist(), list(range(FRAMES)))


if __name__ == '__main__':
    rospy.init_node('keypoints_to_csv_test')
    rostest.rosrun('openpose_ros_tools', 'keypoints_to_csv', KeypointsToCsvTest, sys.argv)

#!/usr/bin/python3
"""The example in roscpp says who is nearest, and where the right wrist is in base_link at the time of the image."""
import itertools
import sys
import unittest

import rospy
import rostest
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from harness import FRAME_ID
from openpose_ros_msgs.msg import BodypartDetection_3d, PersonDetection_3d, PersonDetection_3dArray
from rosgraph_msgs.msg import Log
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from session import await_true

MEASURED, INFERRED = BodypartDetection_3d.MEASURED, BodypartDetection_3d.INFERRED
# Optical frame (x right, y down, z forward) in a frame with x forward, y left, z up.
OPTICAL = Quaternion(-0.5, 0.5, -0.5, 0.5)


def person(number, **parts):
    """Return a person with some parts: name=(x, y, z, status, sigma)."""
    message = PersonDetection_3d(person_ID=number)
    for name, (x, y, z, status, sigma) in parts.items():
        setattr(message, name, BodypartDetection_3d(x=x, y=y, z=z, confidence=0.5, status=status, sigma=sigma))
    return message


def camera_at(stamp, x):
    """Return the transform of a camera that is x m before base_link, and 1.2 m above."""
    transform = TransformStamped(header=Header(stamp=stamp, frame_id='base_link'), child_frame_id=FRAME_ID)
    transform.transform.translation, transform.transform.rotation = Vector3(x, 0.0, 1.2), OPTICAL
    return transform


class NearestPersonTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_nearest_person')
        cls.said = []
        cls.log = rospy.Subscriber('/rosout', Log,
                                   lambda log: log.name == '/nearest_person' and cls.said.append(log))
        cls.people = rospy.Publisher('openpose_ros/skeleton_3d/detected_poses_3d', PersonDetection_3dArray,
                                     queue_size=20)
        cls.tf = rospy.Publisher('/tf', TFMessage, queue_size=20)
        await_true(lambda: cls.people.get_num_connections() and cls.tf.get_num_connections(), 'the example is there')
        await_true(lambda: cls.log.get_num_connections(), 'the log is there')

    def send(self, stamp, *people):
        header = Header(stamp=stamp, frame_id=FRAME_ID)
        for each in people:
            each.header, each.num_people_detected = header, len(people)
        self.people.publish(PersonDetection_3dArray(header=header, pose_model='COCO_18', persons=list(people)))

    def hears(self, *words):
        """Return a line of the log with all these words."""
        return next((log for log in list(self.said) if all(word in log.msg for word in words)), None)

    def test_1_without_a_transform_it_says_which_one(self):
        stamps = iter(range(1, 10000))

        def send_and_listen():
            self.send(rospy.Time(next(stamps), 0), person(1, nose=(0, 0, 1, MEASURED, 0.01)))
            return self.hears('left out', FRAME_ID, 'base_link', '~target_frame')

        warning = await_true(send_and_listen, 'a warning')
        self.assertEqual(warning.level, Log.WARN)
        self.assertIsNone(self.hears('nearest'))

    def test_2_the_nearest_person_at_the_time_of_the_image(self):
        # the camera moves by 1 m in a second
        self.tf.publish(TFMessage([camera_at(rospy.Time(20100), 0.1), camera_at(rospy.Time(20101), 1.1)]))
        near = person(7, right_wrist=(0.3, 0.1, 2.0, MEASURED, 0.02), nose=(0.0, 0.0, 1.5, INFERRED, 0.1))
        far = person(8, right_wrist=(0.0, 0.0, 3.0, MEASURED, 0.02))
        later = itertools.count(1)

        def hears_or_moves_on():
            """Send people and tf again and again, as a robot does.

            tf2 may look at a waiting message with the next transform only, and its MessageFilter loses a message whose
            transform comes while it is put into the queue.
            """
            # forward: 2.0 from the camera, which is 0.6 before base_link; left: -0.3; up: 1.2 - 0.1
            heard = self.hears('person 7 is nearest, 1.50 m from the camera',
                               'right wrist is at 2.60, -0.30, 1.10 m in base_link, measured, sigma 0.02 m')
            if heard is None:
                self.send(rospy.Time(20100, 500000000), far, near)
                self.tf.publish(TFMessage([camera_at(rospy.Time(20101, 1000000 * next(later)), 1.1)]))
            return heard

        await_true(hears_or_moves_on, 'the wrist')

    def test_3_inferred_and_missing_wrists(self):
        self.send(rospy.Time(20100), person(9, right_wrist=(0.0, 0.0, 1.0, INFERRED, 0.25)))
        await_true(lambda: self.hears('person 9', '1.10, -0.00, 1.20 m', 'inferred, sigma 0.25 m')
                   or self.hears('person 9', '1.10, 0.00, 1.20 m', 'inferred, sigma 0.25 m'), 'an inferred wrist')
        self.send(rospy.Time(20100), person(10, nose=(0.0, 0.0, 1.0, MEASURED, 0.01)))
        await_true(lambda: self.hears('person 10', 'the right wrist is not known'), 'a missing wrist')
        self.send(rospy.Time(20100))
        await_true(lambda: self.hears('nobody'), 'nobody')


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_nodelets', 'check_nearest_person', NearestPersonTest, sys.argv)

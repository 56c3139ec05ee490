#!/usr/bin/python3
import math

import rospy
from openpose_ros_msgs.msg import PersonSignalsArray
from std_msgs.msg import String

from openpose_ros_pkg.errors import NoTransformError
from skeleton_extract_3d.ros.transforms import Transforms

NEAR, TOWARDS, AGAIN = 3.0, 0.8, 60.0  # [m], cosine, [s]


class GreetWhoComes:
    def __init__(self):
        self.transforms = Transforms(0.2)  # [s] waited for
        self.greeted = {}  # by id: when last seen [s]
        self.voice = rospy.Publisher('say', String, queue_size=1)
        rospy.Subscriber('openpose_ros/skeleton_3d/people_signals', PersonSignalsArray, self.on_signals, queue_size=1)

    def on_signals(self, message):
        header = message.header
        try:
            robot = self.transforms.lookup(header.frame_id, 'base_link', header.stamp).transform.translation
        except NoTransformError as error:
            rospy.logwarn_throttle(5.0, f'signals are not used: {error}')
            return
        now = header.stamp.to_sec()
        self.greeted = {name: seen for name, seen in self.greeted.items() if 0 <= now - seen < AGAIN}
        for person in message.persons:
            if person.person_ID not in self.greeted:
                if not self.comes(person, robot):
                    continue
                self.voice.publish('Hello!')
            self.greeted[person.person_ID] = now

    @staticmethod
    def comes(person, robot):
        x, y = robot.x - person.floor_pose.position.x, robot.y - person.floor_pose.position.y
        distance, way = math.hypot(x, y), person.walking_direction
        return person.moving and distance < NEAR and way.x * x + way.y * y > TOWARDS * distance


rospy.init_node('greet_who_comes')
node = GreetWhoComes()
rospy.spin()

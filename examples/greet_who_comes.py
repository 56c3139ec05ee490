#!/usr/bin/python3
import math

import rospy
import tf2_ros
from openpose_ros_msgs.msg import PersonSignalsArray
from std_msgs.msg import String

NEAR, TOWARDS, AGAIN = 3.0, 0.8, 60.0  # [m], cosine, [s]
LOST, SAME_PLACE = 2.0, 1.0  # [s], [m]


class GreetWhoComes:
    def __init__(self):
        self.buffer = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.buffer)
        self.greeted = {}  # by id: when and where last seen
        self.voice = rospy.Publisher('say', String, queue_size=1)
        rospy.Subscriber('openpose_ros/skeleton_3d/people_signals', PersonSignalsArray, self.on_signals, queue_size=1)

    def on_signals(self, message):
        header = message.header
        try:
            robot = self.buffer.lookup_transform(header.frame_id, 'base_link', header.stamp,
                                                 rospy.Duration(0.2)).transform.translation
        except tf2_ros.TransformException as error:
            rospy.logwarn_throttle(5.0, f'signals are not used: {error}')
            return
        now = header.stamp.to_sec()
        self.greeted = {name: seen for name, seen in self.greeted.items() if 0 <= now - seen[0] < AGAIN}
        present = {person.person_ID for person in message.persons}
        for person in message.persons:
            place = person.floor_pose.position
            if math.isnan(place.x):
                continue
            if person.person_ID not in self.greeted:
                former = self.former_id(place, present, now)
                if former is not None:
                    del self.greeted[former]
                elif self.comes(person, place, robot):
                    self.voice.publish('Hello!')
                else:
                    continue
            self.greeted[person.person_ID] = now, place

    def former_id(self, here, present, now):
        """Return the id of a greeted person that was lost here a moment ago."""
        return next((name for name, (when, place) in self.greeted.items() if name not in present and now - when < LOST
                     and math.hypot(place.x - here.x, place.y - here.y) < SAME_PLACE), None)

    @staticmethod
    def comes(person, place, robot):
        x, y = robot.x - place.x, robot.y - place.y
        distance, way = math.hypot(x, y), person.walking_direction
        return person.moving and distance < NEAR and way.x * x + way.y * y > TOWARDS * distance


rospy.init_node('greet_who_comes')
node = GreetWhoComes()
rospy.spin()

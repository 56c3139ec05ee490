#!/usr/bin/python3
import rospy
from geometry_msgs.msg import Twist
from openpose_ros_msgs.msg import PeopleSummary, ZoneState

LATE = 0.7  # [s]


class StopNearPeople:
    def __init__(self):
        self.clear = None  # stamp of the newest frame, if its zones are empty
        self.output = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        rospy.Subscriber('openpose_ros/skeleton_3d/people_summary', PeopleSummary, self.on_people, queue_size=1)
        rospy.Subscriber('cmd_vel_in', Twist, self.on_command, queue_size=1)
        rospy.Timer(rospy.Duration(0.1), self.on_timer)

    def on_people(self, message):
        clear = bool(message.zones) and all(zone.state == ZoneState.EMPTY for zone in message.zones)
        self.clear = message.header.stamp if clear else None

    def is_clear(self):
        clear = self.clear
        return clear is not None and abs((rospy.Time.now() - clear).to_sec()) < LATE

    def on_command(self, command):
        if self.is_clear():
            self.output.publish(command)

    def on_timer(self, _):
        if not self.is_clear():
            self.output.publish(Twist())


rospy.init_node('stop_near_people')
node = StopNearPeople()
rospy.spin()

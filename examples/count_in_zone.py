#!/usr/bin/python3
import rospy
from openpose_ros_msgs.msg import PeopleSummary, ZoneState
from std_msgs.msg import Int32

LATE = 0.7  # [s]


def on_people(message):
    for zone in message.zones[:1]:
        unknown = zone.state == ZoneState.UNKNOWN
        newest[:] = message.header.stamp, -1 if unknown else len(zone.person_IDs)


def on_timer(_):
    output.publish(newest[1] if abs((rospy.Time.now() - newest[0]).to_sec()) < LATE else -1)


rospy.init_node('count_in_zone')
newest = [rospy.Time(), -1]
output = rospy.Publisher('people_in_zone', Int32, queue_size=1)
rospy.Subscriber('openpose_ros/skeleton_3d/people_summary', PeopleSummary, on_people, queue_size=1)
timer = rospy.Timer(rospy.Duration(0.2), on_timer)
rospy.spin()

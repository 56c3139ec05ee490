#!/usr/bin/python3
import rospy
from openpose_ros_msgs.msg import PersonSignalsArray
from std_msgs.msg import Int32

ZONE = [(1.0, -1.0), (3.0, -1.0), (3.0, 1.0), (1.0, 1.0)]  # x, y [m] in the frame of the signals
LATE = 0.7  # [s]


def is_inside(x, y):
    crossed = 0  # edges to the right of the point; none of NaN
    for (x1, y1), (x2, y2) in zip(ZONE, ZONE[1:] + ZONE[:1]):
        crossed += (y1 > y) != (y2 > y) and x < x1 + (y - y1) / (y2 - y1) * (x2 - x1)
    return crossed % 2 == 1


class CountInZone:
    def __init__(self):
        self.stamp, self.number = None, 0
        self.output = rospy.Publisher('people_in_zone', Int32, queue_size=1)
        rospy.Subscriber('openpose_ros/skeleton_3d/people_signals', PersonSignalsArray, self.on_signals, queue_size=1)
        rospy.Timer(rospy.Duration(0.2), self.on_timer)

    def on_signals(self, message):
        places = [person.floor_pose.position for person in message.persons]
        self.stamp, self.number = message.header.stamp, sum(is_inside(place.x, place.y) for place in places)

    def on_timer(self, _):
        known = self.stamp is not None and abs((rospy.Time.now() - self.stamp).to_sec()) < LATE
        self.output.publish(self.number if known else -1)


rospy.init_node('count_in_zone')
node = CountInZone()
rospy.spin()

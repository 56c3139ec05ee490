#!/usr/bin/python3
import math

import rospy
from openpose_ros_msgs.srv import GetPeople
from std_msgs.msg import String


def text():
    try:
        nearest = people().people.persons[:1]  # the nearest is the first
    except rospy.ServiceException:
        return 'unknown'
    if not nearest:
        return 'no person'
    if math.isnan(nearest[0].distance):
        return 'a person, the place is unknown'
    side = 'left' if nearest[0].bearing > 0 else 'right'
    return f'{nearest[0].distance:.1f} m, {abs(math.degrees(nearest[0].bearing)):.0f} degrees to the {side}'


rospy.init_node('say_who_is_near')
people = rospy.ServiceProxy('get_people', GetPeople)
output = rospy.Publisher('say', String, queue_size=1)
timer = rospy.Timer(rospy.Duration(1.0), lambda _: output.publish(text()))
rospy.spin()

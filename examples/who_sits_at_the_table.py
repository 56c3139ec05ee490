#!/usr/bin/python3
import math

import rospy
from openpose_ros_msgs.msg import PersonSignals
from openpose_ros_msgs.srv import GetPeople
from std_msgs.msg import String

TABLE, RADIUS = (2.0, 0.5), 1.2  # [m], frame of the signals
SEATED, LONG = 0.95, 5.0  # greatest height of the middle of the trunk [m]; [s]


def sits(person):
    if person.posture == PersonSignals.UNKNOWN:
        return person.position.z < SEATED  # false of NaN: the trunk is hidden
    return person.posture == PersonSignals.SITTING


class WhoSitsAtTheTable:
    def __init__(self):
        self.people = rospy.ServiceProxy('get_people', GetPeople)
        self.since = {}
        self.output = rospy.Publisher('at_table', String, queue_size=1, latch=True)
        rospy.Timer(rospy.Duration(1.0), self.on_timer)

    def on_timer(self, _):
        try:
            people = self.people().people
        except rospy.ServiceException:
            self.output.publish('unknown')
            return
        now = people.header.stamp
        self.since = {each.signals.person_ID: self.sits_since(each.signals, now) for each in people.persons
                      if self.is_there(each.signals.floor_pose.position) and sits(each.signals)}
        seated = sorted(name for name, since in self.since.items() if (now - since).to_sec() >= LONG)
        self.output.publish(' '.join(map(str, seated)))

    @staticmethod
    def is_there(place):
        return math.hypot(place.x - TABLE[0], place.y - TABLE[1]) < RADIUS

    def sits_since(self, person, now):
        since = person.posture_since if person.posture == PersonSignals.SITTING else now
        return min(since, self.since.get(person.person_ID, now))


rospy.init_node('who_sits_at_the_table')
node = WhoSitsAtTheTable()
rospy.spin()

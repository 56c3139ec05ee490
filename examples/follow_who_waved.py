#!/usr/bin/python3
import math

import rospy
from geometry_msgs.msg import PointStamped, Twist
from openpose_ros_msgs.msg import PersonGesture, PersonSignalsArray
from tf2_geometry_msgs import do_transform_point

from openpose_ros_pkg.errors import NoTransformError
from skeleton_extract_3d.ros.transforms import Transforms

DISTANCE, SPEED, TURN = 1.2, 0.5, 0.8  # [m], [m/s], [rad/s]
LATE, LOST = 0.7, 3.0  # [s]


def makes(person, gesture):
    return any(each.name == gesture for each in person.gestures)


class FollowWhoWaved:
    def __init__(self):
        self.transforms = Transforms(0.2)  # [s] waited for
        self.leader, self.seen, self.velocity = None, rospy.Time(), Twist()
        self.output = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        rospy.Subscriber('openpose_ros/skeleton_3d/people_signals', PersonSignalsArray, self.on_signals, queue_size=1)
        rospy.Timer(rospy.Duration(0.1), self.on_timer)

    def on_signals(self, message):
        seen = [person for person in message.persons if not math.isnan(person.floor_pose.position.x)]
        leaders = [person for person in seen if person.person_ID == self.leader
                   or (self.leader is None and makes(person, PersonGesture.WAVE))]
        if not leaders:
            return
        leader = leaders[0]
        if makes(leader, PersonGesture.STOP):
            self.leader, self.velocity = None, Twist()
            return
        try:
            robot = self.transforms.lookup('base_link', message.header.frame_id, message.header.stamp)
            place = do_transform_point(PointStamped(point=leader.floor_pose.position), robot).point
        except NoTransformError as error:
            rospy.logwarn_throttle(5.0, f'signals are not used: {error}')
            return
        self.leader, self.seen = leader.person_ID, message.header.stamp
        self.velocity = self.towards(math.atan2(place.y, place.x), math.hypot(place.x, place.y))

    @staticmethod
    def towards(bearing, distance):
        velocity = Twist()
        velocity.angular.z = max(-TURN, min(TURN, 1.5 * bearing))
        if abs(bearing) < 0.5:
            velocity.linear.x = max(0.0, min(SPEED, distance - DISTANCE))
        return velocity

    def on_timer(self, _):
        late = abs((rospy.Time.now() - self.seen).to_sec())
        if late > LOST:
            self.leader = None
        self.output.publish(Twist() if self.leader is None or late > LATE else self.velocity)


rospy.init_node('follow_who_waved')
node = FollowWhoWaved()
rospy.spin()

#!/usr/bin/python3
import math

import rospy
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from openpose_ros_msgs.msg import PersonGesture, PersonSignalsArray

HELD, LATE, OFF, FARTHEST = 1.0, 0.7, 0.8, 5.0  # [s], [s], [m], [m]
SURE = 0.7  # least probability of a known target


def meant(ray):
    """Return what a ray means: x, y, and how far away the floor is [m]; None: nothing that is known well enough."""
    if ray.targets and ray.targets[0].probability < SURE:
        return None
    if not math.isnan(ray.hit.x):
        return ray.hit.x, ray.hit.y, 0.0
    if ray.direction.z > -0.1:  # hardly goes down to the floor, z = 0 of the map
        return None
    way = -ray.origin.z / ray.direction.z
    return ray.origin.x + way * ray.direction.x, ray.origin.y + way * ray.direction.y, way


class GoWherePointed:
    def __init__(self):
        self.done = {}  # by person, when a pointing began that was answered
        self.goal = rospy.Publisher('move_base_simple/goal', PoseStamped, queue_size=1)
        rospy.Subscriber('openpose_ros/skeleton_3d/people_signals', PersonSignalsArray, self.on_signals, queue_size=1)

    def on_signals(self, message):
        stamp = message.header.stamp
        if abs((rospy.Time.now() - stamp).to_sec()) > LATE:
            return
        for person in message.persons:
            for gesture in person.gestures:
                held = (stamp - gesture.since).to_sec()
                if gesture.name != PersonGesture.POINT or not gesture.pointing or held < HELD:
                    continue
                if self.done.get(person.person_ID) == gesture.since:
                    continue
                goal = meant(gesture.pointing[0])
                if goal is None or goal[2] > FARTHEST or gesture.pointing[0].sigma * goal[2] > OFF:
                    continue
                self.done[person.person_ID] = gesture.since
                self.goal.publish(PoseStamped(message.header, self.facing(goal, gesture.pointing[0])))

    @staticmethod
    def facing(goal, ray):
        half = math.atan2(ray.direction.y, ray.direction.x) / 2
        return Pose(Point(goal[0], goal[1], 0.0), Quaternion(0.0, 0.0, math.sin(half), math.cos(half)))


rospy.init_node('go_where_pointed')
node = GoWherePointed()
rospy.spin()

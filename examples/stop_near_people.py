#!/usr/bin/python3
import math

import rospy
from geometry_msgs.msg import Point, PointStamped, Twist
from openpose_ros_msgs.msg import BodypartDetection_3d, PersonDetection_3d, PersonDetection_3dArray
from tf2_geometry_msgs import do_transform_point

from openpose_ros_pkg.errors import NoTransformError
from skeleton_extract_3d.ros.transforms import Transforms

NEAR, LATE = 1.0, 0.7  # [m] from base_link; [s]
PARTS = PersonDetection_3d.__slots__[3:]  # after header, num_people_detected, person_ID


class StopNearPeople:
    def __init__(self):
        self.transforms = Transforms(0.2)  # [s] waited for
        self.clear = None  # stamp of the newest frame, if no person in it is near
        self.output = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        rospy.Subscriber('openpose_ros/skeleton_3d/detected_poses_3d', PersonDetection_3dArray, self.on_people,
                         queue_size=1)
        rospy.Subscriber('cmd_vel_in', Twist, self.on_command, queue_size=1)
        rospy.Timer(rospy.Duration(0.1), self.on_timer)

    def on_people(self, message):
        header = message.header
        try:
            camera = self.transforms.lookup('base_link', header.frame_id, header.stamp)
        except NoTransformError as error:
            rospy.logwarn_throttle(5.0, f'people are not used: {error}')
            return  # the robot stops when that lasts
        near = any(self.distance(getattr(person, part), camera) < NEAR for person in message.persons for part in PARTS)
        self.clear = None if near else header.stamp

    @staticmethod
    def distance(part, camera):
        if part.status == BodypartDetection_3d.MISSING:
            return math.inf
        point = do_transform_point(PointStamped(point=Point(part.x, part.y, part.z)), camera).point
        return math.hypot(point.x, point.y)

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

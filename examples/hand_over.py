#!/usr/bin/python3
import math

import rospy
from geometry_msgs.msg import Point, PointStamped
from openpose_ros_msgs.msg import BodypartDetection_3d, PersonDetection_3dArray
from std_msgs.msg import Header
from tf2_geometry_msgs import do_transform_point

from openpose_ros_pkg.errors import NoTransformError
from skeleton_extract_3d.ros.transforms import Transforms

REACH, SIGMA, REST, FARTHEST = 0.25, 0.05, 0.15, 1.5  # [m], [m], [m/s], [m]


class HandOver:
    def __init__(self):
        self.transforms = Transforms(0.2)  # [s] waited for
        self.output = rospy.Publisher('hand_over', PointStamped, queue_size=1)
        rospy.Subscriber('openpose_ros/skeleton_3d/detected_poses_3d', PersonDetection_3dArray, self.on_people,
                         queue_size=1)

    def on_people(self, message):
        header = message.header
        try:
            camera = self.transforms.lookup('base_link', header.frame_id, header.stamp)
        except NoTransformError as error:
            rospy.logwarn_throttle(5.0, f'people are not used: {error}')
            return
        wrists = [self.held_out(person, velocity, side, camera) for side in ('left', 'right')
                  for person, velocity in zip(message.persons, message.velocities)]
        nearest = min(filter(None, wrists), key=lambda point: math.hypot(point.x, point.y), default=None)
        if nearest is not None:
            self.output.publish(PointStamped(Header(stamp=header.stamp, frame_id='base_link'), nearest))

    def held_out(self, person, velocity, side, camera):
        """Return a wrist in base_link if it is held out to the robot, else None."""
        wrist, shoulder, hip = (getattr(person, f'{side}_{name}') for name in ('wrist', 'shoulder', 'hip'))
        speed = getattr(velocity, f'{side}_wrist')
        if wrist.status != BodypartDetection_3d.MEASURED or not wrist.sigma < SIGMA:
            return None
        if not math.sqrt(speed.x ** 2 + speed.y ** 2 + speed.z ** 2) < REST:  # NaN: not known
            return None
        wrist, shoulder, hip = (do_transform_point(PointStamped(point=Point(part.x, part.y, part.z)), camera).point
                                for part in (wrist, shoulder, hip))
        distance = math.hypot(wrist.x, wrist.y)
        reach = math.hypot(shoulder.x, shoulder.y) - distance
        held = distance < FARTHEST and reach > REACH and hip.z < wrist.z < shoulder.z  # false where one is NaN
        return wrist if held else None


rospy.init_node('hand_over')
node = HandOver()
rospy.spin()

#!/usr/bin/python3
import math

import rospy
from geometry_msgs.msg import Point, PointStamped
from openpose_ros_msgs.msg import BodypartDetection_3d, FaceDetection_3dArray

FACING, KEPT = 25.0, 10.0  # [deg]


def middle_of(face):
    known = [part for part in face.keypoints if part.status == BodypartDetection_3d.MEASURED]
    return [sum(getattr(part, axis) for part in known) / len(known) for axis in 'xyz'] if known else None


def angle_to_camera(face, middle):
    q = face.orientation  # its x points out of the face
    ahead = (1 - 2 * (q.y ** 2 + q.z ** 2), 2 * (q.x * q.y + q.z * q.w), 2 * (q.x * q.z - q.y * q.w))
    away = math.sqrt(sum(value ** 2 for value in middle))
    return math.degrees(math.acos(max(-1.0, min(1.0, -sum(a * m for a, m in zip(ahead, middle)) / away))))


class LookAtWhoFacesMe:
    def __init__(self):
        self.person = None
        self.output = rospy.Publisher('look_at', PointStamped, queue_size=1)
        rospy.Subscriber('openpose_ros/skeleton_3d/detected_faces_3d', FaceDetection_3dArray, self.on_faces,
                         queue_size=1)

    def on_faces(self, message):
        facing = []
        for face in message.faces:
            middle = middle_of(face)
            if middle is None or math.isnan(face.orientation.x):
                continue  # hidden, or its direction is not known
            angle = angle_to_camera(face, middle) - (KEPT if face.person_ID == self.person else 0.0)
            facing.append((angle, face.person_ID, middle))
        angle, self.person, middle = min(facing, default=(math.inf, None, None))
        if angle < FACING:
            self.output.publish(PointStamped(message.header, Point(*middle)))


rospy.init_node('look_at_who_faces_me')
node = LookAtWhoFacesMe()
rospy.spin()

#!/usr/bin/python3
import message_filters
import rospy
from openpose_ros_msgs.msg import (
    BodypartDetection_3d,
    PersonDetection_3d,
    PersonDetection_3dArray,
    PersonSignals,
    PersonSignalsArray,
)
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2

NAMESPACE = 'openpose_ros/skeleton_3d'
PARTS = PersonDetection_3d.__slots__[3:]  # after header, num_people_detected, person_ID


class LyingPeople:
    def __init__(self):
        self.lying = set()
        self.output = rospy.Publisher('lying_people', PointCloud2, queue_size=1)
        inputs = [message_filters.Subscriber(f'{NAMESPACE}/detected_poses_3d', PersonDetection_3dArray),
                  message_filters.Subscriber(f'{NAMESPACE}/people_signals', PersonSignalsArray)]
        self.pairs = message_filters.TimeSynchronizer(inputs, 15)  # of equal stamps
        self.pairs.registerCallback(self.on_pair)

    def on_pair(self, people, signals):
        posture = {person.person_ID: person.posture for person in signals.persons}
        self.lying = {name for name, known in posture.items()
                      if known == PersonSignals.LYING or (known == PersonSignals.UNKNOWN and name in self.lying)}
        points = [(part.x, part.y, part.z) for person in people.persons if person.person_ID in self.lying
                  for part in (getattr(person, name) for name in PARTS) if part.status != BodypartDetection_3d.MISSING]
        self.output.publish(point_cloud2.create_cloud_xyz32(people.header, points))  # in the frame of the camera


rospy.init_node('lying_people')
node = LyingPeople()
rospy.spin()

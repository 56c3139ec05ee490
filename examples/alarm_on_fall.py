#!/usr/bin/python3
import rospy
from geometry_msgs.msg import PointStamped
from openpose_ros_msgs.msg import PersonSignalsArray
from std_msgs.msg import Bool, Header

LATE = 2.0  # [s]


class AlarmOnFall:
    def __init__(self):
        self.stamp, self.alarmed = None, set()
        self.alarm = rospy.Publisher('fall_alarm', PointStamped, queue_size=10, latch=True)
        self.watch = rospy.Publisher('fall_watch', Bool, queue_size=1)
        rospy.Subscriber('openpose_ros/skeleton_3d/people_signals', PersonSignalsArray, self.on_signals, queue_size=1)
        rospy.Timer(rospy.Duration(0.5), self.on_timer)

    def on_signals(self, message):
        self.stamp = message.header.stamp
        for person in message.persons:
            if person.fallen and (person.person_ID, person.fall_stamp) not in self.alarmed:
                self.alarmed.add((person.person_ID, person.fall_stamp))
                header = Header(stamp=person.fall_stamp, frame_id=message.header.frame_id)
                self.alarm.publish(PointStamped(header, person.floor_pose.position))
                rospy.logerr(f'person {person.person_ID} fell within {person.fall_duration:.1f} s')

    def on_timer(self, _):
        watches = self.stamp is not None and abs((rospy.Time.now() - self.stamp).to_sec()) < LATE
        if not watches:
            rospy.logwarn_throttle(10.0, 'no people come: falls are not seen')
        self.watch.publish(watches)


rospy.init_node('alarm_on_fall')
node = AlarmOnFall()
rospy.spin()

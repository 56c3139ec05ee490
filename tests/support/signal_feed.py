"""Signals of people that tests make by hand, for programs that read them."""
import threading

import rospy
from geometry_msgs.msg import Point, Pose, Vector3
from openpose_ros_msgs.msg import PersonGesture, PersonSignals, PersonSignalsArray
from std_msgs.msg import Header

from session import await_true

NAN = float('nan')
RATE = 20.0


def does(number, x=NAN, y=NAN, z=1.1, *gestures, **values):
    """Return the signals of a person at a place of the room."""
    told_else = {'posture': PersonSignals.STANDING, 'speed': NAN, 'walking_direction': Vector3(NAN, NAN, NAN),
                 'body_facing': Vector3(NAN, NAN, NAN), 'body_facing_sigma': NAN, **values}
    return PersonSignals(person_ID=number, position=Point(x, y, z), floor_pose=Pose(position=Point(x, y, 0.0)),
                         gestures=list(gestures), **told_else)


def signals(*persons):
    """Return what makes the message of these people, for `Feed`."""
    return lambda header: PersonSignalsArray(header=header, persons=list(persons))


def told(name, arm='right', since=None, ray=()):
    """Return a gesture that a person makes."""
    return PersonGesture(name=name, arm=arm, since=since or rospy.Time(1), confidence=1.0, pointing=list(ray))


class Feed(threading.Thread):
    """Publishes what it is told on a topic, again and again with new stamps, to a program that has subscribed."""

    def __init__(self, topic, kind, make, frame_id='map'):
        super().__init__(daemon=True)
        self._topic, self.make, self.sent = rospy.Publisher(topic, kind, queue_size=5), make, 0
        self._frame_id = frame_id
        await_true(self._topic.get_num_connections, f'a reader of {topic}')
        self._ended = threading.Event()

    def run(self):
        while not self._ended.wait(1 / RATE):
            self._topic.publish(self.make(Header(stamp=rospy.Time.now(), frame_id=self._frame_id)))
            self.sent += 1

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self.join()

    def send(self, make, frames=0):
        """Publish something else from now on; return after some frames of it."""
        self.make, end = make, self.sent + 1 + frames
        await_true(lambda: self.sent >= end, 'frames are sent')

#!/usr/bin/python3
import contextlib
import math
import time
from typing import NamedTuple

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import Point, PointStamped, Pose, PoseStamped, Quaternion, Vector3Stamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from openpose_ros_msgs.msg import PersonGesture, PersonSignalsArray
from std_msgs.msg import Header
from tf2_geometry_msgs import do_transform_point, do_transform_vector3

from openpose_ros_pkg.errors import NoTransformError
from skeleton_extract_3d.ros.transforms import Transforms

LATE, LOST = 0.7, 1.5  # [s] without signals; without the person, or its place
MOVED, TURNED, PAUSE = 0.3, 0.5, 1.0  # [m], [rad] of the goal, and [s] between two goals
SURE = 0.8  # [rad] greatest error of the facing
RUNNING = (GoalStatus.PENDING, GoalStatus.ACTIVE)
TAKEN = (GoalStatus.PREEMPTED, GoalStatus.RECALLED)  # by another program or an operator


class Place(NamedTuple):
    x: float
    y: float
    yaw: float


def makes(person, gesture, since):
    return any(each.name == gesture and each.since > since for each in person.gestures)


class ApproachPerson:
    def __init__(self):
        self.distance = rospy.get_param('~distance', 1.2)  # [m] from the person
        self.wanted = rospy.get_param('~person', 'wave')  # 'wave', 'nearest' or a person_ID
        if self.wanted not in ('wave', 'nearest') and not str(self.wanted).isdigit():
            raise SystemExit(f"~person is '{self.wanted}', expected wave, nearest or a person_ID")
        self.frame = rospy.get_param('~frame', 'map').lstrip('/')
        self.transforms = Transforms(0.2)  # [s] waited for
        self.message = None  # newest signals
        self.person, self.seen, self.since = None, rospy.Time(), rospy.Time()  # id; last seen; waves until then are old
        self.goal, self.sent, self.in_front = None, rospy.Time(), True
        self.move_base = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        rospy.Subscriber('openpose_ros/skeleton_3d/people_signals', PersonSignalsArray, self.on_signals, queue_size=1)
        while not self.move_base.wait_for_server(rospy.Duration(2.0)) and not rospy.is_shutdown():
            rospy.loginfo('waiting for move_base')
        rospy.on_shutdown(self.cancel)

    def on_signals(self, message):
        self.message = message

    def step(self):
        now, message = rospy.Time.now(), self.message
        self.since = min(self.since, now)  # a simulation may begin again
        if self.goal is not None and self.has_ended(self.move_base.get_state()):
            return
        if message is None or abs((now - message.header.stamp).to_sec()) > LATE:
            self.lose('no signals')
            return
        try:
            places = self.places(message)
        except NoTransformError as error:
            rospy.logwarn_throttle(5.0, f'signals are not used: {error}')
            places = {}
        if self.person is None:
            self.person = self.choice(message, places)
        chosen = [person for person in message.persons if person.person_ID == self.person]
        if any(makes(person, PersonGesture.STOP, rospy.Time()) for person in chosen):
            self.finish(f'person {self.person} shows stop')
        elif self.person in places:
            self.seen = message.header.stamp
            self.approach(places[self.person][0], now)
        elif abs((now - self.seen).to_sec()) > LOST:
            self.lose(f'person {self.person} is lost')

    def places(self, message):
        """Return by person_ID where to go and how far that person is away [m]."""
        header = message.header
        room, base = (self.transforms.lookup(self.frame, name, header.stamp)
                      for name in (header.frame_id, 'base_link'))
        robot, found = base.transform.translation, {}
        for person in message.persons:
            here = do_transform_point(PointStamped(point=person.floor_pose.position), room).point
            if math.isnan(here.x):
                continue
            facing = do_transform_vector3(Vector3Stamped(vector=person.body_facing), room).vector
            x, y = robot.x - here.x, robot.y - here.y
            away = math.hypot(x, y)
            if self.in_front and person.body_facing_sigma < SURE:  # false where it is NaN
                x, y = facing.x, facing.y
            yaw = math.atan2(y, x)  # from the person to the place
            found[person.person_ID] = Place(here.x + self.distance * math.cos(yaw),
                                            here.y + self.distance * math.sin(yaw), yaw + math.pi), away
        return found

    def choice(self, message, places):
        known = [person for person in message.persons if person.person_ID in places]
        if self.wanted == 'wave':
            known = [person for person in known if makes(person, PersonGesture.WAVE, self.since)]
        elif self.wanted != 'nearest':
            known = [person for person in known if person.person_ID == int(self.wanted)]
        return min((person.person_ID for person in known), key=lambda number: places[number][1], default=None)

    def approach(self, place, now):
        """Send a goal if it is another one than that which move_base has."""
        if self.goal is not None:
            turn = abs(math.remainder(place.yaw - self.goal.yaw, 2 * math.pi))
            if math.hypot(place.x - self.goal.x, place.y - self.goal.y) < MOVED and turn < TURNED:
                return
        if abs((now - self.sent).to_sec()) < PAUSE:
            return
        self.goal, self.sent = place, now
        turned = Quaternion(0.0, 0.0, math.sin(place.yaw / 2), math.cos(place.yaw / 2))
        self.move_base.send_goal(MoveBaseGoal(PoseStamped(Header(stamp=now, frame_id=self.frame),
                                                          Pose(Point(place.x, place.y, 0.0), turned))))

    def has_ended(self, state):
        """Return whether move_base has ended, and what follows of it."""
        if state in RUNNING:
            return False
        self.goal = None
        if state == GoalStatus.SUCCEEDED:
            self.finish(f'before person {self.person}')
        elif state in TAKEN:
            self.finish('move_base was given another goal, or none')
        else:  # the place in front cannot be reached: next time from the robot's own side, and in turn
            self.in_front = not self.in_front
        return True

    def finish(self, why):
        """Wait for a new wave, or end."""
        self.lose(why)
        self.since = rospy.Time.now()
        if self.wanted != 'wave':
            rospy.signal_shutdown(why)

    def lose(self, why):
        """Cancel the goal and forget the person."""
        if self.person is not None:
            rospy.loginfo(f'the approach ends: {why}')
        self.cancel()
        self.person, self.in_front = None, True

    def cancel(self):
        """Cancel the goal and wait until move_base has left it; a node that ends at once may lose the message."""
        if self.goal is not None:
            self.goal, deadline = None, time.monotonic() + 1.0
            self.move_base.cancel_goal()
            while self.move_base.get_state() in RUNNING and time.monotonic() < deadline:
                rospy.rostime.wallsleep(0.02)


rospy.init_node('approach_person')
node = ApproachPerson()
while not rospy.is_shutdown():
    with contextlib.suppress(rospy.ROSInterruptException):  # the end, or a simulation that begins again
        node.step()
    rospy.rostime.wallsleep(0.1)

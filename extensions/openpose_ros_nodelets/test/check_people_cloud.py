#!/usr/bin/python3
"""Points of people get their ids, and are missing in the rest; clouds wait for people; faults are counted."""
import sys

import numpy as np
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import TransformStamped
from harness import FRAME_ID, CloudTest, cloud
from openpose_ros_msgs.msg import BodypartDetection_3d, PersonDetection_3d, PersonDetection_3dArray
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from session import Recorder, await_true

WIDTH, HEIGHT = 192, 160
FOCAL_LENGTH = 120.0  # [px]
WALL, PERSON = 4.0, 2.0  # depths [m]
PERSON_ID = 7
# A frame 3 m to the right of the cloud's, turned by half a turn about z.
OTHER_FRAME = 'base_link'
# Joints of a person that faces the camera: x, y [m].
JOINTS = {'neck': (0, -0.5), 'right_shoulder': (-0.16, -0.5), 'left_shoulder': (0.16, -0.5),
          'right_hip': (-0.1, 0), 'left_hip': (0.1, 0), 'right_knee': (-0.1, 0.4), 'left_knee': (0.1, 0.4)}


def is_person() -> np.ndarray:
    """Return which pixels show the person, (H, W) bool."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    x, y = (u - WIDTH / 2) / FOCAL_LENGTH * PERSON, (v - HEIGHT / 2) / FOCAL_LENGTH * PERSON
    return (np.abs(x) < 0.2) & (y > -0.55) & (y < 0.42)


def scene() -> np.ndarray:
    """Return a person before a wall, (H, W, 3) [m]."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    z = np.where(is_person(), PERSON, WALL)
    return np.stack([(u - WIDTH / 2) / FOCAL_LENGTH * z, (v - HEIGHT / 2) / FOCAL_LENGTH * z, z],
                    axis=-1).astype(np.float32)


def people(stamp: rospy.Time, frame_id: str = FRAME_ID) -> PersonDetection_3dArray:
    """Return the person, whose joints lie 5 cm behind the surface, in the cloud's frame or the other one."""
    header = Header(stamp=stamp, frame_id=frame_id)
    message = PersonDetection_3d(header=header, num_people_detected=1, person_ID=PERSON_ID)
    for joint, (x, y) in JOINTS.items():
        if frame_id == OTHER_FRAME:
            x, y = 3 - x, -y
        setattr(message, joint, BodypartDetection_3d(x=x, y=y, z=PERSON + 0.05, confidence=1,
                                                     status=BodypartDetection_3d.MEASURED))
    return PersonDetection_3dArray(header=header, persons=[message])


def points_of(message: PointCloud2, field: str, kind: str) -> np.ndarray:
    """Return the values of a field, (H, W)."""
    offset = next(each.offset for each in message.fields if each.name == field)
    dtype = np.dtype({'names': [field], 'formats': [kind], 'offsets': [offset], 'itemsize': message.point_step})
    return np.frombuffer(message.data, dtype)[field].reshape(message.height, message.width)


class PeopleCloudTest(CloudTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.people = cls.publishers('people', PersonDetection_3dArray)
        cls.transforms = tf2_ros.StaticTransformBroadcaster()
        transform = TransformStamped(header=Header(frame_id=FRAME_ID), child_frame_id=OTHER_FRAME)
        transform.transform.translation.x, transform.transform.rotation.z = 3, 1
        cls.transforms.sendTransform(transform)

    def listen(self, ns, topic):
        """Listen to an output until the end of the test; before, as after it, nothing comes in."""
        await_true(lambda: self.diagnostics.reports(f'{ns}/people_cloud'), f'{ns} is there')
        await_true(lambda: self.clouds[ns].get_num_connections() == self.people[ns].get_num_connections() == 0,
                   f'{ns} has unsubscribed')
        output = Recorder(f'/{ns}/people_cloud/{topic}', PointCloud2)
        self.addCleanup(output.close)
        await_true(lambda: self.clouds[ns].get_num_connections() == self.people[ns].get_num_connections() == 1,
                   f'{ns} subscribes')
        return output

    def send(self, ns, message=None):
        return super().send(ns, message or cloud(scene()))

    def check_labels(self, message, number=PERSON_ID):
        self.assertEqual((message.header.frame_id, message.width, message.height), (FRAME_ID, WIDTH, HEIGHT))
        self.assertEqual([field.name for field in message.fields], ['x', 'y', 'z', 'label'])
        np.testing.assert_array_equal(points_of(message, 'label', '<u4'), np.where(is_person(), number, 0))
        np.testing.assert_array_equal(points_of(message, 'z', '<f4'), scene()[..., 2])

    def test_2_clouds_wait_for_people_in_a_manager(self):
        labelled = self.listen('managed', 'labelled')
        stamps = [self.send('managed') for _ in range(3)]
        self.people['managed'].publish(people(stamps[2]))
        self.check_labels(labelled.wait(1, stamps[2])[0])
        twice = people(self.send('managed'))
        twice.persons.append(PersonDetection_3d(person_ID=PERSON_ID))
        self.people['managed'].publish(twice)  # persons that have one id are numbered
        self.check_labels(labelled.wait(1, self.last)[0], 1)
        self.people['managed'].publish(PersonDetection_3dArray(header=Header(stamp=self.send('managed'),
                                                                             frame_id=FRAME_ID)))
        self.assertFalse(points_of(labelled.wait(1, self.last)[0], 'label', '<u4').any())
        self.assertEqual(len(labelled.messages), 3)
        await_true(lambda: self.diagnostics.value('managed/people_cloud', 'clouds without people') == '2', 'the count')

    def test_3_the_cloud_without_people_alone(self):
        rest = self.listen('alone', 'without_people')
        self.people['alone'].publish(people(self.send('alone')))
        message = rest.wait(1, self.last)[0]
        expected = np.where(is_person()[..., None], np.nan, scene())
        for axis, name in enumerate('xyz'):
            np.testing.assert_array_equal(points_of(message, name, '<f4'), expected[..., axis])
        self.assertEqual((message.header.frame_id, message.is_dense), (FRAME_ID, False))
        await_true(lambda: rest.close() is None and self.clouds['alone'].get_num_connections() == 0, 'it unsubscribes')

    def test_4_people_in_another_frame(self):
        labelled = self.listen('managed', 'labelled')

        def answered():
            self.people['managed'].publish(people(self.send('managed'), OTHER_FRAME))
            return labelled.messages

        self.check_labels(await_true(answered, 'labels')[0])  # the first ones may come before the transform
        before = len(labelled.messages)
        self.people['managed'].publish(people(self.send('managed'), 'nowhere'))
        self.diagnostics.await_event('managed/people_cloud', 'no transform', 1, ['nowhere', FRAME_ID])
        self.assertNotIn(self.last, [message.header.stamp for message in labelled.messages[before:]])

    def test_5_what_can_not_be_used_is_counted(self):
        labelled = self.listen('alone', 'labelled')
        message = cloud(scene())
        message.height, message.width, message.row_step = 1, WIDTH * HEIGHT, 32 * WIDTH * HEIGHT
        self.people['alone'].publish(people(self.send('alone', message)))
        self.diagnostics.await_event('alone/people_cloud', 'bad clouds', 1, ['not organized', f'{WIDTH * HEIGHT} x 1'])
        self.people['alone'].publish(people(self.last - rospy.Duration(1)))
        self.people['alone'].publish(people(self.send('alone')))
        self.check_labels(labelled.wait(1, self.last)[0])
        self.diagnostics.await_event('alone/people_cloud', 'people without cloud', 1)


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_nodelets', 'check_people_cloud', PeopleCloudTest, sys.argv)

#!/usr/bin/python3
"""The extractor gives true positions, and outlives whatever it is sent."""
import sys
import time
import unittest
from typing import List

import numpy as np
import rospy
import rostest
from harness import (
    FRAME_ID,
    HEIGHT,
    OUTPUT,
    WIDTH,
    Camera,
    FakeDetector,
    Output,
    cloud,
    image,
    now,
    person,
    points,
    position,
)
from openpose_ros_msgs.msg import BodypartDetection_3d, PersonDetection, PersonDetectionArray
from sensor_msgs.msg import CameraInfo, Image, PointCloud2

from openpose_ros_pkg.ros.convert import image_to_bgr
from session import Diagnostics, await_true, is_heard

NODE = 'extractor'
# Keypoint [px] and the pixels of the cloud around it: rows, columns.
KEYPOINTS = {'nose': ((20.0, 30.0), slice(29, 32), slice(19, 22)),
             'neck': ((10.4, 20.6), slice(20, 23), slice(9, 12)),
             'right_wrist': ((0.0, 0.0), slice(0, 2), slice(0, 2)),
             'left_wrist': ((63.0, 47.0), slice(46, 48), slice(62, 64)),
             'right_ankle': ((32.0, 0.0), slice(0, 2), slice(31, 34)),
             'left_ankle': ((-0.4, 47.4), slice(46, 48), slice(0, 2))}
HOLE, OUTSIDE = (50.0, 10.0), (64.0, 20.0)


def mean_of_valid(xyz: np.ndarray) -> np.ndarray:
    """Return the mean of those points that are finite and not the origin, one by one."""
    valid = [point for point in xyz.reshape(-1, 3) if np.isfinite(point).all() and point.any()]
    return sum(valid) / len(valid)


class ExtractorTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_extractor')
        cls.detector = FakeDetector('detect_poses_3d')
        cls.output, cls.diagnostics, cls.camera = Output(), Diagnostics(), Camera()

    def setUp(self):
        self.detector.answer = lambda number: [person(number, {'nose': (20, 30)})]

    def good_frame_works(self):
        """Send a good frame and see that its people come, at the right place; return its stamp."""
        stamp = self.camera.send_frame(7)
        array = self.output.frame(stamp)
        self.assertEqual([found.person_ID for found in array.persons], [7])
        np.testing.assert_allclose(position(array.persons[0].nose), mean_of_valid(points(7)[29:32, 19:22]), atol=1e-5)
        return stamp

    def test_nobody_gives_an_empty_frame(self):
        self.detector.answer = lambda number: []
        empty = self.camera.send_frame(1)
        array = self.output.frame(empty)
        self.assertEqual((array.pose_model, array.header.frame_id, array.persons), ('COCO_18', FRAME_ID, []))
        self.setUp()
        good = self.good_frame_works()

        def came():
            return [found.header.stamp for found in list(self.output.persons) if found.header.stamp in (empty, good)]

        self.assertEqual(await_true(came, 'the person of the good frame'), [good])

    def test_joints_are_means_of_the_valid_points_around_their_pixels(self):
        xyz = points(3)
        xyz[30, 20], xyz[29, 19], xyz[31, 21, 2] = np.nan, 0, np.inf
        xyz[1, 1], xyz[0, 0, 0] = 0, -np.inf
        xyz[9:12, 49:52] = np.nan
        joints = {name: pixel for name, (pixel, _, _) in KEYPOINTS.items()}
        joints.update(right_knee=HOLE, left_knee=OUTSIDE)
        self.detector.answer = lambda number: [person(40, joints, 0.75), person(41, {'neck': (10.4, 20.6)}, 0.5)]
        stamp = now()
        self.camera.send(image(3, stamp), cloud(xyz, stamp, 'frame_of_the_cloud'))
        array = self.output.frame(stamp)
        first, second = array.persons
        for name, (_, rows, columns) in KEYPOINTS.items():
            part = getattr(first, name)
            np.testing.assert_allclose(position(part), mean_of_valid(xyz[rows, columns]), atol=1e-5, err_msg=name)
            self.assertEqual((part.status, part.confidence), (BodypartDetection_3d.MEASURED, 0.75), name)
        for name, confidence in (('right_knee', 0.75), ('left_knee', 0.75), ('right_elbow', 0.0), ('chest', 0.0),
                                 ('mid_hip', 0.0)):
            part = getattr(first, name)
            self.assertTrue(np.isnan([part.x, part.y, part.z, part.sigma]).all(), name)
            self.assertEqual((part.status, part.confidence), (BodypartDetection_3d.MISSING, confidence), name)
        np.testing.assert_allclose(position(second.neck), position(first.neck))
        self.assertEqual(array.header.frame_id, 'frame_of_the_cloud')
        for found, number in ((first, 40), (second, 41)):
            self.assertEqual((found.header.stamp, found.header.frame_id), (stamp, 'frame_of_the_cloud'))
            self.assertEqual((found.person_ID, found.num_people_detected), (number, 2))
        one_by_one = await_true(lambda: len([found for found in list(self.output.persons)
                                             if found.header.stamp == stamp]) == 2, 'a message for each person')
        self.assertTrue(one_by_one)
        self.assertEqual({found.person_ID for found in self.output.persons if found.header.stamp == stamp}, {40, 41})

    def test_stamp_and_frame_are_those_of_the_cloud(self):
        stamp = now()
        later = stamp + rospy.Duration(0, 2_000_000)
        message = image(5, stamp)
        message.header.frame_id = 'frame_of_the_image'
        self.camera.send(message, cloud(points(5), later))
        self.assertEqual(self.output.frame(later).header.frame_id, FRAME_ID)

    def test_a_cloud_of_half_the_resolution_is_looked_up_at_half_the_pixel(self):
        half = points(9, WIDTH // 2, HEIGHT // 2)
        stamp = now()
        self.camera.send(image(9, stamp), cloud(half, stamp))
        nose = self.output.frame(stamp).persons[0].nose
        np.testing.assert_allclose(position(nose), mean_of_valid(half[14:17, 9:12]), atol=1e-5)

    def test_a_cloud_without_a_valid_point_has_nobody_in_space(self):
        stamp, before = now(), self.diagnostics.count(NODE, 'no depth')
        self.camera.send(image(9, stamp), cloud(np.full((HEIGHT, WIDTH, 3), np.nan), stamp))
        self.assertEqual(self.output.frame(stamp).persons, [])
        self.diagnostics.await_event(NODE, 'no depth', before + 1, ['0 %'])
        self.good_frame_works()

    def listen(self, topic: str, kind: type) -> List:
        """Return the list that the messages of a topic go to while this test runs."""
        kept = []
        subscriber = rospy.Subscriber(topic, kind, kept.append)
        self.addCleanup(subscriber.unregister)
        await_true(lambda: is_heard(topic), f'a publisher of {topic}')
        return kept

    def test_2d_results_have_the_ids_that_the_people_have_in_space(self):
        arrays = self.listen(f'{OUTPUT}/detected_poses', PersonDetectionArray)
        persons = self.listen(f'{OUTPUT}/detected_poses_keypoints', PersonDetection)
        pixels = {'nose': (20.0, 30.0), 'neck': (10.5, 20.25)}
        self.detector.answer = lambda number: [person(60, pixels), person(61, {'left_wrist': (40.0, 5.0)}, 0.5)]

        def answered():
            stamp = now()
            message = image(3, stamp)
            message.header.frame_id = 'frame_of_the_image'
            self.camera.send(message, cloud(points(3), stamp))
            in_space = self.output.frame(stamp)
            return [(array, in_space) for array in list(arrays) if array.header.stamp == stamp]

        array, in_space = await_true(answered, 'the 2D results of a frame')[0]
        stamp = array.header.stamp
        self.assertEqual((array.pose_model, array.header.frame_id), ('COCO_18', 'frame_of_the_image'))
        self.assertEqual([found.person_ID for found in array.persons], [found.person_ID for found in in_space.persons])
        first, second = array.persons
        for joint, place in pixels.items():
            self.assertEqual((getattr(first, joint).x, getattr(first, joint).y), place)
        self.assertEqual((second.left_wrist.x, second.left_wrist.confidence, second.neck.confidence), (40.0, 0.5, 0.0))
        one_by_one = await_true(lambda: len([found for found in list(persons) if found.header.stamp == stamp]) == 2,
                                'a 2D message for each person')
        self.assertTrue(one_by_one)
        for found, expected in zip([found for found in persons if found.header.stamp == stamp], array.persons):
            for name in found.__slots__[1:]:  # rospy counts headers itself
                self.assertEqual(getattr(found, name), getattr(expected, name), name)

        self.detector.answer = lambda number: []
        stamp = self.camera.send_frame(4)
        empty = await_true(lambda: [array for array in list(arrays) if array.header.stamp == stamp], 'an empty frame')
        self.assertEqual(empty[0].persons, [])

    def test_people_are_drawn_while_somebody_listens(self):
        drawn = self.listen(f'{OUTPUT}/detected_poses_image', Image)

        def one_came():
            self.output.frame(self.camera.send_frame(11))
            return drawn

        message = await_true(one_came, 'an annotated image')[0]
        self.assertTrue(self.output.has(message.header.stamp))
        changed = (image_to_bgr(message) != image_to_bgr(image(11, message.header.stamp))).any(axis=2)
        self.assertTrue(changed[30, 20])
        self.assertLess(changed.mean(), 0.5)

    def test_the_camera_info_of_the_input_stands_beside_the_image(self):
        """Nothing before it is there, since these points are those of no camera."""
        infos = self.listen(f'{OUTPUT}/camera_info', CameraInfo)
        self.output.frame(self.camera.send_frame(12))
        self.output.frame(self.camera.send_frame(12))  # whatever belongs to the first one has been published
        self.assertEqual(infos, [])
        source = rospy.Publisher(f'{NODE}/camera_info', CameraInfo, queue_size=1)
        self.addCleanup(source.unregister)

        def one_came():
            source.publish(CameraInfo(width=WIDTH, height=HEIGHT, K=[50, 0, 31, 0, 51, 23, 0, 0, 1]))
            self.output.frame(self.camera.send_frame(12))
            return infos

        info = await_true(one_came, 'the camera info')[0]
        self.assertEqual((info.K[0], info.K[4], info.header.frame_id), (50.0, 51.0, FRAME_ID))
        self.assertTrue(self.output.has(info.header.stamp))

    def test_synchronised_inputs_are_echoed_while_somebody_listens(self):
        images = self.listen(f'{OUTPUT}/input_rgb', Image)
        clouds = self.listen(f'{OUTPUT}/input_pointcloud', PointCloud2)

        def echoed():
            self.output.frame(self.camera.send_frame(11))
            return images and clouds

        await_true(echoed, 'image and cloud')
        for message, sent in ((images[-1], image(11, images[-1].header.stamp)),
                              (clouds[-1], cloud(points(11), clouds[-1].header.stamp))):
            self.assertEqual((message.data, message.header.frame_id), (sent.data, FRAME_ID))
            self.assertTrue(self.output.has(message.header.stamp))

    def test_messages_without_a_partner_are_counted(self):
        before, stamps = self.diagnostics.count(NODE, 'images without a partner'), []

        def counted():
            # again and again: of two images that come at once the subscriber keeps the newer alone
            stamps.append(now())
            self.camera.images.publish(image(8, stamps[-1]))
            time.sleep(0.5)  # further from the next frame than a pair may be where the frames of the tests come slowly
            self.good_frame_works()
            return self.diagnostics.count(NODE, 'images without a partner') > before

        await_true(counted, 'an image is counted')
        self.assertFalse(any(self.output.has(stamp) for stamp in stamps))


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_extractor', ExtractorTest, sys.argv)

#!/usr/bin/python3
"""Joints in another frame, and tracking in one: never without the transform, right as soon as it is there."""
import sys
import unittest

import numpy as np
import rospy
import rostest
import tf2_ros
from harness import FRAME_ID, Camera, FakeDetector, Output, cloud, image, now, person, points, position
from std_msgs.msg import Header

from session import Diagnostics, await_true
from skeleton_extract_3d.ros.convert import transform_from_matrix

# From the optical frame (x right, y down, z forward) to a room with z up, 1.5 m below the camera [m].
ROOM_FROM_CAMERA = np.array([[0.0, 0.0, 1.0, 2.0], [-1.0, 0.0, 0.0, -3.0], [0.0, -1.0, 0.0, 1.5], [0, 0, 0, 1]])


class TargetFrameTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_target_frame')
        cls.detector = FakeDetector('detect_poses_3d')
        cls.diagnostics = Diagnostics()

    def setUp(self):
        self.detector.answer = lambda number: [person(number, {'nose': (20, 30)})]

    def dropped_frame(self, node, camera, *words):
        """Send a first frame, see that the node drops it and says why; return its stamp."""
        stamp = camera.send_frame(1)
        self.diagnostics.await_event(node, 'no transform', 1, words)
        return stamp

    def frame_comes(self, camera, output, send_transform=lambda stamp: None):
        """Send frames until one comes out, each followed by a transform of its stamp; return the array."""
        stamps = []

        def one_came():
            stamps.append(camera.send_frame(5))
            send_transform(stamps[-1])
            rospy.sleep(0.1)
            return next((stamp for stamp in stamps if output.has(stamp)), None)

        return output.frame(await_true(one_came, 'a frame after the transform'))

    def test_frames_are_dropped_until_the_transform_comes(self):
        detector, diagnostics, output, camera = self.detector, self.diagnostics, Output(), Camera()
        early = self.dropped_frame('extractor', camera, 'room')

        broadcaster = tf2_ros.StaticTransformBroadcaster()
        broadcaster.sendTransform(transform_from_matrix(ROOM_FROM_CAMERA, Header(frame_id='room'), FRAME_ID))
        array = self.frame_comes(camera, output)
        self.assertEqual((array.header.frame_id, array.persons[0].header.frame_id), ('room', 'room'))
        x, y, z = points(5)[29:32, 19:22].reshape(-1, 3).mean(axis=0)
        np.testing.assert_allclose(position(array.persons[0].nose), [z + 2, -x - 3, -y + 1.5], atol=1e-5)
        self.assertFalse(output.has(early))

        # from the target frame itself there is nothing to transform; from an unknown frame there is no way
        stamp = now()
        camera.send(image(6, stamp), cloud(points(6), stamp, '/room'))
        found, = output.frame(stamp).persons
        np.testing.assert_allclose(position(found.nose), points(6)[29:32, 19:22].reshape(-1, 3).mean(axis=0), atol=1e-5)
        dropped, stamp = diagnostics.count('extractor', 'no transform'), now()
        camera.send(image(7, stamp), cloud(points(7), stamp, '/elsewhere'))
        diagnostics.await_event('extractor', 'no transform', dropped + 1, ['elsewhere'])
        self.assertFalse(output.has(stamp))

        # an empty frame says where it is, too
        detector.answer = lambda number: []
        array = output.frame(camera.send_frame(8))
        self.assertEqual((array.header.frame_id, array.persons), ('room', []))

    def test_a_camera_that_moves_is_not_followed_without_its_transform(self):
        output, camera = Output('/moving'), Camera('moving/image', 'moving/points')
        early = self.dropped_frame('moving/extractor', camera, 'odom')
        broadcaster = tf2_ros.TransformBroadcaster()
        # odom below the camera, since the room is above it
        array = self.frame_comes(camera, output, lambda stamp: broadcaster.sendTransform(transform_from_matrix(
            np.linalg.inv(ROOM_FROM_CAMERA), Header(stamp=stamp, frame_id=FRAME_ID), 'odom')))
        # people are followed in odom, and published where they were measured
        self.assertEqual((array.header.frame_id, array.persons[0].header.frame_id), (FRAME_ID, FRAME_ID))
        np.testing.assert_allclose(position(array.persons[0].nose),
                                   points(5)[29:32, 19:22].reshape(-1, 3).mean(axis=0), atol=1e-5)
        self.assertFalse(output.has(early))


if __name__ == '__main__':
    rostest.rosrun('skeleton_extract_3d', 'check_target_frame', TargetFrameTest, sys.argv)

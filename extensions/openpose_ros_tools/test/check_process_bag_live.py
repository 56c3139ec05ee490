#!/usr/bin/python3
"""A recording gives the same people as the running nodes on the same frames, to the last bit."""
import io
import sys
import tempfile
import unittest
from pathlib import Path
from typing import Any

import rosbag
import rospkg
import rospy
import rostest
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Header

sys.path.append(str(Path(__file__).resolve().parents[3] / 'tests/support'))

from openpose_ros_pkg.ros.convert import bgr_to_image
from openpose_ros_tools.ros.process_bag.program import main
from session import Recorder, await_true
from skeleton_extract_3d.points.depth import cloud_from_depth
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence
from skeleton_extract_3d.ros.convert import cloud_to_message

# Of the shipped sequence, so many frames, every second one: the two people come in, and begin to cross.
FRAMES, EVERY = 14, 2
IN_SPACE, IN_IMAGE = '/openpose_ros/skeleton_3d/', '/openpose_ros/'
TOPICS = {f'{IN_SPACE}detected_poses_3d': PersonDetection_3dArray,
          f'{IN_SPACE}detected_poses': PersonDetectionArray,
          f'{IN_IMAGE}detected_poses': PersonDetectionArray}


def frames():
    """Yield image and cloud of each frame."""
    sequence = RgbdSequence.read(Path(rospkg.RosPack().get_path('skeleton_extract_3d')) / 'demo' / 'cross')
    rays = sequence.camera.ray_grid()
    for number in range(FRAMES):
        frame = sequence.frame(number * EVERY)
        header = Header(stamp=rospy.Time.from_sec(1000 + number / 10), frame_id='camera')
        cloud = cloud_from_depth(frame.depth * 0.001, sequence.camera, frame.bgr, rays)
        yield bgr_to_image(frame.bgr, header), cloud_to_message(cloud, header)


def content(array: Any) -> bytes:
    """Return the message as it is sent, but for the counters of headers, which publishers set."""
    for header in [array.header, *(person.header for person in array.persons)]:
        header.seq = 0
    buffer = io.BytesIO()
    array.serialize(buffer)
    return buffer.getvalue()


class ProcessBagLiveTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_process_bag_live')
        recorders = {topic: Recorder(topic, kind) for topic, kind in TOPICS.items()}
        cls.live = {topic: recorder.messages for topic, recorder in recorders.items()}
        images = rospy.Publisher('image', Image, queue_size=1)
        points = rospy.Publisher('points', PointCloud2, queue_size=1)
        await_true(lambda: points.get_num_connections() and images.get_num_connections() == 2, 'listeners')
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.recording = Path(cls.folder.name) / 'walk.bag'
        with rosbag.Bag(str(cls.recording), 'w') as bag:
            for number, (image, cloud) in enumerate(frames(), start=1):
                bag.write('/image', image, image.header.stamp)
                bag.write('/points', cloud, cloud.header.stamp)
                images.publish(image)
                points.publish(cloud)
                # one frame at a time, so that the nodes drop none
                for recorder in recorders.values():
                    recorder.wait(number)

    def process(self, *arguments: str) -> Path:
        output = Path(self.folder.name) / f'out{len(arguments)}.bag'
        self.assertEqual(main([str(self.recording), '-o', str(output), '--set', 'mode=fast', *arguments]), 0)
        return output

    def assert_same(self, output: Path, topic: str) -> None:
        with rosbag.Bag(str(output)) as bag:
            found = [TOPICS[topic]().deserialize(message[1])
                     for _, message, _ in bag.read_messages(topics=[topic], raw=True)]
        self.assertEqual(len(found), FRAMES)
        self.assertGreater(sum(len(array.persons) for array in found), FRAMES)
        for number, (actual, live) in enumerate(zip(found, self.live[topic])):
            self.assertEqual(content(actual), content(live), f'frame {number} of {topic}')

    def test_people_in_space_are_the_same(self):
        output = self.process()
        self.assert_same(output, f'{IN_SPACE}detected_poses_3d')
        self.assert_same(output, f'{IN_SPACE}detected_poses')

    def test_people_in_images_are_the_same(self):
        self.assert_same(self.process('--only-2d'), f'{IN_IMAGE}detected_poses')


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_tools', 'check_process_bag_live', ProcessBagLiveTest, sys.argv)

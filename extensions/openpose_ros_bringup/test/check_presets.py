#!/usr/bin/python3
"""From `people.launch camera:=NAME` to people, for each camera, with a stand-in for its driver; auto; a recording."""
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from typing import Any, List

import numpy as np
import rosbag
import rospy
import rostest
from camera_stand_in import StandIn, number_of
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray

sys.path.append(str(Path(__file__).resolve().parents[3] / 'tests/support'))
from openpose_ros_pkg.params.camera_presets import CameraPreset, find_preset
from openpose_ros_pkg.skeletons import COCO_18
from session import ENDS_WITH_PARENT, await_true

# Greatest median distance of the joints from the truth, in space [m] and in the image [px]: a wrong unit, matrix or
# size is wrong by a fifth of 2 m, or of the image, and more.
MOST = {3: 0.12, 2: 8.0}
# Results that are judged of each camera.
RESULTS = 3
PEOPLE = ('roslaunch', 'openpose_ros_bringup', 'people.launch', 'mode:=fast', 'signals:=false')
NAMES = ('kinect2', 'zed', 'usb_cam')  # a cloud; rectified images and depth in metres; images alone
OWN_CAMERA = """
lab: {ns: lab, image: colour, depth: depth, camera_info: info, points_source: depth_image, frame: lab_optical_frame,
      image_transport: compressed, depth_transport: compressedDepth, image_encoding: bgr8, size: [640, 360]}
"""


class PresetsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        rospy.init_node('check_presets')
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)

    def start(self, *command: str) -> 'subprocess.Popen[bytes]':
        process = subprocess.Popen([*ENDS_WITH_PARENT, *command], start_new_session=True)
        self.addCleanup(process.wait, 30)
        self.addCleanup(process.send_signal, signal.SIGINT)
        return process

    def stand_in(self, preset: CameraPreset) -> StandIn:
        stand_in = StandIn(preset)
        stand_in.start()
        self.addCleanup(stand_in.stop)
        return stand_in

    def check(self, preset: CameraPreset, stand_in: StandIn, *arguments: str) -> None:
        """Results are in the frame of the camera, and where the people truly are."""
        topic, kind = {3: ('skeleton_3d/detected_poses_3d', PersonDetection_3dArray),
                       2: ('detected_poses', PersonDetectionArray)}[preset.dimensions]
        ns, results = f'of_{preset.name}', []
        subscriber = rospy.Subscriber(f'/{ns}/openpose_ros/{topic}', kind, results.append)
        self.addCleanup(subscriber.unregister)
        self.start(*PEOPLE, f'ns:=/{ns}', *arguments)
        await_true(lambda: sum(bool(result.persons) for result in list(results)) >= RESULTS, f'people of {preset.name}')
        found = [result for result in list(results) if result.persons][:RESULTS]
        self.assertEqual({result.header.frame_id for result in found}, {preset.frame})
        errors = [error for result in found for error in errors_of(result, stand_in)]
        self.assertLess(np.median(errors), MOST[preset.dimensions], preset.name)

    def test_cameras(self) -> None:
        for name in NAMES:
            with self.subTest(name):
                preset = find_preset(name)
                self.check(preset, self.stand_in(preset), f'camera:={name}')
                self.doCleanups()

    def test_a_driver_that_is_not_installed(self) -> None:
        done = subprocess.run(['rosrun', 'openpose_ros_bringup', 'camera_driver', '--camera', 'kinect2'], text=True,
                              stderr=subprocess.PIPE, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn('start the driver: roslaunch kinect2_bridge kinect2_bridge.launch publish_tf:=true', done.stderr)

    def test_recording_has_what_process_bag_needs(self) -> None:
        preset, bag = find_preset('azure_kinect'), self.folder / 'azure.bag'
        stand_in = self.stand_in(preset)
        recorder = self.start('rosrun', 'openpose_ros_bringup', 'record_camera', '-O', str(bag))
        await_true(lambda: stand_in.listeners == 3, 'the recorder')
        first = stand_in.sent
        await_true(lambda: stand_in.sent > first + 5, 'some frames')
        recorder.send_signal(signal.SIGINT)
        recorder.wait(30)
        with rosbag.Bag(str(bag)) as recorded:
            counts = {topic: recorded.get_message_count(topic) for topic in preset.inputs()}
        self.assertGreaterEqual(min(counts.values()), 5, counts)

    def test_file_of_a_camera_with_compressed_images(self) -> None:
        file = self.folder / 'lab.yaml'
        file.write_text(OWN_CAMERA)
        preset = find_preset(str(file))
        self.check(preset, self.stand_in(preset), f'camera:={file}')


def errors_of(result: Any, stand_in: StandIn) -> List[float]:
    """Return for each person in view the median distance of the joints from those of the nearest true one."""
    in_space = hasattr(result.persons[0].nose, 'z')
    truth = (stand_in.xyz if in_space else stand_in.uv)[number_of(result.header.stamp)]
    errors = []
    for person in result.persons:
        parts = [getattr(person, joint) for joint in COCO_18.joints]
        places = np.array([(part.x, part.y, part.z) if in_space else (part.x, part.y) for part in parts])
        places[[part.confidence == 0 for part in parts]] = np.nan
        distances = [np.linalg.norm(places - true, axis=1) for true in truth]
        medians = [float(np.nanmedian(each)) for each in distances if np.isfinite(each).any()]
        errors += [min(medians)] if medians else []
    return errors


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_bringup', 'check_presets', PresetsTest, sys.argv)

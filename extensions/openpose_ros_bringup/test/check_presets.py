#!/usr/bin/python3
"""From `people.launch camera:=NAME` to people, for each camera, with a stand-in for its driver; the driver; auto."""
import os
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from typing import Any, List, Optional, Sequence

import numpy as np
import rosbag
import rosgraph
import roslib.packages
import rospy
import rostest
from camera_stand_in import StandIn, number_of
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Image

sys.path.append(str(Path(__file__).resolve().parents[3] / 'tests/support'))
from openpose_ros_pkg.params.camera_presets import CameraPreset, find_preset, read_presets
from openpose_ros_pkg.skeletons import COCO_18
from session import ENDS_WITH_PARENT, PATIENCE, await_true

# Greatest median distance of the joints from the truth, in space [m] and in the image [px]: a wrong unit, matrix or
# size is wrong by a fifth of 2 m, or of the image, and more.
MOST = {3: 0.12, 2: 8.0}
# Results that are judged of each camera.
RESULTS = 3
PEOPLE = ('roslaunch', 'openpose_ros_bringup', 'people.launch')
DRIVER, RECORDER = ('openpose_ros_bringup', 'camera_driver'), ('openpose_ros_bringup', 'record_camera')
FAST = ('mode:=fast', 'signals:=false')
OWN_CAMERA = """
lab: {ns: lab, image: colour, depth: depth, camera_info: info, points_source: depth_image, frame: lab_optical_frame,
      image_transport: compressed, depth_transport: compressedDepth, image_encoding: bgr8, size: [640, 360]}
"""
FAKE_DRIVER = {'package.xml': """<package format="2">
  <name>realsense2_camera</name><version>0.0.0</version><description>A stand-in.</description>
  <maintainer email="tests@example.org">tests</maintainer><license>Apache-2.0</license>
</package>
""", 'rs_camera.launch': """<launch>
  <arg name="align_depth" default="false"/>
  <arg name="enable_sync" default="false"/>
  <node pkg="openpose_ros_bringup" type="camera_stand_in.py" name="camera"
        args="realsense $(arg align_depth) $(arg enable_sync)"/>
</launch>
"""}


class Launch:
    """A command for a camera, with its results in a namespace of their own.

    Attributes:
        results: those with people.
    """

    def __init__(self, ns: str, *arguments: str, dimensions: int = 3, packages: Optional[Path] = None,
                 command: Sequence[str] = PEOPLE) -> None:
        self.results: List[Any] = []
        topic, kind = {3: ('skeleton_3d/detected_poses_3d', PersonDetection_3dArray),
                       2: ('detected_poses', PersonDetectionArray)}[dimensions]
        self._subscriber = rospy.Subscriber(f'/{ns}/openpose_ros/{topic}', kind, self._keep)
        environment = dict(os.environ)
        if packages is not None:
            environment['ROS_PACKAGE_PATH'] = f"{packages}:{environment['ROS_PACKAGE_PATH']}"
        self._process = subprocess.Popen(
            [*ENDS_WITH_PARENT, *command, *arguments], env=environment, start_new_session=True)

    def _keep(self, message: Any) -> None:
        if message.persons:
            self.results.append(message)

    def stop(self) -> None:
        """Let it end; the next one need not wait, as names differ."""
        self._subscriber.unregister()
        self._process.send_signal(signal.SIGINT)

    def wait(self) -> None:
        """Wait for its end."""
        self._process.wait(30)


class PresetsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        rospy.init_node('check_presets')
        cls.launches: List[Launch] = []
        cls.log: List[str] = []
        cls.subscriber = rospy.Subscriber('/rosout', Log, lambda message: cls.log.append(message.msg))
        cls.folder = tempfile.TemporaryDirectory()

    @classmethod
    def tearDownClass(cls) -> None:
        for launch in cls.launches:
            launch.wait()
        cls.folder.cleanup()

    def launch(self, ns: str, *arguments: str, **keywords: Any) -> Launch:
        """Start people.launch for a camera."""
        return self.keep(Launch(ns, f'ns:=/{ns}', *FAST, *arguments, **keywords))

    def keep(self, launch: Launch) -> Launch:
        self.launches.append(launch)
        self.addCleanup(launch.stop)
        return launch

    def stand_in(self, preset: CameraPreset, ns: Optional[str] = None) -> StandIn:
        stand_in = StandIn(preset)
        stand_in.start(ns)
        self.addCleanup(stand_in.stop)
        return stand_in

    def await_log(self, words: str) -> None:
        await_true(lambda: any(words in line for line in list(self.log)), f'the message {words!r}')

    def judge(self, launch: Launch, preset: CameraPreset, stand_in: StandIn) -> None:
        """Wait for results: they are in the frame of the camera, and where the people truly are."""
        await_true(lambda: len(launch.results) >= RESULTS, f'people of {preset.name}')
        self.assertEqual({result.header.frame_id for result in launch.results}, {preset.frame})
        errors = [error for result in launch.results[:RESULTS] for error in errors_of(result, stand_in)]
        rospy.loginfo('%s: median error %.3g', preset.name, np.median(errors))
        self.assertLess(np.median(errors), MOST[preset.dimensions], preset.name)

    def check(self, name: str, *arguments: str) -> None:
        preset = find_preset(name)
        stand_in = self.stand_in(preset)
        self.judge(self.launch(preset.name, f'camera:={name}', *arguments, dimensions=preset.dimensions), preset,
                   stand_in)

    def test_azure_kinect(self) -> None:
        self.check('azure_kinect')

    def test_oakd(self) -> None:
        self.check('oakd')

    def test_zed(self) -> None:
        self.check('zed')

    def test_orbbec(self) -> None:
        self.check('orbbec')

    def test_xtion(self) -> None:
        self.check('xtion')

    def test_usb_cam(self) -> None:
        self.check('usb_cam')

    def test_kinect2_whose_driver_is_not_installed(self) -> None:
        self.check('kinect2', 'driver:=true')
        self.await_log('start the driver: roslaunch kinect2_bridge kinect2_bridge.launch publish_tf:=true')

    def test_realsense_with_its_driver(self) -> None:
        folder = Path(self.folder.name) / 'packages/realsense2_camera'
        folder.mkdir(parents=True)
        for name, text in FAKE_DRIVER.items():
            (folder / name).write_text(text)
        preset = find_preset('realsense')
        self.judge(self.launch('realsense', 'camera:=realsense', 'driver:=true', packages=folder.parent), preset,
                   StandIn(preset))
        self.assertTrue(rosgraph.Master(rospy.get_name()).lookupNode('/camera'), 'in the root')

    def test_webcam_whose_driver_is_not_installed(self) -> None:
        """A node of this project takes the driver's place."""
        images = f'{roslib.packages.get_pkg_dir("skeleton_extract_3d")}/demo/cross/rgb'
        self.keep(Launch('webcam', '--camera', 'usb_cam', '--source', images, command=('rosrun', *DRIVER)))
        message = rospy.wait_for_message('/usb_cam/image_raw', Image, PATIENCE)
        self.assertEqual(message.header.frame_id, find_preset('usb_cam').frame)

    def test_recording_has_what_process_bag_needs(self) -> None:
        preset, bag = find_preset('azure_kinect'), Path(self.folder.name) / 'azure.bag'
        stand_in = self.stand_in(preset)
        recorder = self.keep(Launch('recorder', '-O', str(bag), command=('rosrun', *RECORDER)))
        await_true(lambda: stand_in.listeners == 3, 'the recorder')
        first = stand_in.sent
        await_true(lambda: stand_in.sent > first + 5, 'some frames')
        recorder.stop()
        recorder.wait()
        with rosbag.Bag(str(bag)) as recorded:
            counts = {topic: recorded.get_message_count(topic) for topic in preset.inputs()}
        self.assertGreaterEqual(min(counts.values()), 5, counts)

    def test_file_of_a_camera_with_compressed_images(self) -> None:
        file = Path(self.folder.name) / 'lab.yaml'
        file.write_text(OWN_CAMERA)
        self.check(str(file))

    def test_auto_waits_for_a_camera(self) -> None:
        launch = self.launch('awaited', 'camera:=auto')
        self.await_log('camera:=auto waits for a camera')
        preset = find_preset('orbbec')
        self.judge(launch, preset, self.stand_in(preset))

    def test_auto_takes_one_of_two_and_names_the_other(self) -> None:
        for name in ('oakd', 'realsense'):
            self.stand_in(find_preset(name))
        self.launch('both', 'camera:=auto')
        self.await_log('takes realsense (/camera/color/image_raw); there is also: oakd (/oak/rgb/image_rect)')

    def test_two_cameras_of_a_kind_in_one_process(self) -> None:
        preset = find_preset('orbbec')
        stand_ins = [self.stand_in(preset, ns) for ns in ('left', 'right')]
        left = self.keep(Launch('left', 'camera:=orbbec', 'cameras:=left right', 'mode:=fast',
                                command=('roslaunch', 'skeleton_extract_3d', 'openpose_skeleton_extract.launch')))
        right: List[Any] = []
        subscriber = rospy.Subscriber('/right/openpose_ros/skeleton_3d/detected_poses_3d', PersonDetection_3dArray,
                                      right.append)
        self.addCleanup(subscriber.unregister)
        self.judge(left, preset, stand_ins[0])
        await_true(lambda: any(message.persons for message in right), 'people of the other camera')

    def test_each_camera_of_the_table_has_a_test(self) -> None:
        tests = [name for name in dir(self) if name.startswith('test_')]
        self.assertEqual([name for name, preset in read_presets().items()
                          if preset.package and not any(name in test for test in tests)], [])


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

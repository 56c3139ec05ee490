"""Open RViz on the people of a chain, or on those that are fused from several cameras.

Waits for the first message with their frame. A fixed frame that tf does not connect with
the people is replaced by theirs. RViz has z upwards: in place of an optical frame FRAME it gets FRAME_upright, a static
transform that turns z forward, as the camera sees it, into x forward and z up. The node ends with RViz.
"""
import signal
import subprocess
import tempfile
import threading
import time
from functools import partial
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional

import numpy as np
import rospkg
import rospy
import tf2_ros
import yaml
from openpose_ros_msgs.msg import FusedCameraArray, PersonDetection_3dArray
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from openpose_ros_bringup.node_params import ViewParams
from openpose_ros_bringup.view import Topics, rviz_configuration
from openpose_ros_pkg.errors import BadInputError, NoTransformError
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.input_watch import InputWatch
from openpose_ros_pkg.ros.node import run_node
from skeleton_extract_3d.points.transform import IDENTITY, LEVEL, TURNED, UPRIGHT, Transform
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.transforms import Transforms

SPACE, IMAGE = 'openpose_ros/skeleton_3d', 'openpose_ros'
WORLD = 'world'
# How long to wait for the clouds' frame, and for tf, once the frame of the people is known [s].
_PATIENCE = 5.0
_LOOK_PERIOD = 0.1
# Exit statuses of an RViz that was closed.
_ENDED = (0, -signal.SIGINT, -signal.SIGTERM)
# In the names of optical frames (REP 103).
_OPTICAL = 'optical'


class ViewNode:
    """Opens RViz in a thread of its own; `failed`: whether it could not be opened."""

    def __init__(self, params: ViewParams) -> None:
        self._params = params
        self.failed = False
        self._rviz: Optional[subprocess.Popen] = None
        self._folder = tempfile.TemporaryDirectory(prefix='openpose_ros_view_')
        rospy.on_shutdown(self._close)
        threading.Thread(target=self._run, name='view', daemon=True).start()

    def _run(self) -> None:
        try:
            arguments = self._arguments()
            if not rospy.is_shutdown():
                self._rviz = subprocess.Popen(['rosrun', 'rviz', 'rviz', *arguments])
                status = self._rviz.wait()
                self.failed = status not in _ENDED and not rospy.is_shutdown()
                if self.failed:
                    rospy.logfatal('RViz ended with status %d; is there a screen ($DISPLAY)?', status)
        except Exception as error:
            self.failed = True
            rospy.logfatal('RViz is not opened: %r', error)
        rospy.signal_shutdown('RViz has ended')

    def _close(self) -> None:
        if self._rviz is not None and self._rviz.poll() is None:
            self._rviz.terminate()
            self._rviz.wait()
        self._folder.cleanup()

    def _arguments(self) -> List[str]:
        template = Path(rospkg.RosPack().get_path('openpose_ros_bringup')) / 'rviz' / 'people.rviz'
        values = self._configuration(yaml.safe_load(template.read_text()))
        path = Path(self._folder.name) / 'people.rviz'
        path.write_text(yaml.safe_dump(values))
        return ['-d', str(path)]

    def _configuration(self, template: Any) -> Any:
        if self._params.dimensions == 2:
            image = rospy.resolve_name(f'{IMAGE}/detected_poses_image')
            return rviz_configuration(template, self._params.fixed_frame or WORLD, Topics('', {}, {'Image': image}),
                                      [LEVEL])
        self._scene = _Scene(self._params)  # its static transform lives as long as this node
        return rviz_configuration(template, self._scene.frame, self._topics(), self._scene.cameras)

    def _topics(self) -> Topics:
        space = rospy.resolve_name(SPACE)
        cameras, others = self._params.cameras.split(), self._params.rgb_cameras.split()
        if not cameras and not others:
            return Topics(space, {'Cloud': f'{space}/input_pointcloud'}, {'Image': f'{space}/detected_poses_image'})
        images = {f'Image of {name}': f"/{name.strip('/')}/{folder}/detected_poses_image"
                  for folder, names in ((SPACE, cameras), (IMAGE, others)) for name in names}
        return Topics(space, {f'Cloud of {name}': f"/{name.strip('/')}/{SPACE}/input_pointcloud" for name in cameras},
                      images)


class _Scene:
    """Where cameras are: `frame` with z upwards, and `cameras`, poses of their optical frames in it, one at least."""

    def __init__(self, params: ViewParams) -> None:
        self._transforms = Transforms(0.0)
        fused = bool(params.cameras or params.rgb_cameras)
        newest: Dict[str, Any] = {}
        people = InputSubscriber(f'{SPACE}/detected_poses_3d', PersonDetection_3dArray)
        cameras = (InputSubscriber('cameras', FusedCameraArray) if fused else
                   InputSubscriber(f'{SPACE}/input_pointcloud', PointCloud2))
        for name, each in (('people', people), ('cameras', cameras)):
            each.registerCallback(partial(newest.__setitem__, name))
            each.subscribe()
        health = Health()
        health.explain_rest(lambda: '' if people.subscribed else 'RViz is open')
        InputWatch(health).start([people])
        _await(lambda: 'people' in newest, float('inf'))
        _await(lambda: 'cameras' in newest, _PATIENCE)
        people.unsubscribe()
        cameras.unsubscribe()
        own = newest['people'].header.frame_id
        frame = params.fixed_frame or (WORLD if params.floor else own)
        if not _await(lambda: self._pose(frame, own) is not None, _PATIENCE):
            rospy.logwarn("tf does not connect '%s' with '%s', the frame of the people, which is shown in its place",
                          frame, own)
            frame = own
        seen = newest.get('cameras')
        sources = [] if seen is None else seen.cameras if fused else [seen.header]
        optical = [each.frame_id for each in sources if each.frame_id] or [own]  # some cameras may have sent nothing
        poses = [self._pose(frame, each) for each in optical]
        turned = _OPTICAL in frame or (not fused and frame in optical)
        turn = UPRIGHT.T if turned else np.eye(3)
        self.frame = frame + TURNED if turned else frame
        if turned:
            self._broadcaster = tf2_ros.StaticTransformBroadcaster()
            self._broadcaster.sendTransform(convert.upright_transform(Header(frame_id=frame)))
        self.cameras: List[Transform] = [(turn @ pose[0], turn @ pose[1]) for pose in poses if pose is not None]
        self.cameras = self.cameras or [LEVEL]
        self._transforms.stop()

    def _pose(self, frame: str, of: str) -> Optional[Transform]:
        """Return the newest transform from a frame to another; None: tf does not connect them."""
        if frame == of:
            return IDENTITY
        try:
            return convert.rotation_and_translation(self._transforms.newest(frame, of))
        except (NoTransformError, BadInputError):
            return None


def _await(condition: Callable[[], bool], seconds: float) -> bool:
    """Wait for a condition, in wall time; return whether it holds. Ends the thread at shutdown."""
    deadline = time.monotonic() + seconds
    while not condition():
        if rospy.is_shutdown():
            raise SystemExit
        if time.monotonic() >= deadline:
            return False
        time.sleep(_LOOK_PERIOD)
    return True


def main() -> int:
    """Run the node."""
    return run_node('view', ViewParams, ViewNode, lambda node: node.failed)

"""The people that one camera sends, as sightings in the fixed frame."""
import threading
import time
from collections import deque
from typing import Any, Callable, Deque, Optional, Tuple

import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from sensor_msgs.msg import CameraInfo

from openpose_ros_fusion.node_params import FusionParams
from openpose_ros_fusion.observations import Sighting
from openpose_ros_fusion.rig import Rig
from openpose_ros_fusion.ros.convert import sighting_from_message
from openpose_ros_pkg.errors import BadInputError, NoStampError, NoTransformError
from openpose_ros_pkg.ros.images import InputSubscriber
from skeleton_extract_3d.points.transform import Transform
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.transforms import Transforms

# Topics in the namespace of a camera: people in space; of a camera without depth in the image, and its calibration.
PEOPLE, KEYPOINTS, CAMERA_INFO = ('openpose_ros/skeleton_3d/detected_poses_3d', 'openpose_ros/detected_poses',
                                  'openpose_ros/camera_info')
# Time over which the rate is measured [s].
_RATE_SECONDS = 2.0


class CameraInput:
    """Subscribes to the people of a camera, and turns its newest message into a sighting.

    Args:
        name: namespace of the camera.
        rig: where it stands; None: tf says so.
        arrived: called when people came.

    Attributes:
        inputs: subscribers.
        stamp, frame_id, people: of the people that were taken last: stamp by the camera's clock, frame, number.
        replaced: messages that were replaced by newer ones before they were taken.
        clock_offset: is added to the stamps [s].
        has_transform: whether tf knew where the camera stood when its newest people came.
    """

    def __init__(self, name: str, params: FusionParams, rig: Optional[Rig], arrived: Callable[[], None],
                 tf_timeout: float = 0.05) -> None:
        self.name, self.has_depth, self._params, self._arrived = name, name in params.cameras.split(), params, arrived
        self._placed = None if rig is None else rig.camera(name)
        self._transforms = Transforms(tf_timeout) if rig is None else None
        self.clock_offset = 0.0 if self._placed is None else self._placed.clock_offset
        root = f"/{name.strip('/')}/"
        self.inputs: Tuple[InputSubscriber, ...]
        if self.has_depth:
            self.inputs = InputSubscriber(root + PEOPLE, PersonDetection_3dArray),
        else:
            self.inputs = (InputSubscriber(root + KEYPOINTS, PersonDetectionArray),
                           InputSubscriber(root + CAMERA_INFO, CameraInfo))
            self.inputs[1].registerCallback(self._store_info)
        self.inputs[0].registerCallback(self._store)
        self._info: Optional[CameraInfo] = None
        self._lock = threading.Lock()
        self._newest: Optional[Tuple[Any, float]] = None
        self._arrivals: Deque[float] = deque([-float('inf')], maxlen=200)
        self.stamp, self.frame_id, self.people, self.replaced = rospy.Time(), '', 0, 0
        self.has_transform = True

    @property
    def waits(self) -> bool:
        """Whether there is a message to take."""
        return self._newest is not None

    @property
    def rate(self) -> float:
        """Messages per second lately [Hz]."""
        now = time.monotonic()
        return sum(now - arrival <= _RATE_SECONDS for arrival in list(self._arrivals)) / _RATE_SECONDS

    @property
    def arrival(self) -> float:
        """Time at which the newest message came, time.monotonic() [s]; -inf before the first."""
        return self._arrivals[-1]

    def take(self) -> Optional[Tuple[Sighting, float]]:
        """Return the people of the newest message, once, and when it came, time.monotonic() [s]; None: there is none.

        Raises:
            BadInputError: it can not be used.
            NoStampError: it has no stamp.
            NoTransformError: tf does not know where the camera stood.
        """
        with self._lock:
            newest, self._newest = self._newest, None
        if newest is None:
            return None
        message, arrival = newest
        self.stamp, self.frame_id, self.people = message.header.stamp, message.header.frame_id, len(message.persons)
        if self.stamp.is_zero():
            raise NoStampError(f'people on {self.inputs[0].resolved_name} have no stamp and can not be fused: the '
                               'driver has to fill header.stamp')
        if not self.has_depth and self._info is None:
            raise BadInputError(f'no camera info yet on {self.inputs[1].resolved_name}')
        model = None if self.has_depth else convert.camera_from_message(self._info, self._params.rectified)
        stamp = self.stamp.to_sec() + self.clock_offset
        return sighting_from_message(self.name, stamp, message, self._pose(), model), arrival

    def _pose(self) -> Transform:
        """Return the transform to the fixed frame at the stamp of the people."""
        if self._transforms is None:
            return self._placed.pose
        frames = self._params.fixed_frame, self.frame_id, self.stamp
        # wait for a transform that is late, but not for one that never comes: that would hold up the other cameras
        may_come = self.has_transform or self._transforms.may_come(*frames)
        try:
            transform = self._transforms.lookup(*frames, timeout=None if may_come else 0.0)
        except NoTransformError:
            self.has_transform = False
            raise
        self.has_transform = True
        return convert.rotation_and_translation(transform)

    def _store(self, message: Any) -> None:
        now = time.monotonic()
        with self._lock:
            self.replaced += self._newest is not None
            self._newest = message, now
        self._arrivals.append(now)
        self._arrived()

    def _store_info(self, message: CameraInfo) -> None:
        self._info = message

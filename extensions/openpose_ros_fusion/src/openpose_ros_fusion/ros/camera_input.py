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

# Time over which the rate is measured [s].
_RATE_SECONDS = 2.0
# Messages that may wait for an update, with some to spare.
_STAMPS = 8


class CameraInput:
    """Subscribes to the people of a camera, and turns its newest message into a sighting.

    Args:
        name: namespace of the camera.
        has_depth: whether it sends people in space; false: people in its image, and its calibration.
        params: topics and frame.
        rig: where it stands; None: tf says so.
        arrived: called when people came.

    Attributes:
        inputs: what it reads.
        stamp: of the newest people, by the camera's clock.
        frame_id: of the newest people.
        people: how many these are.
        taken: time at which the message that was taken last came, time.monotonic() [s].
        replaced: messages that were replaced by newer ones before they were taken.
        clock_offset: is added to the stamps [s].
        has_transform: whether tf knew where the camera stood when its newest people came.
    """

    def __init__(self, name: str, has_depth: bool, params: FusionParams, rig: Optional[Rig],
                 arrived: Callable[[], None]) -> None:
        self.name, self.has_depth = name, has_depth
        self._fixed_frame, self._rectified, self._tf_timeout = params.fixed_frame, params.rectified, params.tf_timeout
        self._transforms: Optional[Transforms] = None
        self.clock_offset = 0.0
        if rig is None:
            self._transforms = Transforms(params.tf_timeout)
        else:
            self._rig_pose, self.clock_offset = rig.camera(name).pose, rig.camera(name).clock_offset
        self._arrived = arrived
        root = f"/{name.strip('/')}/"
        if has_depth:
            self.inputs: Tuple[InputSubscriber, ...] = (
                InputSubscriber(root + params.people_topic, PersonDetection_3dArray),)
        else:
            self.inputs = (InputSubscriber(root + params.keypoints_topic, PersonDetectionArray),
                           InputSubscriber(root + params.camera_info_topic, CameraInfo))
            self.inputs[1].registerCallback(self._store_info)
        self.inputs[0].registerCallback(self._store)
        self._info: Optional[CameraInfo] = None
        self._lock = threading.Lock()
        self._newest: Optional[Tuple[float, Any]] = None
        self._arrivals: Deque[float] = deque([-float('inf')], maxlen=200)
        self.stamp, self.frame_id, self.people, self.replaced = rospy.Time(), '', 0, 0
        self.taken = -float('inf')
        self._stamps: Deque[Tuple[float, rospy.Time]] = deque(maxlen=_STAMPS)
        self.has_transform = True

    def reconfigure(self, params: FusionParams) -> None:
        """Take other parameters from the next message on."""
        self._tf_timeout = params.tf_timeout

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

    def exact(self, stamp: float) -> rospy.Time:
        """Return the stamp of a sighting as a time: exactly that of its message, where no clock is corrected."""
        exact = dict(self._stamps).get(stamp)
        return rospy.Time.from_sec(stamp) if exact is None or self.clock_offset else exact

    def take(self) -> Optional[Sighting]:
        """Return what the newest message tells, once; None: there is none.

        Raises:
            BadInputError: it can not be used.
            NoStampError: it has no stamp.
            NoTransformError: tf does not know where the camera stood.
        """
        with self._lock:
            newest, self._newest = self._newest, None
        if newest is None:
            return None
        self.taken, message = newest
        self.stamp, self.frame_id, self.people = message.header.stamp, message.header.frame_id, len(message.persons)
        if self.stamp.is_zero():
            raise NoStampError(f'people on {self.inputs[0].resolved_name} have no stamp and can not be fused: the '
                               'driver has to fill header.stamp')
        stamp = self.stamp.to_sec() + self.clock_offset
        self._stamps.append((stamp, message.header.stamp))
        if not self.has_depth and self._info is None:
            raise BadInputError(f'no camera info yet on {self.inputs[1].resolved_name}')
        model = None if self.has_depth else convert.camera_from_message(self._info, self._rectified)
        return sighting_from_message(self.name, stamp, message, self._pose(message.header.stamp), model)

    def _pose(self, stamp: rospy.Time) -> Transform:
        if self._transforms is None:
            return self._rig_pose
        try:
            # wait for a transform that is late, but not for one that never comes: that would hold up the other cameras
            waits = self.has_transform or self._transforms.may_come(self._fixed_frame, self.frame_id, stamp)
            transform = self._transforms.lookup(self._fixed_frame, self.frame_id, stamp,
                                                self._tf_timeout if waits else 0.0)
        except NoTransformError:
            self.has_transform = False
            raise
        self.has_transform = True
        return convert.rotation_and_translation(transform)

    def _store(self, message: Any) -> None:
        now = time.monotonic()
        with self._lock:
            self.replaced += self._newest is not None
            self._newest = now, message
        self._arrivals.append(now)
        self._arrived()

    def _store_info(self, message: CameraInfo) -> None:
        self._info = message

"""How near people are to links of a robot: the least distance, and a bound below it that holds with a probability.

Published at a fixed rate, also while no people come, or no transforms: the bound goes to 0 then. An estimate for
planners.
"""
import threading
import time
from dataclasses import replace
from typing import List, Optional, Tuple

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonSeparation
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from openpose_ros_bridges.guard import View
from openpose_ros_bridges.moving_parts import Links, spheres_of
from openpose_ros_bridges.node_params import SeparationParams
from openpose_ros_bridges.robot_links import read_links
from openpose_ros_bridges.ros.bridge import IN_SPACE, PEOPLE
from openpose_ros_bridges.separation import CONSTANTS, Separation, SeparationEstimator, unknown
from openpose_ros_pkg.errors import NoStampError, NoTransformError, ParameterError
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.ros.people_publisher import RESULTS_QUEUE
from openpose_ros_pkg.ros.threads import repeat
from openpose_ros_pkg.stream.frame_loop import NewestWinsWorker
from openpose_ros_pkg.stream.pairing import PAIRING
from skeleton_extract_3d.points.transform import transform_people
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.transforms import Transforms

# Messages per second, also when no people come.
_RATE = 20.0
# The bound is 0 when the transform of a link is older [s]; people wait so long for theirs.
_TF_TIMEOUT = 0.2


class SeparationNode:
    """Takes people in one thread, and publishes in another one at a fixed rate.

    Raises:
        ParameterError: `robot_links` are none.
    """

    def __init__(self, params: SeparationParams) -> None:
        self._params = params
        self._links = read_links(params.robot_links, 'robot_links')
        if not self._links:
            raise ParameterError("parameter 'robot_links' names no link, expected FRAME:RADIUS, such as tool0:0.08",
                                 'robot_links')
        self._health, self._transforms = Health(), Transforms(_TF_TIMEOUT)
        self._lock = threading.Lock()
        self._estimator, self._frame_id = SeparationEstimator(params), params.fixed_frame
        self._stamp = rospy.Time()
        self._info: Optional[CameraInfo] = None
        self._clock = rospy.Time(), time.monotonic()
        self._due, self._reason = time.monotonic(), ''
        self._demand = Demand(params.lazy, self._health)
        self._topic = self._demand.advertise(f'{IN_SPACE}/person_separation', PersonSeparation, RESULTS_QUEUE)
        self._worker = NewestWinsWorker(self._take, self._health.frame_failed, 'people')
        people = InputSubscriber(*PEOPLE)
        people.registerCallback(self._worker.submit)
        inputs = [people]
        if params.guard:
            inputs.append(InputSubscriber(f'{IN_SPACE}/camera_info', CameraInfo))
            inputs[1].registerCallback(self._take_camera)
        self._health.show_lasting(lambda: self._reason)
        self._demand.read(*inputs)
        introduce(self._demand.inputs, links=params.robot_links)
        repeat(self._tick, 'separation')

    def _take_camera(self, message: CameraInfo) -> None:
        self._info = message

    def _take(self, message: PersonDetection_3dArray) -> None:
        header = message.header
        if header.stamp.is_zero():
            raise NoStampError('people have no stamp, and how old they are is not known')
        frame_id = self._params.fixed_frame or header.frame_id
        people, info, view = convert.people_from_array(message), self._info, None
        if self._params.fixed_frame and not self._params.room_velocities:
            people = replace(people, velocity=None)
        people = transform_people(people, *self._transforms.pose(frame_id, header))
        if info is not None:
            place = Header(stamp=header.stamp, frame_id=info.header.frame_id)
            view = View.of(convert.camera_from_message(info), self._transforms.pose(frame_id, place))
        with self._lock:
            if frame_id != self._frame_id or (self._stamp - header.stamp).to_nsec() > PAIRING.reset_backstep:
                self._forget(frame_id)
            self._stamp = header.stamp
            self._estimator.take(people, header.stamp.to_sec(), view)
        self._health.frame_done(header.stamp)

    def _forget(self, frame_id: str) -> None:
        self._estimator.clear()
        self._frame_id = frame_id

    def _tick(self) -> None:
        """Publish, and wait for the next time; by the clock of the machine, as the one of ROS may stand still."""
        self._due = max(self._due + 1 / _RATE, time.monotonic())
        if self._demand.enabled and self._demand.is_wanted(self._topic):
            now = rospy.get_rostime()
            with self._lock:
                found, frame_id = self._at(now), self._frame_id
            self._publish(found, Header(stamp=now, frame_id=frame_id))
        else:
            self._reason = ''
        time.sleep(max(self._due - time.monotonic(), 0.0))

    def _at(self, now: rospy.Time) -> Separation:
        before, since = self._clock
        if (before - now).to_nsec() > PAIRING.reset_backstep:
            self._forget(self._frame_id)
        if now != before:
            self._clock = now, time.monotonic()
        elif time.monotonic() - since > CONSTANTS.data_timeout:
            return unknown('the clock stands still')
        try:
            return self._estimator.at(now.to_sec(), self._links_at(now))
        except Exception as error:  # whatever happens, something is published
            self._health.frame_failed(error)
            return unknown(str(error))

    def _links_at(self, now: rospy.Time) -> Links:
        """Return where the links are; with `away` by how far they may have moved since."""
        names: List[str] = []
        centres, radii, away = [np.zeros((0, 3))], [np.zeros(0)], [np.zeros(0)]
        for link in self._links if self._frame_id else ():  # before the first people, there is no frame
            (first, age), (last, other) = (self._place(frame, now) for frame in (link.start, link.end))
            spheres, radius = spheres_of(np.array([first, last]), link.radius)
            centres.append(spheres)
            radii.append(np.full(len(spheres), radius))
            away.append(np.full(len(spheres), self._params.link_speed * max(age, other)))
            names += len(spheres) * [link.start if link.start == link.end else f'{link.start}>{link.end}']
        return Links(names, np.concatenate(centres), np.concatenate(radii), np.concatenate(away))

    def _place(self, frame: str, now: rospy.Time) -> Tuple[np.ndarray, float]:
        """Return where the origin of a frame is, (3,) [m], and how old that is [s]; raises NoTransformError."""
        transform = self._transforms.newest(self._frame_id, frame)
        age = 0.0 if transform.header.stamp.is_zero() else (now - transform.header.stamp).to_sec()
        if not -CONSTANTS.ahead <= age <= _TF_TIMEOUT:
            raise NoTransformError(f'the transform of {frame} is {age:.2f} s old')
        return convert.rotation_and_translation(transform)[1], abs(age)

    def _publish(self, found: Separation, header: Header) -> None:
        if found.bound == 0 and found.reason:
            self._health.count('nothing known')
        self._reason = found.reason if found.bound == 0 else ''
        self._topic.publish(PersonSeparation(
            header=header, distance=found.distance, bound=found.bound, probability=self._params.probability,
            link=found.link, person_ID=max(found.person, 0), part=found.part, status=found.status, age=found.age,
            people=found.people, reason=found.reason))


def main() -> None:
    """Run the node of separation."""
    run_node('separation_node', SeparationParams, SeparationNode)

"""The node of signals: people in space to what they do, with markers."""
from pathlib import Path
from typing import Any, Optional, Sequence, Type

import numpy as np
import rospy
from geometry_msgs.msg import PoseArray
from openpose_ros_msgs.msg import (
    FaceDetection_3dArray,
    HandDetection_3dArray,
    PeopleSummary,
    PersonDetection_3dArray,
    PersonSignals,
    PersonSignalsArray,
)
from openpose_ros_msgs.srv import GetPeople, GetPeopleRequest, GetPeopleResponse
from std_msgs.msg import Header
from tf2_ros import StaticTransformBroadcaster
from visualization_msgs.msg import Marker

from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.images import InputSubscriber
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.ros.people_publisher import PERSONS_QUEUE, RESULTS_QUEUE
from openpose_ros_pkg.stream.frame_loop import NewestWinsWorker
from openpose_ros_signals.node_params import SignalsParams
from openpose_ros_signals.person import Surroundings
from openpose_ros_signals.reader import SignalReader, forward_view, nearest_first
from openpose_ros_signals.records import Target
from openpose_ros_signals.ros.convert import poses_of, signals_to_array, summary_to_message
from openpose_ros_signals.ros.frames import Frames
from openpose_ros_signals.ros.input_end import InputEnd
from openpose_ros_signals.show.markers import SignalMarkers
from openpose_ros_signals.targets import read_targets
from openpose_ros_signals.zones import ZoneWatch, read_zones
from skeleton_extract_3d.landmarks import Landmarks3D
from skeleton_extract_3d.points.transform import LEVEL, TURNED, Transform, transform_landmarks, transform_people
from skeleton_extract_3d.ros import convert
from skeleton_extract_3d.ros.floor_input import FloorInput

_NAMESPACE = 'openpose_ros/skeleton_3d'
# Text, two facings, and rays with cones of two arms.
_MARKERS_QUEUE = 7 * PERSONS_QUEUE
# Hands and faces belong to people whose stamp is this near [s]; hands are found after the people.
_SAME_TIME = 0.3
# z = 0 of a fixed frame.
_FIXED_FLOOR = np.array([0.0, 0.0, 1.0, 0.0])


class _Latest:
    """An input whose newest message is kept."""

    def __init__(self, topic: str, kind: Type[Any], optional: bool = False) -> None:
        self.input = InputSubscriber(topic, kind, optional)
        self.input.registerCallback(self._store)
        self._message: Optional[Any] = None

    def near(self, header: Header) -> Optional[Any]:
        """Return the newest message if its time and frame are those of a header, else None."""
        message = self._message
        if message is None or message.header.frame_id != header.frame_id:
            return None
        return message if abs((message.header.stamp - header.stamp).to_sec()) <= _SAME_TIME else None

    def _store(self, message: Any) -> None:
        self._message = message


def _names(places: Sequence[Any]) -> str:
    return ', '.join(place.name for place in places) or 'none'


class SignalsNode:
    """Reads the signals of the newest people in a thread of its own."""

    def __init__(self, params: SignalsParams) -> None:
        self._params, self._upwards = params, params.upwards
        self._turns = params.level and not params.fixed_frame and not params.use_floor
        self._broadcaster, self._turned = StaticTransformBroadcaster() if self._turns else None, ''
        if self._turns:
            self._upwards = _FIXED_FLOOR[:3]
        self._targets = read_targets(Path(params.targets)) if params.targets else ()
        self._zones = read_zones(Path(params.zones)) if params.zones else ()
        self._zone_watch = ZoneWatch(self._zones)
        self._places = [(place.name, place.frame_id) for places in (self._targets, self._zones) for place in places]
        self._frames = Frames(params.fixed_frame, params.robot_frame, *(frame for _, frame in self._places))
        self._reader, self._markers, self._health = SignalReader(), SignalMarkers(), Health()
        demand = Demand(params.lazy and not params.summary, self._health)
        self._array = demand.advertise(f'{_NAMESPACE}/people_signals', PersonSignalsArray, RESULTS_QUEUE)
        self._persons = demand.advertise(f'{_NAMESPACE}/person_signals', PersonSignals, PERSONS_QUEUE)
        self._summary = demand.advertise(f'{_NAMESPACE}/people_summary', PeopleSummary, RESULTS_QUEUE)
        self._poses = demand.advertise(f'{_NAMESPACE}/people_poses', PoseArray, RESULTS_QUEUE)
        self._shown = demand.advertise(f'{_NAMESPACE}/visualization_signals', Marker, _MARKERS_QUEUE)
        self._input = InputEnd()
        self._present = PeopleSummary()
        if params.summary:
            rospy.Service('get_people', GetPeople, self._get_people)
        self._worker = NewestWinsWorker(self._process, self._health.frame_failed, 'signals')
        self._health.show_lasting(self._fault)
        self._health.show(lambda: {'frames skipped': str(self._worker.replaced)})
        people = InputSubscriber(f'{_NAMESPACE}/detected_poses_3d', PersonDetection_3dArray)
        people.registerCallback(self._worker.submit)
        self._floor = FloorInput()
        # without `hands`, or `face`, the extractor publishes nothing there
        self._hands = _Latest(f'{_NAMESPACE}/detected_hands_3d', HandDetection_3dArray, optional=True)
        self._faces = _Latest(f'{_NAMESPACE}/detected_faces_3d', FaceDetection_3dArray, optional=True)
        demand.read(people, *((self._floor.input,) if params.use_floor and not params.fixed_frame else ()),
                    *((self._hands.input, self._faces.input) if params.use_landmarks else ()))
        people_frame = f'FRAME{TURNED}' if self._turns else 'the frame of the people'
        introduce(demand.inputs, signals=f'in {params.fixed_frame or people_frame}',
                  targets=_names(self._targets), zones=_names(self._zones))

    def _fault(self) -> str:
        """Return which targets, zones and robot frame tf does not know; empty: it knows all."""
        lost = self._frames.lost
        names = sorted(name for name, frame in self._places if frame in lost)
        names += [self._params.robot_frame] if self._params.robot_frame in lost else []
        return f"no transform of {', '.join(names)}" if names else ''

    def _get_people(self, _request: GetPeopleRequest) -> GetPeopleResponse:
        """Return the people that are there, for state machines; raises ServiceException while no messages come."""
        if self._input.has_ended:
            raise rospy.ServiceException('no people come: is the extractor running?')
        return GetPeopleResponse(self._present)

    def _process(self, message: PersonDetection_3dArray) -> None:
        fixed_frame = self._params.fixed_frame
        pose = LEVEL if self._turns else self._frames.to(fixed_frame, message.header)
        floor = _FIXED_FLOOR if fixed_frame else self._floor.at(message.header)
        up = self._upwards if floor is None else floor[:3]
        header = Header(stamp=message.header.stamp, frame_id=self._frame(message.header))
        people = transform_people(convert.people_from_array(message), *pose)
        # targets that tf does not know are left out
        moves = [(target, self._frames.known(target.frame_id, header)) for target in self._targets]
        targets = tuple(Target(target.name, move[0] @ target.position + move[1]) for target, move in moves
                        if move is not None)
        persons = self._reader.update(people, header.stamp.to_sec(), up, Surroundings(targets, floor),
                                      self._landmarks(message.header, pose))
        array = signals_to_array(persons, header)
        self._array.publish(array)
        self._poses.publish(poses_of(array))
        for person in array.persons:
            self._persons.publish(person)
        poses = [self._frames.known(zone.frame_id, header) for zone in self._zones]
        zones = self._zone_watch.update(people, header.stamp.to_sec(), poses)
        robot_frame = self._params.robot_frame
        robot = self._frames.known(robot_frame, header) if robot_frame else forward_view(pose, up)
        self._present = summary_to_message(nearest_first(self._reader.present, robot, up), zones, header, robot_frame)
        self._input.heard()
        self._summary.publish(self._present)
        if self._shown.get_num_connections() > 0:
            for marker in self._markers.markers(persons, header.stamp.to_sec(), up):
                self._shown.publish(convert.marker_to_message(marker, header))
        self._health.frame_done(header.stamp)

    def _frame(self, header: Header) -> str:
        """Return the frame of the signals of people with a header; a new one is published."""
        frame = header.frame_id + TURNED if self._turns else self._params.fixed_frame or header.frame_id
        if self._broadcaster is not None and frame != self._turned:
            self._turned = frame
            self._broadcaster.sendTransform(convert.upright_transform(header))
        return frame

    def _landmarks(self, header: Header, pose: Transform) -> Optional[Landmarks3D]:
        hands, faces, none = self._hands.near(header), self._faces.near(header), Landmarks3D()
        if hands is None and faces is None:
            return None
        found = Landmarks3D(none.hands if hands is None else convert.hands_from_array(hands),
                            none.faces if faces is None else convert.faces_from_array(faces))
        return transform_landmarks(found, *pose)


def main() -> None:
    """Run the node of signals."""
    run_node('people_signals_node', SignalsParams, SignalsNode, yields=True)

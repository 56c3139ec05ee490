"""The fusion node: the people of several cameras become one set of people."""
import threading
import time
from pathlib import Path
from typing import Dict, List, Mapping, Tuple
from weakref import WeakKeyDictionary

import rospy
from openpose_ros_msgs.msg import FusedCamera, FusedCameraArray, PersonDetection_3d, PersonDetection_3dArray
from std_msgs.msg import Header

from openpose_ros_fusion.cameras import CameraJudge, CameraJudgement
from openpose_ros_fusion.collector import Collector, Update
from openpose_ros_fusion.constants import FUSION, FusionConstants
from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_fusion.node_params import FusionParams
from openpose_ros_fusion.observations import Sighting
from openpose_ros_fusion.rig import read_rig
from openpose_ros_fusion.ros.camera_input import CameraInput
from openpose_ros_fusion.ros.rig_frames import RigBroadcaster
from openpose_ros_pkg.ros.demand import Demand
from openpose_ros_pkg.ros.health import Health
from openpose_ros_pkg.ros.node import introduce, run_node
from openpose_ros_pkg.ros.people_publisher import PERSONS_QUEUE, RESULTS_QUEUE
from openpose_ros_pkg.ros.threads import repeat
from openpose_ros_pkg.ros.timing_report import TimingReport
from skeleton_extract_3d.ros import convert

# As an extractor's, so that whatever reads one camera reads the fused people as well.
NAMESPACE = 'openpose_ros/skeleton_3d'
# From the arrival of the first people to the published result.
STAGES = ('collect', 'convert', 'fuse', 'publish', 'total')
STATES = {FusedCamera.OK: 'ok', FusedCamera.SILENT: 'silent', FusedCamera.NO_TRANSFORM: 'no transform',
          FusedCamera.OUT_OF_TIME: 'out of time', FusedCamera.DISAGREES: 'disagrees'}
# What is known of the cameras is judged anew this often, or with each message on it [s].
_JUDGED_PERIOD = 0.5


class PeopleFusionNode:
    """Fuses what cameras send, in a thread of its own; callbacks only store the newest message of each camera."""

    def __init__(self, params: FusionParams, constants: FusionConstants = FUSION) -> None:
        self._silent = constants.collector.silent
        rig = read_rig(Path(params.rig)) if params.rig else None
        self._fixed_frame = params.fixed_frame if rig is None else rig.fixed_frame
        self._health, self._timing = Health(), TimingReport(STAGES, result='total')
        self._arrived = threading.Condition()
        self._fusion = PeopleFusion(constants)
        self._collector = Collector(params.names, constants.collector)
        self._judge = CameraJudge(params.names, constants.cameras)
        # the judge is the fusion thread's; diagnostics read this, which is replaced and never changed
        self._judged: Mapping[str, CameraJudgement] = {name: CameraJudgement() for name in params.names}
        self._judged_at = -float('inf')
        # when the message of a sighting came, time.monotonic() [s], and its stamp
        self._messages: WeakKeyDictionary[Sighting, Tuple[float, rospy.Time]] = WeakKeyDictionary()
        self._demand = demand = Demand(params.lazy, self._health)
        self._array = demand.advertise(f'{NAMESPACE}/detected_poses_3d', PersonDetection_3dArray, RESULTS_QUEUE)
        self._persons = demand.advertise(f'{NAMESPACE}/detected_poses_keypoints_3d', PersonDetection_3d, PERSONS_QUEUE)
        self._states = demand.advertise('cameras', FusedCameraArray, RESULTS_QUEUE)
        self._cameras = {name: CameraInput(name, params, rig, self._notify) for name in params.names}
        if rig is not None:
            if rig.fixed_frame != params.fixed_frame:
                rospy.logwarn("people are in '%s', the fixed frame of the rig, not in '%s': what reads them needs "
                              'fixed_frame:=%s', rig.fixed_frame, params.fixed_frame, rig.fixed_frame)
            self._broadcaster = RigBroadcaster(self._fixed_frame, [rig.camera(name) for name in params.names],
                                               lambda name: self._cameras[name].frame_id)
        self._health.show(self._timing.medians)
        self._health.show(self._values)
        self._health.show_lasting(self._fault)
        repeat(self._work, 'fusion')
        demand.read(*(source for camera in self._cameras.values() for source in camera.inputs))
        introduce(demand.inputs, people=f'in {self._fixed_frame}',
                  cameras=f"{len(self._cameras)}, where they stand by {params.rig or 'tf'}")

    def _notify(self) -> None:
        with self._arrived:
            self._arrived.notify()

    def _work(self) -> None:
        with self._arrived:
            if not any(camera.waits for camera in self._cameras.values()):
                deadline = self._collector.deadline
                self._arrived.wait(1.0 if deadline is None else max(deadline - time.monotonic(), 0.0))
        try:
            self._step()
        except Exception as error:  # whatever a message does, the next one is fused
            self._health.frame_failed(error)

    def _step(self) -> None:
        """Fuse what has come, and what has waited long enough."""
        updates: List[Update] = []
        for camera in self._cameras.values():
            begin = time.monotonic()
            try:
                taken = camera.take()
            except Exception as error:
                self._health.frame_failed(error)
                continue
            if taken is not None:
                sighting, arrival = taken
                self._messages[sighting] = arrival, camera.stamp
                self._timing.add('convert', time.monotonic() - begin)
                updates += self._collector.add(sighting, begin)
        for update in (*updates, *self._collector.due(time.monotonic())):
            self._fuse(update)

    def _fuse(self, update: Update) -> None:
        started = time.monotonic()
        people = self._fusion.update(update.sightings, update.stamp)
        self._judge.update(update.sightings, people, update.stamp, self._fusion.known)
        if self._states.get_num_connections() > 0 or time.monotonic() - self._judged_at >= _JUDGED_PERIOD:
            self._judged, self._judged_at = self._judge.judgements(), time.monotonic()
        fused = time.monotonic()
        newest = max(update.sightings, key=lambda sighting: sighting.stamp)
        # exactly the stamp of its message, where its clock needs no correction
        stamp = (rospy.Time.from_sec(update.stamp) if self._cameras[newest.camera].clock_offset
                 else self._messages[newest][1])
        header = Header(stamp=stamp, frame_id=self._fixed_frame)
        array = convert.people_to_array(people, header)
        self._array.publish(array)
        for person in array.persons:
            self._persons.publish(person)
        if self._states.get_num_connections() > 0:
            self._states.publish(FusedCameraArray(header=header, cameras=self._camera_states()))
        end = time.monotonic()
        arrival = min(self._messages[sighting][0] for sighting in update.sightings)
        for stage, seconds in (('collect', started - arrival), ('fuse', fused - started), ('publish', end - fused),
                               ('total', end - arrival)):
            self._timing.add(stage, seconds)
        self._health.frame_done(header.stamp)

    def _camera_states(self) -> List[FusedCamera]:
        """Return what is known of each camera now."""
        judged = self._judged
        return [FusedCamera(name=camera.name, frame_id=camera.frame_id, stamp=camera.stamp,
                            state=self._state(camera, judged[camera.name]), has_depth=camera.has_depth,
                            people=camera.people, rate=camera.rate,
                            clock_offset=judged[camera.name].clock_offset + camera.clock_offset,
                            error=judged[camera.name].error) for camera in self._cameras.values()]

    def _state(self, camera: CameraInput, judged: CameraJudgement) -> int:
        if time.monotonic() - camera.arrival > self._silent:
            return FusedCamera.SILENT
        if not camera.has_transform:
            return FusedCamera.NO_TRANSFORM
        if camera.name in self._collector.cameras_out_of_time:
            return FusedCamera.OUT_OF_TIME
        return FusedCamera.DISAGREES if judged.disagrees else FusedCamera.OK

    def _values(self) -> Dict[str, str]:
        states = self._camera_states()
        texts = {f'camera {state.name}': f'{STATES[state.state]}, {state.rate:.1f} Hz, people {state.people}, error '
                                         f'{state.error:.3f} m, clock offset {state.clock_offset:.3f} s'
                 for state in states}
        return {**texts, 'messages skipped': str(sum(camera.replaced for camera in self._cameras.values())
                                                 + sum(self._collector.dropped.values())),
                'messages out of time': str(sum(self._collector.out_of_time.values()))}

    def _fault(self) -> str:
        """Return which cameras are not OK, in a few words; empty while all are, and while nothing is read."""
        if self._demand.seconds < self._silent:
            return ''
        return ', '.join(f'{state.name} {STATES[state.state]}'
                         + (f' by {state.error:.2f} m' if state.state == FusedCamera.DISAGREES else '')
                         for state in self._camera_states() if state.state != FusedCamera.OK)


def main() -> None:
    """Run the fusion node."""
    run_node('people_fusion_node', FusionParams, PeopleFusionNode)

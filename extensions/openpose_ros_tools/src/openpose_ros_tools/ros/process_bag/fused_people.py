"""The people of several cameras in bags, fused in the order of their stamps."""
import heapq
import itertools
import logging
import math
from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from typing import Dict, Iterable, Iterator, NamedTuple, Optional, Sequence, Set, Tuple
from weakref import WeakKeyDictionary

import genpy
from sensor_msgs.msg import CameraInfo

from openpose_ros_fusion.collector import Collector, Update
from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_fusion.node_params import FusionParams
from openpose_ros_fusion.observations import Sighting
from openpose_ros_fusion.ros.convert import sighting_from_message
from openpose_ros_pkg.errors import BadInputError, NoTransformError
from openpose_ros_pkg.stream.pairing import PAIRING
from openpose_ros_tools.ros.bag_files import StampedMessage, deserialized, open_bag, stamped_messages
from openpose_ros_tools.ros.process_bag.input import RecordedTransforms
from openpose_ros_tools.ros.process_bag.job import RigJob
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.transform import Transform
from skeleton_extract_3d.ros import convert

_log = logging.getLogger(__name__)

_NANOSECONDS = 1e9


class CameraPeople(NamedTuple):
    """The people of a camera in a bag."""

    name: str  # of the camera
    bag: Path  # with the people
    topic: str  # of their arrays
    recording: Path  # bag with tf and the camera info
    info: str  # topic of the camera info; empty: the camera has depth


class FusedPeople(NamedTuple):
    """People of an update: its stamp and time of recording [ns]."""

    stamp: int
    time: int
    people: People3D


class _CameraObservation(NamedTuple):
    """The people of a camera at a time."""

    begun: int  # number of times that the stamps of its camera jumped back before
    stamp: int  # by the common clock [ns]
    time: int  # of recording [ns]
    sighting: Sighting  # its stamp is since the begin of all


class Fusion:
    """Fuses the people of cameras; iterate over it once.

    Args:
        job: what is wanted.
        cameras: where their people are.
        stack: closes the bags.

    Attributes:
        used: number of arrays of people, by camera.
        left_out: number of messages, by camera and reason.

    Raises:
        BadInputError: a bag can not be read, a camera without depth is not calibrated.
    """

    def __init__(self, job: RigJob, cameras: Sequence[CameraPeople], stack: ExitStack) -> None:
        self._job, self._cameras = job, cameras
        self._streams = [_Stream(job, camera, stack) for camera in cameras]
        first = [stream.first for stream in self._streams if stream.first is not None]
        self._begin = min(first) if first else 0
        self._fusion = PeopleFusion()
        self._times: WeakKeyDictionary[Sighting, int] = WeakKeyDictionary()
        self.used: Dict[str, int] = Counter()
        self.left_out = {stream.name: stream.left_out for stream in self._streams}

    def __iter__(self) -> Iterator[FusedPeople]:
        """Yield the people of all updates; a time before the last one begins anew."""
        # where all stamps jump back, as in a recording of something that was played in a loop, all begins anew
        jumps = min((stream.jumps() for stream in self._streams if stream.first is not None), default=0)
        streams = [stream.seen(self._begin, jumps) for stream in self._streams]
        names = [camera.name for camera in self._cameras]
        for _, part in itertools.groupby(heapq.merge(*streams, key=lambda one: one[:2]), lambda one: one.begun):
            collector = Collector(names, FusionParams.patience)
            yield from self._people(part, collector)
            for name, number in collector.out_of_time.items():
                if number:
                    self.left_out[name]['stamps beside those of the others'] += number

    def _people(self, seen: Iterable[_CameraObservation], collector: Collector) -> Iterator[FusedPeople]:
        for one in seen:
            self._times[one.sighting] = one.time
            self.used[one.sighting.camera] += 1
            now = one.sighting.stamp  # as if all messages came at once, in the order of their stamps
            for update in itertools.chain(collector.due(now), collector.add(one.sighting, now)):
                yield self._fused(update)
        for update in collector.due(float('inf')):
            yield self._fused(update)

    def _fused(self, update: Update) -> FusedPeople:
        people = self._fusion.update(update.sightings, update.stamp)
        return FusedPeople(self._begin + round(update.stamp * _NANOSECONDS),
                           max(self._times[sighting] for sighting in update.sightings), people)


class _Stream:
    """The people of a camera in the order of its bag; left_out: number of messages, by reason."""

    def __init__(self, job: RigJob, camera: CameraPeople, stack: ExitStack,
                 backstep: int = PAIRING.reset_backstep) -> None:
        self._backstep = backstep
        self.name = camera.name
        self.left_out: Dict[str, int] = Counter()
        self._bag, self._topic = stack.enter_context(open_bag(camera.bag)), camera.topic
        self._offset, self._shift = job.clock_offset(camera.name), job.time_shift(camera.name)
        self._fixed_frame = job.fixed_frame
        self._rig_pose: Optional[Transform] = None if job.rig is None else job.rig.camera(camera.name).pose
        self._transforms = None if job.rig else RecordedTransforms(stack.enter_context(open_bag(camera.recording)))
        self._model = None
        if camera.info:
            info = stack.enter_context(open_bag(camera.recording))
            self._model = convert.camera_from_message(
                deserialized(next(stamped_messages(info, [camera.info])), CameraInfo), job.rectified)
        self._told: Set[str] = set()

    @property
    def first(self) -> Optional[int]:
        """First stamp by the common clock [ns]; None: there is no message."""
        found = next(stamped_messages(self._bag, [self._topic]), None)
        return None if found is None else (found.stamp or 0) + self._offset

    def jumps(self) -> int:
        """Return how often the stamps jump back."""
        return max((begun for begun, *_ in self._parts(math.inf)), default=0)

    def seen(self, begin: int, jumps: int) -> Iterator[_CameraObservation]:
        """Yield the people of the camera.

        Args:
            begin: stamp that is 0 in the sightings [ns].
            jumps: as often the stamps may jump back; after further jumps, what is not newer is left out.
        """
        for begun, stamp, is_newer, stored in self._parts(jumps):
            if not is_newer:
                self.left_out['stamps not newer than before'] += 1
                continue
            try:
                sighting = self._sighting(stored, (stamp - begin) / _NANOSECONDS)
            except NoTransformError as error:
                self._leave_out(f'no transform to {self._fixed_frame}', error)
            except BadInputError as error:
                self._leave_out('they can not be used', error)
            else:
                yield _CameraObservation(begun, stamp, stored.time + self._shift, sighting)

    def _parts(self, jumps: float) -> Iterator[Tuple[int, int, bool, StampedMessage]]:
        """Yield messages: number of jumps before, stamp [ns], whether it is newer than all since, and the message."""
        begun, newest = 0, 0
        for stored in stamped_messages(self._bag, [self._topic]):
            stamp = (stored.stamp or 0) + self._offset
            if begun < jumps and stamp < newest - self._backstep:
                begun, newest = begun + 1, 0
            yield begun, stamp, stamp > newest, stored
            newest = max(stamp, newest)

    def _sighting(self, stored: StampedMessage, stamp: float) -> Sighting:
        message = deserialized(stored)
        if self._transforms is None:
            pose = self._rig_pose
        else:
            self._transforms.read_until(genpy.Time(0, stored.time))
            pose = convert.rotation_and_translation(self._transforms.lookup(
                self._fixed_frame, stored.frame_id, message.header.stamp))
        return sighting_from_message(self.name, stamp, message, pose, self._model)

    def _leave_out(self, reason: str, error: Exception) -> None:
        self.left_out[reason] += 1
        if reason not in self._told:
            self._told.add(reason)
            _log.warning('camera %s: a message is left out: %s', self.name, error)

"""The people of several cameras in bags, fused in the order of their stamps."""
import heapq
import itertools
import logging
from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from typing import Dict, Iterator, NamedTuple, Optional, Sequence, Tuple
from weakref import WeakKeyDictionary

import genpy
from sensor_msgs.msg import CameraInfo

from openpose_ros_fusion.collector import Collector, Update
from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_fusion.observations import Sighting
from openpose_ros_fusion.ros.convert import sighting_from_message
from openpose_ros_pkg.errors import BadInputError, NoTransformError
from openpose_ros_tools.ros.bag_files import StampedMessage, deserialized, open_bag, stamped_messages
from openpose_ros_tools.ros.process_bag.job import RigInput
from openpose_ros_tools.ros.process_bag.transforms import RecordedTransforms
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


class Fusion:
    """Fuses the people of cameras; iterate over it once.

    Args:
        rig: the cameras.
        people: where those of each camera are.
        rectified: images of cameras without depth are.
        stack: closes the bags.

    Attributes:
        used: number of arrays of people, by camera.
        left_out: number of messages, by camera and reason.

    Raises:
        BadInputError: a bag can not be read, a camera without depth is not calibrated.
    """

    def __init__(self, rig: RigInput, people: Sequence[CameraPeople], rectified: bool, stack: ExitStack) -> None:
        self._streams = [_Stream(rig, camera, rectified, stack) for camera in people]
        self._begin = min((stream.first for stream in self._streams if stream.first is not None), default=0)
        self._fusion = PeopleFusion()
        self._times: WeakKeyDictionary[Sighting, int] = WeakKeyDictionary()
        self.used: Dict[str, int] = Counter()
        self.left_out = {stream.name: stream.left_out for stream in self._streams}

    def __iter__(self) -> Iterator[Tuple[int, int, People3D]]:
        """Yield stamp and time of recording [ns] of all updates, and their people."""
        collector = Collector([stream.name for stream in self._streams])
        streams = [stream.sightings(self._begin) for stream in self._streams]
        for _, time, sighting in heapq.merge(*streams, key=lambda one: one[0]):
            self._times[sighting] = time
            self.used[sighting.camera] += 1
            now = sighting.stamp  # as if all messages came at once, in the order of their stamps
            for update in itertools.chain(collector.due(now), collector.add(sighting, now)):
                yield self._fused(update)
        yield from map(self._fused, collector.due(float('inf')))
        for name, number in collector.out_of_time.items():
            if number:
                self.left_out[name]['stamps beside those of the others'] += number

    def _fused(self, update: Update) -> Tuple[int, int, People3D]:
        people = self._fusion.update(update.sightings, update.stamp)
        return (self._begin + round(update.stamp * _NANOSECONDS),
                max(self._times[sighting] for sighting in update.sightings), people)


class _Stream:
    """The people of a camera in the order of its bag; left_out: number of messages, by reason."""

    def __init__(self, rig: RigInput, camera: CameraPeople, rectified: bool, stack: ExitStack) -> None:
        self.name = camera.name
        self.left_out: Dict[str, int] = Counter()
        self._bag, self._topic = stack.enter_context(open_bag(camera.bag)), camera.topic
        self._offset, self._shift = rig.clock_offset(camera.name), rig.time_shift(camera.name)
        self._fixed_frame = rig.fixed_frame
        self._rig_pose: Optional[Transform] = None if rig.rig is None else rig.rig.camera(camera.name).pose
        self._transforms = None if rig.rig else RecordedTransforms(stack.enter_context(open_bag(camera.recording)))
        self._model = None
        if camera.info:
            info = stack.enter_context(open_bag(camera.recording))
            self._model = convert.camera_from_message(
                deserialized(next(stamped_messages(info, [camera.info])), CameraInfo), rectified)

    @property
    def first(self) -> Optional[int]:
        """First stamp by the common clock [ns]; None: there is no message."""
        found = next(stamped_messages(self._bag, [self._topic]), None)
        return None if found is None else (found.stamp or 0) + self._offset

    def sightings(self, begin: int) -> Iterator[Tuple[int, int, Sighting]]:
        """Yield stamps by the common clock and times of recording [ns], and the people of the camera.

        Args:
            begin: stamp that is 0 in the sightings [ns].
        """
        newest = 0
        for stored in stamped_messages(self._bag, [self._topic]):
            stamp = (stored.stamp or 0) + self._offset
            if stamp <= newest:
                self.left_out['stamps not newer than before'] += 1
                continue
            newest = stamp
            try:
                sighting = self._sighting(stored, (stamp - begin) / _NANOSECONDS)
            except (NoTransformError, BadInputError) as error:
                reason = f'no transform to {self._fixed_frame}' if isinstance(error, NoTransformError) else (
                    'they can not be used')
                if reason not in self.left_out:
                    _log.warning('camera %s: a message is left out: %s', self.name, error)
                self.left_out[reason] += 1
            else:
                yield stamp, stored.time + self._shift, sighting

    def _sighting(self, stored: StampedMessage, stamp: float) -> Sighting:
        message = deserialized(stored)
        pose = self._rig_pose
        if self._transforms is not None:
            self._transforms.read_until(genpy.Time(0, stored.time), message.header.stamp)
            pose = convert.rotation_and_translation(self._transforms.lookup(
                self._fixed_frame, stored.frame_id, message.header.stamp))
        return sighting_from_message(self.name, stamp, message, pose, self._model)

"""Several cameras that see the same people: each by itself, then fused, in one bag."""
import heapq
import itertools
import logging
import shutil
from collections import Counter
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Dict, Iterable, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple
from weakref import WeakKeyDictionary

import genpy
import numpy as np
import rosbag
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from openpose_ros_fusion.collector import Collector, Update
from openpose_ros_fusion.fusion import PeopleFusion
from openpose_ros_fusion.observations import Sighting
from openpose_ros_fusion.rig import Rig
from openpose_ros_fusion.ros.convert import sighting_from_message
from openpose_ros_pkg.command_line import Progress
from openpose_ros_pkg.errors import BadInputError, NoTransformError, ParameterError
from openpose_ros_pkg.ros.topics import FUSED, IN_IMAGE, IN_SPACE, is_within
from openpose_ros_tools.outputs import PartFiles
from openpose_ros_tools.ros.bag_files import (
    TF_TOPICS,
    StampedMessage,
    deserialized,
    new_bag,
    open_bag,
    stamped_messages,
    topic_types,
    write_static_transforms,
)
from openpose_ros_tools.ros.process_bag.input import OpenCamera, copied_topics, open_camera
from openpose_ros_tools.ros.process_bag.job import (
    BagJob,
    BagReport,
    BagSettings,
    Input,
    Outputs,
    RigInput,
    build_settings,
)
from openpose_ros_tools.ros.process_bag.output import ON_FLOOR, PeopleWriter, json_names, people_table
from openpose_ros_tools.ros.process_bag.transforms import RecordedTransforms
from openpose_ros_tools.ros.process_bag.work import Networks, OnFrame, process_camera
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.rgbd_sequence import WORLD_FRAME
from skeleton_extract_3d.points.transform import Transform
from skeleton_extract_3d.ros import convert

_log = logging.getLogger(__name__)

_NANOSECONDS = 1e9


class RigReport(NamedTuple):
    """Report of several cameras."""

    cameras: Dict[str, BagReport]
    streams: Sequence['_Stream']  # of the people of the cameras
    frames: int  # fused
    people: int  # in them, in sum

    def text(self) -> str:
        """Return the report in some lines."""
        lines = [f'{self.frames} fused frames with {self.people} people, on /{FUSED}/{IN_SPACE}/detected_poses_3d']
        for stream in self.streams:
            parts = [self.cameras[stream.name].text(), f'{stream.used} fused',
                     *(f'{number} not: {reason}' for reason, number in stream.left_out.items())]
            lines.append(f'  {stream.name}: ' + '; '.join(parts))
        return '\n'.join(lines)


def rig_input(inputs: Sequence[Input], names: Sequence[str], with_depth: int, frame: str, rig: Optional[Rig]
              ) -> RigInput:
    """Return several cameras as an input.

    Args:
        inputs: their bags: one, or one for each camera.
        names: of the cameras.
        with_depth: number of cameras, the first ones, whose points are used.
        frame: of the fused people; empty: that of the rig, or `world`.

    Raises:
        ParameterError: they contradict each other.
        BadInputError: the rig has not these cameras.
    """
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(f"--cameras names '{name}' twice")
        if name in ('', FUSED):
            raise ParameterError(f"--cameras names '{name}', which is for the fused people; allowed: other names")
    if len(inputs) not in (1, len(names)):
        raise ParameterError(f'there are {len(inputs)} bags for {len(names)} cameras; give one bag, or one for each')
    if rig is not None:
        if frame not in ('', rig.fixed_frame):
            raise ParameterError(f"--fixed-frame {frame} contradicts the rig, which has '{rig.fixed_frame}'")
        for name in names:
            rig.camera(name)  # or it has none
    cameras = tuple(replace(inputs[number % len(inputs)], camera=name, is_alone=len(inputs) > 1,
                            only_2d=inputs[0].only_2d or number >= with_depth) for number, name in enumerate(names))
    return RigInput(cameras, frame or (WORLD_FRAME if rig is None else rig.fixed_frame), rig)


def process_rig(rig: RigInput, job: BagJob, on_frame: OnFrame = lambda done, total: None) -> RigReport:
    """Make the results of several cameras, the input of a job; they appear all at once, at the end.

    Raises:
        BadInputError: cameras have no common time or no transforms; further errors as `process`.
    """
    outputs, settings = job.outputs, build_settings(job.settings.values)
    points_source = settings.extractor.points_source
    if points_source == 'none' and not all(camera.only_2d for camera in rig.cameras):
        raise ParameterError("parameter 'points_source' = 'none' is not allowed here: cameras without depth are fused "
                             'by their rays, with --only-2d', 'points_source')
    with ExitStack() as stack:
        views = [open_camera(camera, stack, (), points_source) for camera in rig.cameras]
        copied = {bag: _copied(rig, bag, outputs.copied) for bag in rig.bags}
        _check_common_time(rig, views)
        parts = stack.enter_context(PartFiles())
        csv = None if outputs.csv is None else parts.file(outputs.csv)
        part = parts.file(outputs.bag)
        folder = part.with_suffix('.cameras')
        shutil.rmtree(str(folder), ignore_errors=True)  # a killed process left it
        stack.callback(shutil.rmtree, str(folder), ignore_errors=True)
        folder.mkdir()
        # joints as frames would have the same names
        networks = Networks(replace(job.settings, values={**job.settings.values, 'publish_tf': False}))
        bags: List[Path] = []
        reports: Dict[str, BagReport] = {}
        begins = [0, *itertools.accumulate(view.images for view in views)]
        for number, (camera, view) in enumerate(zip(rig.cameras, views)):
            json = outputs.json and parts.folder(outputs.json / camera.camera, json_names(camera))
            alone = replace(outputs, bag=folder / f'{number}.bag', csv=None, json=json)
            reports[camera.camera] = process_camera(
                camera, alone, view, networks,
                lambda done, _, number=number: on_frame(begins[number] + done, begins[-1]))  # type: ignore[misc]
            bags.append(alone.bag)
        with ExitStack() as opened:
            streams = [_Stream(rig, camera, view, opened.enter_context(open_bag(bag)),
                               settings.extractor.rectified == 'true')
                       for camera, view, bag in zip(rig.cameras, views, bags)]
            fused = replace(outputs, bag=folder / 'fused.bag', csv=csv)
            report = RigReport(reports, streams, *_fuse(streams, rig.fixed_frame, settings, fused))
        if report.frames == 0:
            raise BadInputError(f'nothing could be fused: {report.text()}')
        _merge(rig, bags, fused.bag, copied, replace(outputs, bag=part))
    return report


def _check_common_time(rig: RigInput, views: Sequence[OpenCamera]) -> None:
    """Raise BadInputError if a camera was recorded while no other was."""
    spans = {}
    for camera, view in zip(rig.cameras, views):
        first = next(stamped_messages(view.bag, [view.topics.image]))
        begin = 1e-9 * ((first.stamp or first.time) + rig.clock_offset(camera.camera))
        end = view.bag.get_end_time()  # rosbag takes the last chunk for the newest, which it need not be
        later = stamped_messages(view.bag, [view.topics.image], genpy.Time.from_sec(end))
        spans[camera.camera] = begin, begin + max([end, *(1e-9 * one.time for one in later)]) - 1e-9 * first.time
    for name, (begin, end) in spans.items():
        others = [span for other, span in spans.items() if other != name]
        if others and not any(begin <= last and first <= end for first, last in others):
            texts = ', '.join(f'{each} {first:.3f} to {last:.3f} s' for each, (first, last) in spans.items())
            raise BadInputError(f'{name} was recorded while no other camera was: {texts}; --rig says '
                                'by which time clocks differ')


class _Stream:
    """The people of a camera, in the order of its bag of results, which is open.

    Attributes:
        used: number of arrays of people that were fused.
        left_out: number of those that were not, by reason.
    """

    def __init__(self, rig: RigInput, camera: Input, view: OpenCamera, bag: rosbag.Bag, rectified: bool) -> None:
        self.name, self.used = camera.camera, 0
        self.left_out: Dict[str, int] = Counter()
        in_space = view.topics.in_space
        self._bag, self._topic = bag, f'/{self.name}/' + (
            f'{IN_SPACE}/detected_poses_3d' if in_space else f'{IN_IMAGE}/detected_poses')
        self._offset, self._shift = rig.clock_offset(self.name), rig.time_shift(self.name)
        self._fixed_frame = rig.fixed_frame
        self._rig_pose: Optional[Transform] = None if rig.rig is None else rig.rig.camera(self.name).pose
        self._transforms = None if rig.rig else RecordedTransforms(view.bag)
        self._model = None if in_space else convert.camera_from_message(
            deserialized(next(stamped_messages(view.bag, [view.topics.camera_info])), CameraInfo), rectified)

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
                self.used += 1
                yield stamp, stored.time + self._shift, sighting

    def _sighting(self, stored: StampedMessage, stamp: float) -> Sighting:
        message = deserialized(stored)
        pose = self._rig_pose
        if self._transforms is not None:
            self._transforms.read_until(genpy.Time(0, stored.time), message.header.stamp)
            pose = convert.rotation_and_translation(self._transforms.lookup(
                self._fixed_frame, stored.frame_id, message.header.stamp))
        return sighting_from_message(self.name, stamp, message, pose, self._model)


def _fused(streams: Sequence[_Stream]) -> Iterator[Tuple[int, int, People3D]]:
    """Yield stamp and time of recording [ns] of all updates, and their people, in the order of the stamps."""
    begin = min((first for first in (stream.first for stream in streams) if first is not None), default=0)
    fusion, collector = PeopleFusion(), Collector([stream.name for stream in streams])
    times: WeakKeyDictionary[Sighting, int] = WeakKeyDictionary()

    def people_of(updates: Iterable[Update]) -> Iterator[Tuple[int, int, People3D]]:
        for update in updates:
            people = fusion.update(update.sightings, update.stamp)
            yield begin + round(update.stamp * _NANOSECONDS), max(times[each] for each in update.sightings), people

    for _, time, sighting in heapq.merge(*(stream.sightings(begin) for stream in streams), key=lambda one: one[0]):
        times[sighting] = time
        now = sighting.stamp  # as if all messages came at once, in the order of their stamps
        yield from people_of(itertools.chain(collector.due(now), collector.add(sighting, now)))
    yield from people_of(collector.due(float('inf')))
    for stream in streams:
        if collector.out_of_time[stream.name]:
            stream.left_out['stamps beside those of the others'] += collector.out_of_time[stream.name]


def _fuse(streams: Sequence[_Stream], frame: str, settings: BagSettings, outputs: Outputs) -> Tuple[int, int]:
    """Write the fused people into a bag and a table; return the number of frames, and of people in them."""
    frames = number = 0
    with ExitStack() as stack:
        table = None if outputs.csv is None else stack.enter_context(people_table(outputs.csv, outputs.csv_layout, 3))
        writer = PeopleWriter(stack.enter_context(new_bag(outputs.bag)), f'/{FUSED}/{IN_SPACE}', settings, table,
                              outputs.markers, ON_FLOOR if outputs.signals else None)
        for stamp, time, found in Progress(_fused(streams), 'fusion', unit='frame'):
            writer.write(found, Header(frames, genpy.Time(0, stamp), frame), genpy.Time(0, time))
            frames += 1
            number += len(found)
    return frames, number


def _moved(bag: rosbag.Bag, topics: Mapping[str, str], shift: int) -> Iterator[StampedMessage]:
    """Yield messages of a bag with the names of their topics in the output, `shift` [ns] later."""
    for stored in stamped_messages(bag, list(topics)):
        topic = topics[stored.topic]
        yield stored._replace(topic=topic, time=stored.time + shift, connection={**stored.connection, 'topic': topic})


def _merge(rig: RigInput, bags: Sequence[Path], fused: Path, copied: Mapping[Path, Mapping[str, str]], outputs: Outputs
           ) -> None:
    """Write the output: the people of the cameras, the fused ones, and what is copied."""
    cameras = {camera.bag: camera.camera for camera in rig.cameras}
    with ExitStack() as stack:
        streams = []
        for path, shift, root in (*((bag, rig.time_shift(one.camera), f'{one.camera}/{IN_IMAGE}')
                                    for bag, one in zip(bags, rig.cameras)), (fused, 0, '')):
            bag = stack.enter_context(open_bag(path))
            streams.append(_moved(bag, {topic: topic for topic in topic_types(bag) if is_within(topic, root)}, shift))
        streams += [_moved(stack.enter_context(open_bag(path)), topics, rig.time_shift(cameras[path]))
                    for path, topics in copied.items()]
        written = stack.enter_context(new_bag(outputs.bag, outputs.compression))
        for number, stored in enumerate(heapq.merge(*streams, key=lambda stored: stored.time)):
            time = genpy.Time(0, stored.time)
            if number == 0:
                _write_rig(rig, written, time)
            written.write(stored.topic, stored.raw, time, raw=True, connection_header=stored.connection)


def _write_rig(rig: RigInput, bag: rosbag.Bag, time: genpy.Time) -> None:
    if rig.rig is None:
        return
    header, stands = Header(stamp=time, frame_id=rig.fixed_frame), [rig.rig.camera(one.camera) for one in rig.cameras]
    write_static_transforms(bag, [convert.transform_from_matrix(np.column_stack(one.pose), header, one.frame_id)
                                  for one in stands], time, 'process_bag')


def _copied(rig: RigInput, path: Path, wanted: Sequence[str]) -> Dict[str, str]:
    """Return the topics of a bag that are copied, by name in the output: of several bags below the camera."""
    name = next(camera.camera for camera in rig.cameras if camera.bag == path)
    with open_bag(path) as bag:
        copied = copied_topics(bag, wanted)
        if rig.rig is None:
            copied += [topic for topic in topic_types(bag) if topic in TF_TOPICS and topic not in copied]
    alone = len(rig.bags) > 1
    return {topic: f"/{name}/{topic.strip('/')}" if alone and topic not in TF_TOPICS and not is_within(topic, name)
            else topic for topic in copied}

"""Several cameras that see the same people: each by itself, then fused, in one bag."""
import argparse
import heapq
import itertools
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Sequence, Tuple

import genpy
import numpy as np
import rosbag
from std_msgs.msg import Header

from openpose_ros_fusion.rig import read_rig
from openpose_ros_pkg.command_line import Progress
from openpose_ros_pkg.command_options import named_value, plain_path, seconds
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_tools.outputs import PartFiles
from openpose_ros_tools.ros.bag_files import (
    StampedMessage,
    new_bag,
    open_bag,
    stamped_messages,
    topic_types,
    write_static_transforms,
)
from openpose_ros_tools.ros.camera_topics import TopicFinder, is_within
from openpose_ros_tools.ros.keypoints.keypoint_bag import RECORD
from openpose_ros_tools.ros.process_bag.fused_people import CameraPeople, Fusion
from openpose_ros_tools.ros.process_bag.input import OpenCamera, copied_topics
from openpose_ros_tools.ros.process_bag.job import BagJob, BagReport, BagSettings, RigJob, build_settings
from openpose_ros_tools.ros.process_bag.output import (
    IN_IMAGE,
    IN_SPACE,
    ON_FLOOR,
    PeopleTable,
    PeopleWriter,
    digests,
    finished_record,
    json_names,
    record,
)
from openpose_ros_tools.ros.process_bag.preset import with_preset
from openpose_ros_tools.ros.process_bag.registration import TF_TOPICS
from openpose_ros_tools.ros.process_bag.work import Networks, open_camera, process_camera
from skeleton_extract_3d.points.rgbd_sequence import WORLD_FRAME
from skeleton_extract_3d.ros.convert import transform_from_matrix

FUSED = 'people'
"""Namespace of the fused people, as cameras.launch has it."""


@dataclass
class RigReport:
    """Report of several cameras."""

    cameras: Dict[str, BagReport]  # of those whose networks ran
    used: Dict[str, int]  # arrays of people by camera that were fused
    left_out: Dict[str, Dict[str, int]]  # and those that were not, by the reason
    frames: int = 0  # fused
    people: int = 0  # in them, in sum

    def text(self) -> str:
        """Return the report in some lines."""
        lines = [f'{self.frames} fused frames with {self.people} people, on /{FUSED}{IN_SPACE}/detected_poses_3d']
        for name, reasons in self.left_out.items():
            parts = [self.cameras[name].text()] if name in self.cameras else []
            parts += [f'{self.used.get(name, 0)} fused']
            parts += [f'{number} not: {reason}' for reason, number in reasons.items()]
            lines.append(f'  {name}: ' + '; '.join(parts))
        return '\n'.join(lines)


def add_cameras(parser: argparse.ArgumentParser) -> None:
    """Add the options for several cameras; `rig_job` reads them."""
    group = parser.add_argument_group('several cameras that see the same people')
    group.add_argument('--cameras', nargs='+', default=[], metavar='NAME',
                       help='namespaces of the cameras in the bag; of several bags, names of their cameras in the same '
                            'order. Topics that are named are in the namespace of each camera')
    group.add_argument('--rgb-cameras', nargs='+', default=[], metavar='NAME',
                       help='further cameras, without depth, or whose points are ignored; their bags come last')
    group.add_argument('--fixed-frame', type=frame_name, default='', metavar='FRAME',
                       help=f'of the fused people (default: {WORLD_FRAME}, or that of --rig)')
    group.add_argument('--rig', type=plain_path, metavar='FILE',
                       help='where the cameras stand, and by which time their clocks differ (default: tf says where)')
    group.add_argument('--clock-offset', action='append', default=[], metavar='NAME=S',
                       type=named_value(seconds, 'left=0.07'),
                       help='is added to the stamps of a camera [s], in place of that of --rig; may be repeated')
    group.add_argument('--rectified', action='store_true', help='images of cameras without depth are rectified')
    group.add_argument('--only-fuse', action='store_true', help='the bags hold the people of each camera; fuse these')


def camera_names(options: argparse.Namespace) -> List[str]:
    """Return the names of several cameras, those without depth last; [] where the command line names none."""
    return [name.strip('/') for name in (*options.cameras, *options.rgb_cameras)]


def check_cameras(options: argparse.Namespace) -> None:
    """Raise ParameterError if an option of several cameras is given without any."""
    for name in () if camera_names(options) else ('fixed_frame', 'rig', 'clock_offset', 'rectified', 'only_fuse'):
        if getattr(options, name):
            raise ParameterError(f"--{name.replace('_', '-')} belongs to --cameras")


def rig_job(jobs: Sequence[BagJob], options: argparse.Namespace) -> RigJob:
    """Return what is to be made of the cameras.

    Args:
        jobs: of the bags.

    Raises:
        ParameterError: options contradict each other.
        BadInputError: the rig can not be read, or has not these cameras.
    """
    names = camera_names(options)
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(f"--cameras names '{name}' twice")
        if name in ('', FUSED):
            raise ParameterError(f"--cameras names '{name}', which is for the fused people; allowed: other names")
    if jobs[0].values.get('rotate_image'):
        raise ParameterError("parameter 'rotate_image' is for one camera, without --cameras")
    if len(jobs) not in (1, len(names)):
        raise ParameterError(f'there are {len(jobs)} bags for {len(names)} cameras; give one bag, or one for each')
    offsets = dict(options.clock_offset)
    unknown = [name for name in offsets if name not in names]
    if unknown:
        raise ParameterError(f'--clock-offset {unknown[0]} is none of the cameras {", ".join(names)}')
    if options.scheduler:
        raise ParameterError('--scheduler is for several recordings; --cameras makes one of them')
    if jobs[0].values.get('target_frame'):
        raise ParameterError("parameter 'target_frame' contradicts --cameras; fused people are in the --fixed-frame")
    if options.only_fuse and options.json:
        raise ParameterError('--json contradicts --only-fuse, which reads no images')
    rig = None if options.rig is None else read_rig(options.rig)
    if rig is not None:
        if options.fixed_frame not in ('', rig.fixed_frame):
            raise ParameterError(f'--fixed-frame {options.fixed_frame} contradicts the rig, which has '
                                 f"'{rig.fixed_frame}'")
        offsets = {name: offsets.get(name, rig.camera(name).clock_offset) for name in names}
    with_depth = len(options.cameras)
    cameras = tuple(replace(jobs[0 if len(jobs) == 1 else number], camera=name, is_alone=len(jobs) > 1, csv=None,
                            json=options.json and jobs[0].json / name,
                            only_2d=options.only_2d or number >= with_depth) for number, name in enumerate(names))
    frame = options.fixed_frame or (WORLD_FRAME if rig is None else rig.fixed_frame)
    return RigJob(cameras, jobs[0].output, jobs[0].csv, jobs[0].json, frame, rig, offsets, options.rectified,
                  options.only_fuse)


def process_rig(job: RigJob, on_frame: Callable[[int, int], None] = lambda done, total: None) -> RigReport:
    """Make the results of several cameras; they appear all at once, at the end.

    Args:
        on_frame: gets the number of images of all cameras that are done, and of all.

    Raises:
        BadInputError: cameras have no common time or no transforms; further errors as `process`.
    """
    made = finished_record(job) or job.made_from()
    if not job.only_fuse:
        job = replace(job, cameras=tuple(map(with_preset, job.cameras)))
    settings = build_settings(job.cameras[0].values)
    with ExitStack() as stack:
        views = [] if job.only_fuse else [open_camera(camera, settings, stack) for camera in job.cameras]
        given = [_given_people(camera) for camera in job.cameras] if job.only_fuse else []
        copied = {source: _copied(job, source) for source in job.sources}
        _check_common_time(job, [view.topics.image for view in views] or [one.topic for one in given])
        parts = stack.enter_context(PartFiles())
        output, csv = parts.file(job.output), None if job.csv is None else parts.file(job.csv)
        folder, done_cameras = parts.scratch_folder(job.output), []
        reports: Dict[str, BagReport] = {}
        if views:
            # joints as frames would have the same names for each camera
            alone = replace(settings, extractor=replace(settings.extractor, publish_tf=False))
            networks = Networks(job.cameras[0], alone)
            counts = [view.images for view in views]
            for camera, view in zip(job.cameras, views):
                json = None if camera.json is None else parts.folder(camera.json, json_names(camera))
                part = replace(camera, output=folder / f'{len(reports)}.bag', json=json, mcap=False)
                done_cameras.append(part)
                reports[camera.camera] = process_camera(
                    part, view, {}, networks, lambda number, _: on_frame(
                        sum(counts[:len(reports)]) + number, sum(counts)))
                given.append(_found_people(part, view))
        report = _fuse(job, given, settings, (folder / 'fused.bag', csv), stack)
        report.cameras.update(reports)
        _merge(job, given, folder / 'fused.bag', copied, (output, {**made, **digests(done_cameras, csv)}))
    return report


def _given_people(camera: BagJob) -> CameraPeople:
    """Return where the people of a camera are in its bag."""
    with open_bag(camera.source) as bag:
        types = topic_types(bag)
        roots = [f'/{camera.camera}'] + [''] * camera.is_alone
        wanted = [(f'{root}{IN_IMAGE}/detected_poses', root) for root in roots]
        if not camera.only_2d:
            wanted = [(f'{root}{IN_SPACE}/detected_poses_3d', root) for root in roots] + wanted
        topic, root = next((each for each in wanted if each[0] in types), ('', ''))
        if not topic:
            raise BadInputError(f'{camera.source} has no people of the camera {camera.camera}: expected '
                                f"{' or '.join(each for each, _ in wanted)}")
        info = ''
        if not topic.endswith('_3d'):
            finder = TopicFinder(bag, root)
            info = finder.required('camera_info', camera.topics.camera_info, finder.candidates['camera_info'])
    return CameraPeople(camera.camera, camera.source, topic, camera.source, info)


def _found_people(camera: BagJob, view: OpenCamera) -> CameraPeople:
    """Return where the people are that the networks have found."""
    topic = f'{IN_SPACE}/detected_poses_3d' if view.topics.in_space else f'{IN_IMAGE}/detected_poses'
    return CameraPeople(camera.camera, camera.output, f'/{camera.camera}{topic}', camera.source,
                        '' if view.topics.in_space else view.topics.camera_info)


def _check_common_time(job: RigJob, topics: Sequence[str]) -> None:
    """Raise BadInputError if a camera was recorded while no other was; topics: one of each camera."""
    spans: Dict[str, Tuple[float, float]] = {}  # first stamp and end of the bag by the common clock [s]
    for camera, topic in zip(job.cameras, topics):
        with open_bag(camera.source) as bag:
            first = next(stamped_messages(bag, [topic]))
            begin = 1e-9 * ((first.stamp or first.time) + job.clock_offset(camera.camera))
            end = bag.get_end_time()  # rosbag takes the last chunk for the newest, which it need not be
            later = stamped_messages(bag, [topic], genpy.Time.from_sec(end))
            spans[camera.camera] = begin, begin + max([end, *(1e-9 * one.time for one in later)]) - 1e-9 * first.time
    for name, (begin, end) in spans.items():
        others = [span for other, span in spans.items() if other != name]
        if others and not any(begin <= last and first <= end for first, last in others):
            texts = ', '.join(f'{each} {first:.3f} to {last:.3f} s' for each, (first, last) in spans.items())
            raise BadInputError(f'{name} was recorded while no other camera was: {texts}; --clock-offset, or the rig, '
                                'says by which time clocks differ')


def _fuse(job: RigJob, people: Sequence[CameraPeople], settings: BagSettings, outputs: Tuple[Path, Any],
          stack: ExitStack) -> RigReport:
    """Write the fused people; outputs: bag, and table or None."""
    fusion, numbers = Fusion(job, people, stack), itertools.count()
    report = RigReport({}, fusion.used, fusion.left_out)
    with ExitStack() as inner:
        table = None if outputs[1] is None else inner.enter_context(
            PeopleTable(outputs[1], job.cameras[0].csv_layout, 3))
        bag = inner.enter_context(new_bag(outputs[0]))
        writer = PeopleWriter(bag, f'/{FUSED}{IN_SPACE}', settings, table, job.cameras[0].markers,
                              ON_FLOOR if job.cameras[0].signals else None)
        for fused in Progress(fusion, 'fusion', unit='frame'):
            header = Header(next(numbers), genpy.Time(0, fused.stamp), job.fixed_frame)
            writer.write(fused.people, header, genpy.Time(0, fused.time))
            report.frames += 1
            report.people += len(fused.people)
    if report.frames == 0:
        raise BadInputError(f'nothing could be fused: {report.text()}')
    return report


class _Content(NamedTuple):
    """Messages that go into the output."""

    path: Path  # of their bag
    topics: Dict[str, str]  # by their names in it those in the output
    shift: int  # is added to the times of recording [ns]

    def messages(self, bag: rosbag.Bag) -> Iterator[StampedMessage]:
        """Yield them as they are in the output, in the order of their times."""
        for stored in stamped_messages(bag, list(self.topics)):
            topic = self.topics[stored.topic]
            yield stored._replace(topic=topic, time=stored.time + self.shift,
                                  connection={**stored.connection, 'topic': topic})


def _merge(job: RigJob, people: Sequence[CameraPeople], fused: Path, copied: Dict[Path, Dict[str, str]],
           output: Tuple[Path, Dict[str, Any]]) -> None:
    """Write the output: the people of the cameras, the fused ones, and what is copied."""
    contents = []
    for one in people:
        root = one.topic[:one.topic.index(IN_IMAGE)]
        with open_bag(one.bag) as bag:
            topics = {topic: f'/{one.name}{topic[len(root):]}' for topic in topic_types(bag)
                      if is_within(topic, f'{root}{IN_IMAGE}') and topic != RECORD}
        contents.append(_Content(one.bag, topics, job.time_shift(one.name)))
    with open_bag(fused) as bag:
        contents.append(_Content(fused, {topic: topic for topic in topic_types(bag)}, 0))
    cameras = {camera.source: camera.camera for camera in job.cameras}
    contents += [_Content(source, topics, job.time_shift(cameras[source])) for source, topics in copied.items()]
    with ExitStack() as stack:
        made = stack.enter_context(new_bag(output[0], job.cameras[0].compression, job.cameras[0].mcap))
        streams = [one.messages(stack.enter_context(open_bag(one.path))) for one in contents]
        for number, stored in enumerate(heapq.merge(*streams, key=lambda stored: stored.time)):
            time = genpy.Time(0, stored.time)
            if number == 0:
                record(made, output[1], time)
                _write_rig(job, made, time)
            made.write(stored.topic, stored.raw, time, raw=True, connection_header=stored.connection)


def _write_rig(job: RigJob, bag: rosbag.Bag, time: genpy.Time) -> None:
    """Write where the cameras stand, if the rig says so."""
    if job.rig is None:
        return
    transforms = []
    for camera in job.cameras:
        stands = job.rig.camera(camera.camera)
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = stands.pose
        transforms.append(transform_from_matrix(matrix, Header(stamp=time, frame_id=job.fixed_frame), stands.frame_id))
    write_static_transforms(bag, transforms, time, 'process_bag')


def _copied(job: RigJob, source: Path) -> Dict[str, str]:
    """Return the topics of a bag that are copied, and their names in the output.

    Of several bags they are in the namespaces of the cameras, but for tf. Without a rig tf is copied in any case.
    """
    name = next(camera.camera for camera in job.cameras if camera.source == source)
    with open_bag(source) as bag:
        copied = copied_topics(bag, job.cameras[0].copied)
        if job.rig is None:
            copied += [topic for topic in topic_types(bag) if topic in TF_TOPICS and topic not in copied]
    alone = len(job.sources) > 1
    return {topic: f"/{name}/{topic.strip('/')}" if alone and topic not in TF_TOPICS and not is_within(topic, name)
            else topic for topic in copied}

"""Report from a recording with all topics the delay of each frame at each stage: camera, 2D, 3D, markers.

A stage's delay is the time from header.stamp, which the camera driver sets, to the moment at which rosbag recorded the
message. Topics are grouped by the namespace of the results; camera topics are found by their stamps. No master is
needed.

    rosbag record -O live.bag -e '/kinect2/qhd/(image_color|image_depth_rect)' \\
        '/openpose_ros/(.*/)?(detected|visualization)_.*'

Recording clouds, and input_rgb and input_pointcloud of the extractor, loads machine and disk, and slows down what is
measured.

    rosrun openpose_ros_tools time_report live.bag
    rosrun openpose_ros_tools time_report live.bag -o report/
    rosrun openpose_ros_tools time_report live.bag -o report/ --start 10 --end 70 --format pdf

The tables are printed. FOLDER of -o gets them as time_report.md, all delays as delays.csv, the figures as summary.json,
and plots of the delays over time and of their distribution, per namespace.

Exit status: 0 done; 2 nothing was done, as the command line or the bag is wrong; 130 interrupted.
"""
import argparse
import csv
import io
import json
import re
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import genpy
from tqdm import tqdm

from openpose_ros_pkg.command_line import DONE, run_command
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.output.files import check_outputs, writable_folder
from openpose_ros_tools.command_options import add_time_span, check_time_span, command_parser
from openpose_ros_tools.delays import stage_delays as roles
from openpose_ros_tools.delays.delay_plots import delay_distribution, delays_over_time
from openpose_ros_tools.delays.delay_report import CSV_COLUMNS, csv_rows, markdown, summary
from openpose_ros_tools.delays.stage_delays import Chain, Stage, build_chains, cameras_of_none
from openpose_ros_tools.outputs import PartFiles, files_of
from openpose_ros_tools.plots.plotting import FORMATS, save_figure
from openpose_ros_tools.ros.bag_files import StampedMessage, deserialized, open_bag, stamped_messages, topic_types
from openpose_ros_tools.ros.camera_topics import CLOUD, COMPRESSED, IMAGE, is_depth, is_packed_depth, raw_topic

_PEOPLE = {f'openpose_ros_msgs/{kind}{array}': role for kind, role in (
    ('PersonDetection', roles.PEOPLE_2D), ('PersonDetection_3d', roles.PEOPLE_3D)) for array in ('', 'Array')}
# Topics of the nodes beside those of people, by the last part of their name.
_OTHERS = {'input_image': roles.TAKEN, 'input_rgb': roles.TAKEN, 'input_pointcloud': roles.TAKEN,
           'visualization_markers': roles.MARKERS, 'visualization_skeleton': roles.MARKERS,
           'detected_poses_image': roles.DRAWN}
_CAMERA = {IMAGE: roles.IMAGE, COMPRESSED: roles.IMAGE, 'theora_image_transport/Packet': roles.IMAGE,
           CLOUD: roles.CLOUD}
_CLOCK = 'rosgraph_msgs/Clock'
# Files of a report.
_REPORT, _DELAYS, _SUMMARY = 'time_report.md', 'delays.csv', 'summary.json'
_PLOTS = {'delays_over_time': delays_over_time, 'delay_distribution': delay_distribution}


@dataclass
class _Topic:
    """Stamps and arrivals of a topic; the namespace of camera topics is empty."""

    role: str
    namespace: str
    frame_id: str = ''
    stamps: List[int] = field(default_factory=list)
    arrivals: List[int] = field(default_factory=list)


@dataclass(frozen=True)
class Recording:
    """The stages of a bag."""

    results: Dict[str, Tuple[Stage, ...]]  # stages of the nodes, by namespace
    cameras: Tuple[Stage, ...]  # stages of the cameras
    simulated: bool  # it holds a simulated clock
    without_header: Tuple[str, ...]  # topics of people whose messages have no header, as those of the original project


def read_recording(path: Path, start: Optional[float] = None, end: Optional[float] = None,
                   cameras: Sequence[str] = ()) -> Recording:
    """Read the stamps in the headers of a bag.

    Args:
        start, end: part of the bag to be read [s] since its beginning; None: all.
        cameras: camera topics that count; none: all that are there.

    Raises:
        BadInputError: it can not be read, or has no results of the nodes.
    """
    with open_bag(path) as bag:
        info = bag.get_type_and_topic_info().topics
        types = topic_types(bag)
        topics = _find_topics(types, cameras, path)
        limits = [None if offset is None else genpy.Time.from_sec(max(bag.get_start_time() + offset, 0.0))
                  for offset in (start, end)] if info else [None, None]
        total = sum(info[name].message_count for name in topics) if start is None and end is None else None
        without_header = set()
        for message in tqdm(stamped_messages(bag, list(topics), *limits), total=total, unit=' messages', leave=False,
                            disable=None):
            topic = topics[message.topic]
            if message.stamp is None:
                without_header.add(message.topic)
                continue
            if not topic.stamps:
                topic.frame_id = message.frame_id
                if topic.role == roles.IMAGE and _is_depth(message):
                    topic.role = roles.DEPTH
            topic.stamps.append(message.stamp)
            topic.arrivals.append(message.time)
    stages: Dict[str, List[Stage]] = {}
    for name, topic in topics.items():
        if topic.stamps:
            stages.setdefault(topic.namespace, []).append(
                Stage.of_messages(name, topic.role, topic.stamps, topic.arrivals, topic.frame_id))
    camera_stages = tuple(stages.pop('', []))
    if not stages:
        raise BadInputError(_no_results(path, types, sorted(without_header)))
    simulated = any(topic.msg_type == _CLOCK for topic in info.values())
    return Recording({name: tuple(found) for name, found in stages.items()}, camera_stages, simulated,
                     tuple(sorted(without_header)))


def _find_topics(types: Dict[str, str], cameras: Sequence[str], path: Path) -> Dict[str, _Topic]:
    """Return the topics that are stages, results first.

    Args:
        types: of the messages, by topic.

    Raises:
        BadInputError: a camera topic that was asked for is not there.
    """
    own = {space for space in map(_namespace, types) if re.search('(^|/)openpose_ros(/skeleton_3d)?$', space)}
    spaces = own | {_namespace(name) for name, kind in types.items() if kind in _PEOPLE}
    results, images = {}, {}
    for name, kind in sorted(types.items(), key=lambda item: (not item[1].endswith('Array'), item[0])):
        space, last = _namespace(name), raw_topic(name).rpartition('/')[2]
        if kind in _PEOPLE:
            results[name] = _Topic(_PEOPLE[kind], space)
        elif last in _OTHERS and space in spaces:
            results[name] = _Topic(_OTHERS[last], space)
        elif kind in _CAMERA and space not in own:
            images[name] = _Topic(_CAMERA[kind], '')
    for name in cameras:
        if name not in images:
            raise BadInputError(f'{path} has no camera topic {name}; it has: {", ".join(images) or "none"}')
    return {**results, **{name: topic for name, topic in images.items() if not cameras or name in cameras}}


def _namespace(topic: str) -> str:
    """Return what is before the last part of a topic's name, '/' of one in the root namespace."""
    return raw_topic(topic).rpartition('/')[0] or '/'


def _is_depth(message: StampedMessage) -> bool:
    """Return whether the images of a topic are depth, by its first message."""
    if message.raw[0] == IMAGE:
        return is_depth(message.topic, deserialized(message).encoding)
    return is_packed_depth(message.topic)


def _no_results(path: Path, types: Dict[str, str], without_header: Sequence[str]) -> str:
    if without_header:
        return (f'{path}: the messages on {", ".join(sorted(without_header))} have no header, as those of the original '
                'project: without a stamp no delay can be told')
    there = ', '.join(f'{name} ({kind})' for name, kind in sorted(types.items())) or 'none'
    return (f'{path} has no results of the nodes in the part that was read (openpose_ros_msgs, or topics below '
            f'openpose_ros/); its topics: {there}')


def write_report(folder: Path, text: str, chains: Sequence[Chain], kind: str) -> List[str]:
    """Write tables, delays, figures and plots into a folder, all at once, in place of an older report.

    Args:
        text: the report in Markdown.
        kind: one of FORMATS.

    Returns:
        The names of the files.
    """
    rows = io.StringIO()
    csv.writer(rows, lineterminator='\n').writerows([CSV_COLUMNS, *(row for one in chains for row in csv_rows(one))])
    values = json.dumps({'chains': [summary(chain) for chain in chains]}, indent=2) + '\n'
    with PartFiles() as parts:
        part, plots = parts.folder(folder, _is_of_report), []
        for chain in chains:
            suffix = '' if len(chains) == 1 else '_' + (chain.namespace.strip('/').replace('/', '_') or 'root')
            if chain.is_live:
                plots += [save_figure(draw(chain), part / f'{name}{suffix}.{kind}') for name, draw in _PLOTS.items()]
        links = ''.join(f'\n![{path.stem}]({path.name})\n' for path in plots)
        for name, content in ((_REPORT, text + links), (_DELAYS, rows.getvalue()), (_SUMMARY, values)):
            (part / name).write_text(content, encoding='utf-8')
    return [_REPORT, _DELAYS, _SUMMARY, *(path.name for path in plots)]


def _is_of_report(name: str) -> bool:
    stem, _, kind = name.rpartition('.')
    return name in (_REPORT, _DELAYS, _SUMMARY) or (stem.startswith(tuple(_PLOTS)) and kind in FORMATS)


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    check_time_span(parser, options)
    return run_command('time_report', lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    folder = None
    if options.output:
        check_outputs(files_of(options.output, _is_of_report), options.overwrite)
        folder = writable_folder('output', options.output)
    recording = read_recording(options.bag, options.start, options.end, options.camera)
    chains = build_chains(recording.results, recording.cameras, recording.simulated, options.counted_from)
    text = report_text(options.bag.name, recording, chains)
    sys.stdout.write(text)
    if folder is not None:
        try:
            files = write_report(folder, text, chains, options.format)
        except OSError as error:
            raise ParameterError(f'can not write into {folder}: {error.strerror or error}') from error
        sys.stderr.write(''.join(f'{folder / name}\n' for name in files))
    return DONE


def report_text(name: str, recording: Recording, chains: Sequence[Chain]) -> str:
    """Return the whole report in Markdown."""
    notes = [f'Note: no result has the stamps of {stage.topic}: left out.'
             for stage in cameras_of_none(recording.results, recording.cameras)]
    notes += [f'Note: the messages on {topic} have no header: left out.' for topic in recording.without_header]
    return '\n\n'.join([f'# Time report of {name}', *notes, *map(markdown, chains)])


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('time_report', __doc__)
    parser.add_argument('bag', type=Path, help='bag with the topics of camera and nodes, recorded live')
    parser.add_argument('-o', '--output', type=Path, metavar='FOLDER', help='write tables, delays and plots here')
    parser.add_argument('--overwrite', action='store_true', help='replace the report that is there')
    add_time_span(parser, 'the beginning of the bag')
    parser.add_argument('--camera', action='append', default=[], metavar='TOPIC',
                        help='a camera topic that counts; may be repeated (default: all with the stamps of results)')
    parser.add_argument('--from', choices=('auto', 'stamp', 'arrival'), default='auto', dest='counted_from',
                        help="where delays begin: at the stamp, or when the frame's first camera message was recorded; "
                             'auto: at the stamp, unless the clocks differ')
    parser.add_argument('--format', choices=FORMATS, default='png', help='of the plots (default: %(default)s)')
    return parser

"""Show a recording on one page of HTML: its people, their paths, postures and gestures.

The page needs nothing else: no network, no script; plots and crops are within it. It shows the people (times, share of
measured joints, stature), crops of them, their postures, gestures and falls over time, their paths from above, and the
topics of the recording. No master is needed.

    rosrun openpose_ros_tools process_bag walk.bag -o people.bag --signals
    rosrun openpose_ros_tools report people.bag --images walk.bag
    rosrun openpose_ros_tools report live.bag -o report.html

Signals are those of the topic people_signals beside the people; where a recording has none, they are computed from
the joints, with that axis upwards along which people are most of the time, or --up. What a recording lacks (results,
points, images) is named on the page.

Exit status: 0 done; 2 nothing was written, as the command line or the recording is wrong; 130 interrupted, there is no
page.
"""
import argparse
import logging
import sys
from pathlib import Path
from typing import List, Optional, Sequence, Tuple

import genpy
import numpy as np
import rosbag

from openpose_ros_pkg.command_line import DONE, run_command
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.convert import any_image_to_bgr
from openpose_ros_tools.command_options import add_up, check_up, command_parser, whole_number
from openpose_ros_tools.outputs import output_file
from openpose_ros_tools.recording_paths import is_bag
from openpose_ros_tools.report.crops import Thumbnail, choose_crops, cut
from openpose_ros_tools.report.page import RecordingFacts, ReportFacts, TopicFacts, empty_frames, page
from openpose_ros_tools.ros.bag_files import deserialized, end_time, open_bag, stamped_messages, topic_types
from openpose_ros_tools.ros.camera_topics import TopicFinder
from openpose_ros_tools.ros.keypoints.keypoint_bag import (
    DIMENSIONS,
    choose_topic,
    read_keypoint_bag,
    read_keypoints,
    read_timeline,
)
from openpose_ros_tools.tables.keypoint_selection import moment_text, select

# People on the page: those with most rows; a long recording of a street has thousands.
_MOST_PERSONS = 30
_COMPUTED = 'Postures and gestures are computed from the joints, not read from the recording.'
_NO_RESULTS = ('No people are in this recording, as it holds no results. To compute them: rosrun openpose_ros_tools '
               'process_bag {} -o people.bag --signals')


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    parser = command_parser('report', __doc__)
    parser.add_argument('recording', type=Path, metavar='BAG', help='a bag, or a recording of ROS 2')
    parser.add_argument('-o', '--output', type=Path, metavar='FILE',
                        help='page to write (default: that of the recording, with the suffix .html)')
    parser.add_argument('--overwrite', action='store_true', help='replace the page if it is there')
    parser.add_argument('--topic', help='of the people (default: the only one, in space before in the image)')
    parser.add_argument('--images', type=Path, metavar='BAG',
                        help='recording with the images, where that of the results has none')
    parser.add_argument('--image', default='', metavar='TOPIC', help='colour images, raw or compressed')
    parser.add_argument('--crops', type=whole_number(0), default=2, metavar='N',
                        help='images of each person (default: %(default)s)')
    add_up(parser)
    options = parser.parse_args(arguments)
    check_up(parser, options)
    return run_command('report', lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    recording: Path = options.recording
    for path in filter(None, (recording, options.images)):
        if not path.exists():
            raise BadInputError(f'{path}: there is no such file')
        if not is_bag(path):
            raise BadInputError(f'{path} is neither a bag nor a recording of ROS 2')
    output = options.output or recording.with_name(f'{recording.name.partition(".")[0]}.html')
    with output_file(output, options.overwrite, [recording]) as part:
        part.write_text(_report(options), encoding='utf-8')
    sys.stdout.write(f'{output}\n')
    return DONE


def _report(options: argparse.Namespace) -> str:
    """Return the page."""
    with open_bag(options.recording) as bag:
        recording = _facts(options.recording, bag)
        has_people = not set(DIMENSIONS).isdisjoint(topic_types(bag).values())
    if options.topic is None and not has_people:
        return page(ReportFacts(recording, notes=(_NO_RESULTS.format(options.recording.name),)))
    table, frames = read_keypoints(options.recording, options.topic)
    if not len(table):
        count = None if frames is None else len(np.unique(frames))
        return page(ReportFacts(recording, count or 0, count, notes=('No people were found.',)))
    ids, rows = np.unique(table.ids, return_counts=True)
    shown = sorted(ids[np.argsort(-rows, kind='stable')][:_MOST_PERSONS].tolist())
    selection = select(table, frames, persons=shown)
    notes: List[str] = []
    if len(ids) > len(shown):
        notes.append(f'{len(ids)} ids are in it; the page shows the {len(shown)} with most frames.')
    timeline = None
    if table.dimensions == 3:
        timeline, recorded = read_timeline(options.recording, table, options.topic, options.up)
        notes += [] if recorded else [_COMPUTED]
    else:
        notes.append('The people are known in the image alone: there are no statures, postures and gestures.')
    crops, note = _crops(options, shown)
    notes += [note] if note else []
    return page(ReportFacts(recording, len(selection.frames), empty_frames(selection), selection, timeline,
                            tuple(notes)), crops)


def _facts(path: Path, bag: rosbag.Bag) -> RecordingFacts:
    """Return the facts of a recording."""
    files = [path] if path.is_file() else [file for file in path.rglob('*') if file.is_file()]
    size = sum(file.stat().st_size for file in files)
    topics = bag.get_type_and_topic_info().topics
    if not any(info.message_count for info in topics.values()):
        return RecordingFacts(path.name, size, 'an unknown time, without messages', 0.0, ())
    begin = float(bag.get_start_time())
    duration = end_time(bag) - begin
    return RecordingFacts(path.name, size, moment_text(round(begin * 1e9)), duration, tuple(
        TopicFacts(name, info.msg_type, info.message_count, info.message_count / duration if duration > 0 else 0.0)
        for name, info in sorted(topics.items())))


def _crops(options: argparse.Namespace, persons: Sequence[int]) -> Tuple[List[Thumbnail], str]:
    """Return crops of the people, and the reason why there are none."""
    if not options.crops:
        return [], ''
    try:
        found = _thumbnails(options, persons)
    except BadInputError as error:
        if options.images or options.image:
            raise
        logging.getLogger(__name__).warning('there are no images of the people: %s', error)
        return [], f'There are no images of the people: {error}. --images names a recording with images.'
    return found, '' if found else 'There are no images of the people: none has the stamp of a frame with people.'


def _thumbnails(options: argparse.Namespace, persons: Sequence[int]) -> List[Thumbnail]:
    """Return crops of people out of the images of a recording, which pass one by one.

    Raises:
        BadInputError: there are no keypoints in the image, or no images, or several topics come into question.
    """
    people: Path = options.recording
    images: Path = options.images or people
    with open_bag(people) as bag:
        in_image = {name: kind for name, kind in topic_types(bag).items() if DIMENSIONS.get(kind) == 2}
        topic = choose_topic(in_image, f'{people.name}, keypoints in the image', None).name
    table = read_keypoint_bag(people, topic)
    with open_bag(images) as bag:
        finder = TopicFinder(bag)
        if not options.image and not finder.candidates['colour']:
            raise BadInputError(f'{images.name} has no topic of colour images')
        chosen = finder.required('colour', options.image, finder.candidates['colour'])
        # images may have been recorded at a lower rate than people
        times = {message.stamp or 0: genpy.Time(0, message.time) for message in stamped_messages(bag, [chosen])}
        there = table.select(np.isin(table.stamps, list(times)))
        found: List[Thumbnail] = []
        for stamp, crops in choose_crops(there, persons, options.crops).items():
            for message in stamped_messages(bag, [chosen], times[stamp], times[stamp]):
                if message.stamp == stamp:
                    bgr = any_image_to_bgr(deserialized(message))
                    found += [cut(bgr, crop) for crop in crops]
                    break
    return found

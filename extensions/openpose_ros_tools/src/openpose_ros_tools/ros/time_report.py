"""Report the rate of each topic in a recording, and its delay: from header.stamp, which the camera driver sets, to the
moment at which rosbag recorded the message.

    rosbag record -O live.bag -e '/kinect2/qhd/(image_color|image_depth_rect)' \\
        '/openpose_ros/(.*/)?(detected|visualization)_.*'

Recording clouds, and input_rgb and input_pointcloud of the extractor, loads machine and disk, and slows down what is
measured.

    rosrun openpose_ros_tools time_report live.bag
    rosrun openpose_ros_tools time_report live.bag -o delays.csv --start 10 --end 70
    rosrun openpose_ros_tools time_report live.bag --topic /kinect2/qhd/image_color \\
        --topic /openpose_ros/skeleton_3d/detected_poses_3d

Messages with one stamp, as one for each person, are one frame, which has arrived with the last of them. Topics are in
the order of their median delay: the difference of two is what lies between them.

Exit status: 0 done; 2 nothing was done, as the command line or the bag is wrong; 130 interrupted.
"""
import argparse
import sys
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import genpy
import pandas as pd
from tqdm import tqdm

from openpose_ros_pkg.command_line import DONE, run_command
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.files import check_outputs
from openpose_ros_tools.command_options import add_time_span, check_time_span, command_parser
from openpose_ros_tools.outputs import output_file
from openpose_ros_tools.ros.bag_files import open_bag, stamped_messages, topic_types
from openpose_ros_tools.topic_timing import TopicTiming, notes, timing_table, topic_timing


def read_timings(path: Path, topics: Sequence[str] = (), start: Optional[float] = None, end: Optional[float] = None
                 ) -> List[TopicTiming]:
    """Read the stamps and the times of recording of the topics in a bag.

    Args:
        topics: that are read; none: all.
        start, end: part of the bag that is read [s] since its beginning; None: all.

    Raises:
        BadInputError: the bag can not be read, a topic is not there or has several types, or there are no messages.
    """
    with open_bag(path) as bag:
        types = topic_types(bag)
        for topic in topics:
            if topic not in types:
                raise BadInputError(f'{path} has no topic {topic}; it has: {", ".join(sorted(types)) or "none"}')
        for topic in topics or types:
            if ' and ' in types[topic]:
                raise BadInputError(f'{path}: messages on {topic} are of several types: {types[topic]}')
        limits = [None if offset is None else genpy.Time.from_sec(max(bag.get_start_time() + offset, 0.0))
                  for offset in (start, end)] if types else [None, None]
        found: Dict[str, Tuple[List[Optional[int]], List[int]]] = {}
        for message in tqdm(stamped_messages(bag, list(topics or types), *limits), unit=' messages', leave=False,
                            disable=None):
            stamps, arrivals = found.setdefault(message.topic, ([], []))
            stamps.append(message.stamp)
            arrivals.append(message.time)
    if not found:
        raise BadInputError(f'{path} has no messages in the part that was read')
    return [topic_timing(topic, types[topic], *times) for topic, times in found.items()]


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    check_time_span(parser, options)
    return run_command('time_report', lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    if options.output is not None:
        check_outputs([options.output], options.overwrite, [options.bag])
    timings = read_timings(options.bag, options.topic, options.start, options.end)
    table = timing_table(timings)
    if options.output is not None:
        with output_file(options.output, options.overwrite, [options.bag]) as part:
            table.to_csv(str(part), index=False, float_format='%.3f')
    for note in notes(timings):
        sys.stdout.write(f'Note: {note}\n')
    with pd.option_context('display.max_colwidth', 1000):  # which else cuts long names of topics
        sys.stdout.write(table.to_string(index=False, na_rep='-', float_format='{:.3f}'.format) + '\n')
    return DONE


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('time_report', __doc__)
    parser.add_argument('bag', type=Path, help='bag with the topics of camera and nodes, recorded live')
    parser.add_argument('-o', '--output', type=Path, metavar='CSV', help='write the table here as well')
    parser.add_argument('--overwrite', action='store_true', help='replace the file that is there')
    parser.add_argument('--topic', action='append', default=[], metavar='TOPIC',
                        help='a topic that is read; may be repeated (default: all)')
    add_time_span(parser, 'the beginning of the bag')
    return parser

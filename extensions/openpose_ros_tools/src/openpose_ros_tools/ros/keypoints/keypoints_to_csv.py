"""Write the keypoints of a bag, or of a running topic, as CSV: one row per person and frame.

    rosrun openpose_ros_tools keypoints_to_csv recording.bag -o poses.csv
    rosrun openpose_ros_tools keypoints_to_csv recording.bag --extended -o poses.csv
    rosrun openpose_ros_tools keypoints_to_csv recording.bag --tidy -o joints.csv
    rosrun openpose_ros_tools keypoints_to_csv recording.bag --topic /openpose_ros/detected_poses -o poses_2d.csv
    rosrun openpose_ros_tools keypoints_to_csv recording.bag --hands -o hands.csv      # or --faces
    rosrun openpose_ros_tools keypoints_to_csv recording.bag --signals -o signals.csv
    rosrun openpose_ros_tools keypoints_to_csv --live -o poses.csv        # until Ctrl-C; needs a running master

The columns are those of the original project; docs/recordings.md says what each column means. Without --topic, joints
in space come before those in the image, and a topic with one message per person before that with one per frame.

What comes from a running topic is in FILE at once, and stays there; the table of a bag appears when it is complete.

Exit status: 0 done, also when Ctrl-C ends a running topic; 2 an input is wrong or the disk is full; 130 interrupted
before a bag was done, or before there was a topic, and then there is no file.
"""
import argparse
import queue
import sys
import time
from contextlib import suppress
from typing import Any, Callable, Optional, Sequence, TextIO

import rosgraph
import roslib.message
import rospy

from openpose_ros_pkg.command_line import DONE, Progress, run_command
from openpose_ros_pkg.command_options import add_output, command_parser, plain_path
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.files import check_outputs, naming
from openpose_ros_pkg.ros.topics import PARTS, KeypointTopic, choose_topic
from openpose_ros_signals.ros.convert import signals_from_array
from openpose_ros_tools.outputs import output_file
from openpose_ros_tools.ros.bag_files import open_bag, topic_types
from openpose_ros_tools.ros.keypoints import keypoint_bag
from openpose_ros_tools.tables.keypoint_csv import KeypointCsvWriter
from openpose_ros_tools.tables.long_csv import SIGNAL_COLUMNS, LongCsvWriter, landmark_columns, signal_rows

_NAME = 'keypoints_to_csv'
# Writes what is in a message, recorded at a time [ns] or running (None); returns how many rows that are.
Write = Callable[[Any, Optional[int]], int]
# Period in which a topic is looked for that is not there yet, and longest wait for a message of a quiet one [s].
_PAUSE = 0.2


def follow_topic(topic: KeypointTopic, write: Write, bar: Progress) -> int:
    """Write the people of a running topic until Ctrl-C; return how many rows that are."""
    messages: queue.Queue[Any] = queue.Queue()
    subscriber = rospy.Subscriber(topic.name, roslib.message.get_message_class(topic.kind), messages.put)
    rows = 0
    with suppress(KeyboardInterrupt):  # the way to end it
        while not rospy.is_shutdown():
            with suppress(queue.Empty):
                rows += write(messages.get(timeout=_PAUSE), None)
                bar.update()
    subscriber.unregister()
    while not messages.empty():
        rows += write(messages.get(), None)
    return rows


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    parser = _parser()
    options = parser.parse_args(rospy.myargv()[1:] if arguments is None else arguments)
    if options.live and options.bag:
        parser.error('give a bag or --live, not both')
    if not (options.live or options.bag or options.topic):
        parser.error('give a bag, or --live to listen to a running topic')
    if options.time and not options.bag:
        parser.error('--time is for bags; on a running topic %time is the stamp of the header')
    if options.part != 'people' and options.layout == 'extended':
        parser.error('hands, faces and signals have one form alone; give no --extended')
    return run_command(_NAME, lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    if options.bag:
        with open_bag(options.bag) as bag, output_file(options.output, options.overwrite, [options.bag]) as part, \
                part.open('w', newline='', encoding='utf-8') as handle, Progress(unit='message') as bar:
            topic, rows = choose_topic(topic_types(bag), str(options.bag), options.topic, options.part), 0
            write = _writer(handle, topic, options)
            for message, recorded in keypoint_bag.bag_messages(bag, topic.name):
                rows += write(message, None if options.time == 'stamp' else recorded)
                bar.update()
    else:
        check_outputs([options.output], options.overwrite)
        topic = _running_topic(options)
        with naming(options.output), options.output.open('w', newline='', encoding='utf-8', buffering=1) as handle, \
                Progress(unit='message') as bar:
            rows = follow_topic(topic, _writer(handle, topic, options), bar)
    sys.stdout.write(f'{rows} rows of {topic.part} from {topic.name} in {options.output}\n')
    return DONE


def _writer(handle: TextIO, topic: KeypointTopic, options: argparse.Namespace) -> Write:
    if topic.part == 'people':
        people = KeypointCsvWriter(handle, options.layout, topic.dimensions)
        return lambda message, time: people.write(list(keypoint_bag.rows_of(message, topic.dimensions, time)))
    if topic.part == 'signals':
        signals = LongCsvWriter(handle, SIGNAL_COLUMNS)
        return lambda message, time: signals.write(message.header.stamp.to_nsec() or time or 0, signal_rows(
            message.header.frame_id, signals_from_array(message)))
    points = LongCsvWriter(handle, landmark_columns(topic.part, topic.dimensions))
    return lambda message, time: points.write(message.header.stamp.to_nsec() or time or 0, keypoint_bag.landmark_rows(
        message, topic)) if getattr(message, topic.part) else 0


def _running_topic(options: argparse.Namespace) -> KeypointTopic:
    """Return the topic to listen to; wait until it is there."""
    if not rosgraph.is_master_online():
        raise BadInputError(f'there is no ROS master at {rosgraph.get_master_uri()}; start one, or give a bag')
    rospy.init_node(_NAME, anonymous=True, disable_signals=True)
    wanted = rospy.resolve_name(options.topic) if options.topic else None
    sys.stderr.write(f'waiting for {wanted or "a topic with keypoints"}\n')
    before: Optional[KeypointTopic] = None
    while True:
        types = dict(rospy.get_published_topics())
        if wanted in types or (not wanted and set(types.values()) & set(PARTS[options.part])):
            topic = choose_topic(types, 'what is published', wanted, options.part)
            if topic == before:  # twice, as a node that starts announces its topics one after the other
                sys.stderr.write(f'listening to {topic.name}; Ctrl-C ends it\n')
                return topic
            before = topic
        time.sleep(_PAUSE)


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(_NAME, __doc__)
    parser.add_argument('bag', nargs='?', type=plain_path, metavar='BAG', help='a recording')
    add_output(parser, 'file')
    layout = parser.add_mutually_exclusive_group()
    layout.add_argument('--extended', dest='layout', action='store_const', const='extended', default='original',
                        help='the columns of rostopic echo -p: adds header, status, sigma and the other joints')
    layout.add_argument('--tidy', dest='layout', action='store_const', const='tidy',
                        help='the long form: one row per frame, person and joint; joints that are missing have none')
    part = parser.add_mutually_exclusive_group()
    part.add_argument('--hands', dest='part', action='store_const', const='hands', default='people',
                      help='hands in place of people: one row per frame, hand and point')
    part.add_argument('--faces', dest='part', action='store_const', const='faces',
                      help='faces in place of people: one row per frame, face and point')
    part.add_argument('--signals', dest='part', action='store_const', const='signals',
                      help='what people do: one row per frame, person and gesture')
    parser.add_argument('--topic', help='topic to read; without a bag: to listen to')
    parser.add_argument('--live', action='store_true', help='listen to a running topic until Ctrl-C')
    parser.add_argument('--time', choices=('recorded', 'stamp'),
                        help='what %%time is: when the message was recorded, as rostopic echo -p -b has it (default), '
                             "or the camera's stamp, equal for all people of a frame, as on a running topic")
    return parser

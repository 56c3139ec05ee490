"""Show a recording on the page that people_web_node serves live, as one file of HTML with the recording inside.

The page needs no server and no network: people in 3D with what they do, play, pause, speed, a timeline of postures and
gestures, plots of distance, speed and joint angles, and images. No master is needed.

    rosrun openpose_ros_tools process_bag walk.bag -o people.bag --signals
    rosrun openpose_ros_tools report people.bag --images walk.bag
    rosrun openpose_ros_tools report live.bag -o people.html

Signals are those of the topic people_signals beside the people; where a recording has none, they are computed from
the joints, with that axis upwards along which people are most of the time, or --up.

Exit status: 0 done; 2 nothing was written, as the command line or the recording is wrong; 130 interrupted, there is no
page.
"""
import argparse
import logging
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

import genpy
import numpy as np
import rosbag
import rospkg

from openpose_ros_pkg.command_line import DONE, run_command
from openpose_ros_pkg.command_options import add_up, command_parser, plain_path
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.files import jpeg_of
from openpose_ros_pkg.ros.convert import any_image_to_bgr
from openpose_ros_pkg.ros.topics import DIMENSIONS, PARTS, KeypointTopic, choose_topic
from openpose_ros_tools.outputs import output_file
from openpose_ros_tools.report.recording import Recording, facts_of, frames_of
from openpose_ros_tools.ros.bag_files import deserialized, open_bag, stamped_messages, topic_finder, topic_types
from openpose_ros_tools.ros.keypoints.keypoint_bag import bag_messages, keypoints_of, signals_of
from openpose_ros_tools.tables.keypoint_selection import MOST_PERSONS, Selection, select, upwards_of
from openpose_ros_web.recorded_page import recorded_page
from openpose_ros_web.three_js import three_folder
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.ros.convert import camera_from_message, faces_from_array, hands_from_array

# Number of images at most, their width [px], and quality of their JPEG.
_IMAGES, _WIDTH, _QUALITY = 120, 320, 75
_COMPUTED = 'Postures and gestures are computed from the joints, not read from the recording.'
_NO_RESULTS = ('no people are in {0}, as it holds no results. To compute them: rosrun openpose_ros_tools process_bag '
               '{0} -o people.bag --signals')


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    parser = command_parser('report', __doc__)
    parser.add_argument('recording', type=plain_path, metavar='BAG', help='a bag, or a recording of ROS 2')
    parser.add_argument('-o', '--output', type=plain_path, metavar='FILE',
                        help='page to write (default: that of the recording, with the suffix .html)')
    parser.add_argument('--overwrite', action='store_true', help='replace the page if it is there')
    parser.add_argument('--topic', help='of the people in space (default: the only one)')
    parser.add_argument('--images', type=plain_path, metavar='BAG',
                        help='recording with the images, where that of the results has none')
    parser.add_argument('--image', default='', metavar='TOPIC', help='colour images, where there are several')
    add_up(parser)
    return run_command('report', lambda: _run(parser.parse_args(arguments)))


def _run(options: argparse.Namespace) -> int:
    recording: Path = options.recording
    www, three = Path(rospkg.RosPack().get_path('openpose_ros_web')) / 'www', three_folder()
    output = options.output or recording.with_name(f'{recording.name if recording.is_dir() else recording.stem}.html')
    with output_file(output, options.overwrite, [*filter(None, (recording, options.images))]) as part:
        read = _read(options)
        part.write_text(recorded_page(recording.name, facts_of(read), frames_of(read), www, three), encoding='utf-8')
    sys.stdout.write(f'{output}\n')
    return DONE


def _read(options: argparse.Namespace) -> Recording:
    """Return what the page shows."""
    path: Path = options.recording
    with open_bag(path) as bag:
        types = topic_types(bag)
        if options.topic is None and set(DIMENSIONS).isdisjoint(types.values()):
            raise BadInputError(_NO_RESULTS.format(path.name))
        topic = choose_topic(types, str(path), options.topic)
        if topic.dimensions != 3:
            raise BadInputError(f'{path.name} has people in the image alone, expected people in space; plot_keypoints '
                                'draws the former')
        table, frames = keypoints_of(bag, topic)
        selection = select(table, frames)
        signals, recorded = signals_of(bag, topic, table, options.up)
        landmarks = _landmarks(bag, topic)
    notes = [] if recorded else [_COMPUTED]
    if selection.left_out:
        notes.append(f'The page shows the {MOST_PERSONS} people with most frames, not {selection.left_out} others.')
    recording = Recording(path.name, selection.first_moment, selection, signals, upwards_of(table, options.up),
                          tuple(notes), landmarks=landmarks)
    return _with_images(recording, options)


def _landmarks(bag: rosbag.Bag, topic: KeypointTopic) -> Dict[int, Dict[str, Any]]:
    """Return 'hands' and 'faces' beside the people of a topic, by their stamp [ns]."""
    found: Dict[int, Dict[str, Any]] = {}
    types = topic_types(bag)
    for part, read in (('hands', hands_from_array), ('faces', faces_from_array)):
        name = f'{topic.namespace}/detected_{part}_3d'
        for message, _ in bag_messages(bag, name) if PARTS[part].get(types.get(name, '')) == 3 else ():
            found.setdefault(message.header.stamp.to_nsec(), {})[part] = read(message)
    return found


def _with_images(recording: Recording, options: argparse.Namespace) -> Recording:
    """Return the recording with images, or with the reason why there are none."""
    try:
        found, camera = _thumbnails(options, recording.selection)
        note = '' if found else 'There are no images: none has the stamp of a frame.'
    except BadInputError as error:
        if options.images or options.image:
            raise
        logging.getLogger(__name__).warning('there are no images: %s', error)
        found, camera, note = [], None, f'There are no images: {error}. --images names a recording with images.'
    return replace(recording, thumbnails=tuple(found), camera=camera,
                   notes=(*recording.notes, *([note] if note else [])))


def _thumbnails(options: argparse.Namespace, selection: Selection
                ) -> Tuple[List[Tuple[int, bytes]], Optional[CameraModel]]:
    """Return images of frames, evenly over time, and their camera if people are in its frame; BadInputError: none."""
    images: Path = options.images or options.recording
    with open_bag(images) as bag:
        finder = topic_finder(bag)
        if not options.image and not finder.candidates['colour']:
            raise BadInputError(f'{images.name} has no topic of colour images')
        topic = finder.required('colour', options.image, finder.candidates['colour'])
        # images may have been recorded at a lower rate than people
        times = {message.stamp: genpy.Time(0, message.time) for message in stamped_messages(bag, [topic])}
        there = sorted({*selection.frames.tolist()} & {*times})
        chosen = np.unique(np.linspace(0, len(there) - 1, min(_IMAGES, len(there))).round().astype(int))
        taken = [(message.stamp or 0, jpeg_of(any_image_to_bgr(deserialized(message)), _QUALITY, _WIDTH))
                 for stamp in (there[index] for index in chosen)
                 for message in stamped_messages(bag, [topic], times[stamp], times[stamp]) if message.stamp == stamp]
        calibration = finder.camera_info_of(topic)
        first = next(bag_messages(bag, calibration), None) if taken and calibration else None
        return taken, (camera_from_message(first[0]) if first and first[0].header.frame_id == selection.frame_id
                       else None)

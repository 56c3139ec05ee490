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
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.command_line import DONE, run_command
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.command_options import add_up, check_up, command_parser, whole_number
from openpose_ros_tools.outputs import output_file
from openpose_ros_tools.plots import keypoint_plots, signal_plots
from openpose_ros_tools.plots.plotting import figure_content
from openpose_ros_tools.recording_paths import is_bag
from openpose_ros_tools.report.crops import Thumbnail
from openpose_ros_tools.report.facts import ReportFacts, empty_frames, people_facts
from openpose_ros_tools.report.page import page
from openpose_ros_tools.ros.keypoints.keypoint_bag import read_keypoints, read_timeline
from openpose_ros_tools.ros.report.reading import has_people, read_thumbnails, recording_facts
from openpose_ros_tools.tables.keypoint_selection import Selection, select
from openpose_ros_tools.tables.signal_timeline import SignalTimeline

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
    recording = recording_facts(options.recording)
    if options.topic is None and not has_people(options.recording):
        return page(ReportFacts(recording, notes=(_NO_RESULTS.format(options.recording.name),)), {})
    table, frames = read_keypoints(options.recording, options.topic)
    if not len(table):
        count = 0 if frames is None else len(np.unique(frames))
        return page(ReportFacts(recording, (), None, None, count, None if frames is None else count,
                                ('No people were found.',)), {})
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
    facts = ReportFacts(recording, people_facts(selection, timeline), selection, timeline, len(selection.frames),
                        empty_frames(selection), tuple(notes))
    return page(facts, _plots(selection, timeline), crops)


def _plots(selection: Selection, timeline: Optional[SignalTimeline]) -> Dict[str, bytes]:
    if timeline is None:
        figures = {'image_paths': keypoint_plots.image_paths(selection)}
    else:
        figures = {'signals': signal_plots.signals(selection, timeline),
                   'top_view': keypoint_plots.top_view(selection)}
    return {name: figure_content(figure, 'svg') for name, figure in figures.items()}


def _crops(options: argparse.Namespace, persons: Sequence[int]) -> Tuple[List[Thumbnail], str]:
    """Return crops of the people, and the reason why there are none."""
    if not options.crops:
        return [], ''
    try:
        found = read_thumbnails(options.recording, options.images or options.recording, options.image, persons,
                                options.crops)
    except BadInputError as error:
        if options.images or options.image:
            raise
        logging.getLogger(__name__).warning('there are no images of the people: %s', error)
        return [], f'There are no images of the people: {error}. --images names a recording with images.'
    return found, '' if found else 'There are no images of the people: none has the stamp of a frame with people.'

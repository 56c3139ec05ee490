"""Plot the people in a recording: their paths, and which joints were measured when.

FILE is a CSV of keypoints (of keypoints_to_csv, process_bag or `rostopic echo -p`) or a bag with the results of the
nodes, in space or in the image. No master is needed. The plots in FOLDER:

    detections             marks of frames and people over time, rates, number of people in view
    signals                of people in space: postures and gestures over time, walking, falls
    top_view               paths of the people from above (of keypoints in the image: image_paths)
    trajectory_JOINT       coordinates of a joint over time
    visibility_person_ID   when each joint was measured, inferred or missing
    trajectory_POINT       with --hand-points, of a bag: coordinates of points of the hands over time, and no other plot

    rosrun openpose_ros_tools plot_keypoints poses.csv --list
    rosrun openpose_ros_tools plot_keypoints poses.csv -o plots/
    rosrun openpose_ros_tools plot_keypoints recording.bag -o plots/ --joints right_wrist,left_wrist --persons 0,2
    rosrun openpose_ros_tools plot_keypoints recording.bag -o plots/ --hand-points right_hand_index_4
    rosrun openpose_ros_tools plot_keypoints recording.bag -o plots/ --start 12 --end 20 --format pdf

Signals are those of the topic people_signals beside the people; where a recording has none, they are computed from the
joints, with that axis upwards along which people are most of the time, or --up.

Exit status: 0 done; 2 nothing was done, as the command line or the file is wrong; 130 interrupted, the finished plots
are complete.
"""
import argparse
import logging
import re
import sys
from functools import partial
from typing import Callable, List, Optional, Sequence, Tuple

from matplotlib.figure import Figure

from openpose_ros_pkg.command_line import DONE, Progress, run_command
from openpose_ros_pkg.command_options import add_up, checked, command_parser, plain_path, seconds
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.output.files import check_outputs, writable_folder
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.outputs import files_of
from openpose_ros_tools.plots import keypoint_plots, signal_plots
from openpose_ros_tools.plots.plotting import FORMATS, save_figure
from openpose_ros_tools.recording_paths import is_bag
from openpose_ros_tools.ros.keypoints.keypoint_bag import (
    HAND_JOINTS,
    read_keypoint_bag,
    read_keypoints,
    read_signals,
)
from openpose_ros_tools.tables.keypoint_selection import Selection, description, select
from openpose_ros_tools.tables.signal_timeline import SignalTimeline, timeline_of

_log = logging.getLogger(__name__)

# Names of plots of a joint or a person: with --overwrite those of a former recording are deleted.
_OF_PEOPLE = r'(trajectory_\w+|visibility_person_\d+)\.'
# Joints whose trajectories are plotted by default.
_TRAJECTORIES = ('nose', 'neck', 'right_wrist', 'left_wrist', 'right_ankle', 'left_ankle')


def trajectories(selection: Selection, joints: Sequence[str]) -> List[Tuple[str, Callable[[], Figure]]]:
    """Return the names of the plots of some joints, and what draws each of them."""
    return [(f'trajectory_{joint}', partial(keypoint_plots.trajectory, selection, joint)) for joint in joints]


def plots(selection: Selection, joints: Sequence[str], timeline: Optional[SignalTimeline]
          ) -> List[Tuple[str, Callable[[], Figure]]]:
    """Return the names of the plots, and what draws each of them; timeline: of people in space."""
    paths = keypoint_plots.top_view if selection.table.dimensions == 3 else keypoint_plots.image_paths
    found: List[Tuple[str, Callable[[], Figure]]] = [('detections', partial(keypoint_plots.detections, selection)),
                                                     (paths.__name__, partial(paths, selection))]
    if timeline is not None:
        found.append(('signals', partial(signal_plots.signals, selection, timeline)))
    found += trajectories(selection, joints)
    for person in selection.persons:
        found.append((f'visibility_person_{person}', partial(keypoint_plots.visibility, selection, person)))
    return found


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.output is None and not options.list:
        parser.error('give -o FOLDER for the plots, or --list')
    if None not in (options.start, options.end) and options.start >= options.end:
        parser.error('--start must be less than --end')
    return run_command('plot_keypoints', lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    if options.hand_points:
        if not is_bag(options.file):
            raise BadInputError(f'{options.file}: --hand-points are for bags')
        table, frames, joints = read_keypoint_bag(options.file, options.topic, 'hands'), None, options.hand_points
    else:
        table, frames = read_keypoints(options.file, options.topic)
        joints = None if options.joints in (None, ['all']) else options.joints
    try:
        selection = select(table, frames, joints, options.persons, options.start, options.end)
    except BadInputError as error:
        raise BadInputError(f'{options.file}: {error}') from error
    if options.list:
        sys.stdout.write(description(options.file.name, selection))
    if options.output is None:
        return DONE
    folder = writable_folder('output', options.output)
    if len(set(selection.all_people.frame_ids.tolist())) > 1:
        _log.warning('the people are in several frames of reference (%s), which are drawn as one',
                     selection.frame_id)
    if selection.left_out:
        _log.warning('%d people with few rows are left out; --persons shows them, --list names all',
                     selection.left_out)
    chosen = selection.joints if joints or options.joints else [each for each in _TRAJECTORIES
                                                                if each in selection.joints]
    if options.hand_points:
        found = trajectories(selection, chosen)
    else:
        timeline = (timeline_of(read_signals(options.file, table, options.topic, options.up)[0])
                    if table.dimensions == 3 else None)
        found = plots(selection, chosen, timeline)
    paths = [folder / f'{name}.{options.format}' for name, _ in found]
    check_outputs(paths, options.overwrite)
    for path, (_, draw) in zip(paths, Progress(found, unit=' plots', leave=False)):
        try:
            save_figure(draw(), path)
        except OSError as error:
            raise ParameterError(f'can not write into {folder}: {error.strerror or error}') from error
        Progress.write(str(path))
    of_people = re.compile(_OF_PEOPLE + options.format)
    for former in files_of(folder, lambda name: bool(of_people.fullmatch(name))):
        if options.overwrite and former not in paths:
            former.unlink()
    return DONE


def _names(known: Sequence[str], what: str) -> Callable[[str], List[str]]:
    return checked(_words, lambda names: set(names) <= set(known), f'{what}, separated by commas: {", ".join(known)}')


def _words(text: str) -> List[str]:
    return [word.strip() for word in text.split(',') if word.strip()]


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('plot_keypoints', __doc__)
    parser.add_argument('file', type=plain_path, metavar='FILE', help='CSV of keypoints, or bag')
    parser.add_argument('-o', '--output', type=plain_path, metavar='FOLDER', help='where the plots go')
    parser.add_argument('--overwrite', action='store_true', help='replace plots that are there')
    parser.add_argument('--list', action='store_true', help='print what is in the file: time, people, joints')
    parser.add_argument('--topic', help='of the bag (default: its only one with people, in space before in the image)')
    parser.add_argument('--joints', metavar='A,B', type=_names((*MESSAGE_JOINTS, 'all'), 'joints'),
                        help='only these joints, and a trajectory of each; or all (default: all joints, trajectories '
                        f"of {', '.join(_TRAJECTORIES)})")
    parser.add_argument('--hand-points', metavar='A,B', type=_names(HAND_JOINTS, 'points of the hands'),
                        help='trajectories of these points of the hands of a bag instead: left_hand_wrist, '
                        'right_hand_index_4 (the tip of the index finger), ...')
    parser.add_argument('--persons', metavar='I,J',
                        type=checked(lambda text: list(map(int, _words(text))), bool, 'numbers, as 0,2'),
                        help='only these ids (default: the 8 with most rows)')
    parser.add_argument('--start', type=seconds, metavar='S', help='leave out what is before [s], from the first frame')
    parser.add_argument('--end', type=seconds, metavar='S', help='leave out what is after')
    add_up(parser)
    parser.add_argument('--format', choices=FORMATS, default='png', help='of the plots (default: %(default)s)')
    return parser

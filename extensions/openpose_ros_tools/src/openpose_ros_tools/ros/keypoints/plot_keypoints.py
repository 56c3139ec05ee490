"""Plot the people in a recording: when they were in view, their paths, and their joints over time.

FILE is a CSV of keypoints (of keypoints_to_csv, process_bag or `rostopic echo -p`) or a bag with the results of the
nodes, in space or in the image. No master is needed. The plots in FOLDER:

    detections         marks of frames and people over time, number of people in view
    top_view           paths of the people from above (of keypoints in the image: image_paths)
    trajectory_JOINT   coordinates of a joint over time, measured and inferred ones

    rosrun openpose_ros_tools plot_keypoints poses.csv -o plots/
    rosrun openpose_ros_tools plot_keypoints recording.bag -o plots/ --joints right_wrist,left_wrist

Exit status: 0 done; 2 nothing was done, as the command line or the file is wrong; 130 interrupted, the finished plots
are complete.
"""
import argparse
import logging
from functools import partial
from typing import Any, Callable, Dict, Optional, Sequence

from openpose_ros_pkg.command_line import DONE, Progress, run_command
from openpose_ros_pkg.command_options import checked, command_parser, plain_path
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.files import check_outputs, writable_folder
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.ros.keypoints.keypoint_bag import read_keypoints
from openpose_ros_tools.tables.keypoint_selection import select

_log = logging.getLogger(__name__)

# Joints whose trajectories are plotted by default.
_TRAJECTORIES = ('nose', 'neck', 'right_wrist', 'left_wrist', 'right_ankle', 'left_ankle')


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    return run_command('plot_keypoints', lambda: _run(_parser().parse_args(arguments)))


def _run(options: argparse.Namespace) -> int:
    from openpose_ros_tools.plots import keypoint_plots  # Matplotlib takes a third of the start
    from openpose_ros_tools.plots.plotting import save_figure
    table, frames = read_keypoints(options.file, options.topic)
    joints = None if options.joints in (None, ['all']) else options.joints
    try:
        selection = select(table, frames, joints)
    except BadInputError as error:
        raise BadInputError(f'{options.file}: {error}') from error
    folder = writable_folder('output', options.output)
    if len(set(table.frame_ids.tolist())) > 1:
        _log.warning('the people are in several frames of reference (%s), which are drawn as one', selection.frame_id)
    if selection.left_out:
        _log.warning('%d people with few rows are left out', selection.left_out)
    plots: Dict[str, Callable[[], Any]] = {
        'detections': partial(keypoint_plots.detections, selection),
        'top_view' if table.dimensions == 3 else 'image_paths': partial(keypoint_plots.paths_of_people, selection)}
    for joint in selection.joints:
        if options.joints or joint in _TRAJECTORIES:
            plots[f'trajectory_{joint}'] = partial(keypoint_plots.trajectory, selection, joint)
    paths = {folder / f'{name}.png': draw for name, draw in plots.items()}
    check_outputs(list(paths), options.overwrite)
    for path, draw in Progress(paths.items(), unit=' plots', leave=False):
        save_figure(draw(), path)
        Progress.write(str(path))
    return DONE


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('plot_keypoints', __doc__)
    parser.add_argument('file', type=plain_path, metavar='FILE', help='CSV of keypoints, or bag')
    parser.add_argument('-o', '--output', type=plain_path, required=True, metavar='FOLDER', help='where the plots go')
    parser.add_argument('--overwrite', action='store_true', help='replace plots that are there')
    parser.add_argument('--topic', help='of the bag (default: its only one with people, in space before in the image)')
    joints = checked(lambda text: text.replace(' ', '').split(','), {*MESSAGE_JOINTS, 'all'}.issuperset,
                     f'names separated by commas: {MESSAGE_JOINTS}')
    parser.add_argument('--joints', metavar='A,B', type=joints,
                        help=f"trajectories of these joints, or of all (default: {', '.join(_TRAJECTORIES)})")
    return parser

"""Compare the people of a camera with motion capture: errors per joint, a table and a page; without a ROS master.

POSES is a table as keypoints_to_csv or `rostopic echo -p` write it, or a bag with people in space. MOCAP is a table
that OptiTrack Motive exported (.csv), C3D (.c3d) or TRC (.trc). The clock offset is found by the speeds of the joints,
the camera's place by laying joints on joints, and each track's subject by distance. People must move for that; what is
known may be given.

    rosrun openpose_ros_tools evaluate_mocap poses.csv mocap.csv -o report
    rosrun openpose_ros_tools evaluate_mocap people.bag take.c3d --markers my_markers.yaml -o report
    rosrun openpose_ros_tools evaluate_mocap poses.csv mocap.trc --clock-offset 0 \\
        --transform 0.1 0 1.35 -0.5 0.5 -0.5 0.5

A table of the errors of each joint [mm] goes to stdout; below it, as validation studies report, RMSE and Pearson's r
of trajectories by body region and axis, and RMSE of angles. With -o, a folder gets report.html, all figures as
summary.json, and each single error in errors.csv.

The transform that is found minimises the distances of the measured joints, so what all joints err by alike is in the
transform and not in the errors; a constant delay of the estimate is in the clock offset. For absolute errors give both.

Exit status: 0 done; 2 nothing was done, as an input is wrong or clock and place can not be found; 130 interrupted.
"""
import argparse
import sys
from pathlib import Path
from typing import Optional, Sequence, Tuple

import numpy as np
from scipy.spatial.transform import Rotation

from openpose_ros_pkg.command_line import DONE, run_command
from openpose_ros_pkg.command_options import command_parser, number, plain_path, seconds
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_pkg.output.files import check_outputs
from openpose_ros_tools.outputs import files_of
from openpose_ros_tools.recording_paths import is_bag
from openpose_ros_tools.tables.keypoint_csv import read_keypoint_csv
from openpose_ros_tools.tables.keypoint_table import KeypointTable
from skeleton_extract_3d.points.transform import Transform

# A rotation that was written with few digits still counts as one.
_ROTATION_TOLERANCE = 1e-2


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command; return the exit status."""
    return run_command('evaluate_mocap', lambda: _run(_parser().parse_args(arguments)))


def transform_of(values: Sequence[float]) -> Transform:
    """Return the transform of x y z [m] qx qy qz qw; ParameterError: the quaternion is not of length 1."""
    place, turn = np.split(np.array(values), [3])
    if not abs(np.linalg.norm(turn) - 1) < _ROTATION_TOLERANCE:
        raise ParameterError(f'--transform: the quaternion {turn.tolist()} has the length {np.linalg.norm(turn):g}, '
                             'expected 1')
    return Rotation.from_quat(turn).apply(np.eye(3)).T, place


def read_poses(path: Path, topic: Optional[str] = None) -> Tuple[KeypointTable, Optional[np.ndarray]]:
    """Read people in space, in one frame of reference, from a table or a bag; see `read_keypoints`.

    Raises:
        BadInputError: it can not be read, or holds no people, or people in the image.
    """
    frames = None
    if is_bag(path):
        from openpose_ros_tools.ros.keypoints.keypoint_bag import read_keypoints  # tables can be read without ROS
        poses, frames = read_keypoints(path, topic)
    elif topic is not None:  # as read_keypoints says, which needs ROS
        raise BadInputError(f'{path}: --topic is for bags')
    else:
        poses = read_keypoint_csv(path)
    if not len(poses):
        raise BadInputError(f'{path} holds no people')
    if poses.dimensions != 3:
        raise BadInputError(f'{path} holds people in the image [px], expected people in space')
    poses.frame_id(str(path))
    return poses, frames


def _run(options: argparse.Namespace) -> int:
    from openpose_ros_tools.alignment.alignment import AlignmentParams, align
    from openpose_ros_tools.mocap.evaluation import compare
    from openpose_ros_tools.mocap.files import read_mocap
    from openpose_ros_tools.mocap.joints import chosen_map, joints_of
    from openpose_ros_tools.mocap.marker_map import read_marker_map
    from openpose_ros_tools.mocap.report import FILES, summary, text, write_report
    if options.output is not None:
        check_outputs(files_of(options.output, FILES.__contains__), options.overwrite)
    transform = None if options.transform is None else transform_of(options.transform)
    poses, _ = read_poses(options.poses, options.topic)
    recording = read_mocap(options.mocap)
    marker_map = chosen_map(recording) if options.markers is None else read_marker_map(options.markers)
    reference = joints_of(recording, marker_map)
    alignment = align(poses.measured(), reference, AlignmentParams(options.clock_offset, transform))
    comparison = compare(poses, reference, alignment)
    inputs = {'poses': options.poses.name, 'motion capture': options.mocap.name, 'marker map': Path(
        marker_map.name).name + ', chosen by the names of the markers' * (options.markers is None)}
    if poses.frame_ids[0]:
        inputs['frame of the camera'] = str(poses.frame_ids[0])
    values = summary(comparison, alignment, inputs)
    for warning in alignment.warnings:
        sys.stderr.write(f'evaluate_mocap: warning: {warning}\n')
    sys.stdout.write(text(values))
    if options.output is not None:
        write_report(options.output, comparison, values)
        sys.stdout.write(f"\nreport: {options.output / 'report.html'}\n")
    return DONE


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('evaluate_mocap', __doc__)
    parser.add_argument('poses', type=plain_path, metavar='POSES', help='people in space: .csv, or .bag')
    parser.add_argument('mocap', type=plain_path, metavar='MOCAP', help='motion capture: .csv of Motive, .c3d, .trc')
    parser.add_argument('-o', '--output', type=plain_path, metavar='FOLDER', help='write the report here')
    parser.add_argument('--overwrite', action='store_true', help='replace the report that is there')
    parser.add_argument('--topic', help='of the people, where a bag has several')
    parser.add_argument('--markers', metavar='MAP', help='which markers make up which joint: a YAML file, or the name '
                        'of a shipped map (default: chosen by the names of the markers)')
    parser.add_argument('--clock-offset', type=seconds, metavar='S',
                        help='time of the reference minus time of the poses at the same instant [s] (default: found)')
    parser.add_argument('--transform', nargs=7, type=number(-1e6, 1e6),
                        metavar=('X', 'Y', 'Z', 'QX', 'QY', 'QZ', 'QW'), help="the camera's place in the reference, "
                        'x_reference = R x_camera + t [m], as a report has it (default: found)')
    return parser

"""Compare the people of a camera with motion capture: errors per joint, tables and pictures; without a ROS master.

POSES is a table as keypoints_to_csv or `rostopic echo -p` write it, or a bag with people in space. MOCAP is a table
that OptiTrack Motive exported (.csv), C3D (.c3d) or TRC (.trc). Nothing needs to be known of how clocks and frames of
both relate: the clock offset is found by the speeds of the joints, which are the same in every frame, and the place of
the camera by laying joints on joints. Who is who is found out as well. People must move for that; what is known may be
given.

    rosrun openpose_ros_mocap evaluate_mocap poses.csv mocap.csv -o report
    rosrun openpose_ros_mocap evaluate_mocap people.bag take.c3d --markers my_markers.yaml -o report
    rosrun openpose_ros_mocap evaluate_mocap poses.csv mocap.trc --clock-offset 0 \\
        --transform 0.1 0 1.35 -0.5 0.5 -0.5 0.5
    rosrun openpose_ros_mocap evaluate_mocap others.csv others_mocap.csv --transform-from report/summary.json

The table goes to stdout: of each joint the share that is answered, mean (MPJPE), median and 90th percentile of the
error [mm], the share within 50, 100 and 150 mm of all joints that the reference has (PCK), and how many joints were
measured and inferred, with their median errors. With -o, a folder gets report.html and report.md, the pictures, all
figures as summary.json, joints.csv and bones.csv, and each single error in errors.csv.

The transform that is found minimises the distances of the measured joints, so what all joints err by alike is in the
transform and not in the errors; a constant delay of the estimate is in the clock offset. For absolute errors give both.

Exit status: 0 done; 2 nothing was done, as an input is wrong or clock and place can not be found; 130 interrupted.
"""
import argparse
import json
import sys
from pathlib import Path
from typing import Any, Dict, Iterable, List, Optional, Sequence

import numpy as np
from scipy.spatial.transform import Rotation
from tqdm import tqdm

from openpose_ros_mocap.alignment import AlignmentParams, align
from openpose_ros_mocap.evaluation import EvaluationParams, compare
from openpose_ros_mocap.files import read_mocap
from openpose_ros_mocap.joints import chosen_map, joints_of
from openpose_ros_mocap.marker_map import MarkerMap, read_marker_map
from openpose_ros_mocap.report import facts, summary, table, write_report
from openpose_ros_pkg.command_line import DONE, run_command
from openpose_ros_pkg.errors import BadInputError, ParameterError
from openpose_ros_tools.tables.keypoint_csv import read_keypoint_csv
from openpose_ros_tools.tables.keypoint_table import KeypointTable

# A rotation that was written with few digits still counts as one.
_ROTATION_TOLERANCE = 1e-2


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command; return the exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    for name in ('max_gap', 'gate', 'max_clock_offset'):
        value = getattr(options, name)
        if value is not None and not value > 0:
            parser.error(f"--{name.replace('_', '-')}: expected a number above 0, got {value:g}")
    if None not in (options.start, options.end) and options.start >= options.end:
        parser.error('--start must be less than --end')
    return run_command('evaluate_mocap', lambda: _run(options))


def transform_of(values: Sequence[str]) -> np.ndarray:
    """Return the transform (4, 4) from the camera's frame to the reference's that the command line names.

    Args:
        values: x y z [m] qx qy qz qw as 7 numbers, or the path of a file that holds these, or 4 x 4 numbers row by row.

    Raises:
        ParameterError: it is something else.
    """
    text = ' '.join(values)
    if len(values) == 1 and Path(values[0]).is_file():
        try:
            text = Path(values[0]).read_text(encoding='utf-8')
        except (OSError, UnicodeDecodeError) as error:
            raise ParameterError(f'--transform: {values[0]} can not be read: {error}') from error
    try:
        numbers = np.array([float(word) for word in text.replace(',', ' ').split()])
    except ValueError:
        numbers = np.array([])
    matrix = np.eye(4)
    if len(numbers) == 7 and np.isfinite(numbers).all() and abs(np.linalg.norm(numbers[3:]) - 1) < _ROTATION_TOLERANCE:
        matrix[:3, :3], matrix[:3, 3] = Rotation.from_quat(numbers[3:]).apply(np.eye(3)).T, numbers[:3]
        return matrix
    if len(numbers) == 16 and np.isfinite(numbers).all():
        matrix = numbers.reshape(4, 4)
        if _is_rigid(matrix):
            return matrix
    raise ParameterError(f"--transform '{' '.join(values)[:80]}': expected x y z qx qy qz qw (7 numbers, quaternion of "
                         'length 1), or a file that holds these or the 4 x 4 numbers of a rotation and translation')


def transform_from(path: Path) -> np.ndarray:
    """Return the transform (4, 4) of another report.

    Raises:
        ParameterError: the file is no summary.json.
    """
    try:
        matrix = np.array(json.loads(path.read_text(encoding='utf-8'))['transform']['matrix'], np.float64)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ParameterError(f'--transform-from: {path} is not the summary.json of a report: {error!r}') from error
    if matrix.shape != (4, 4) or not _is_rigid(matrix):
        raise ParameterError(f'--transform-from: the transform in {path} is no rotation and translation')
    return matrix


def read_poses(path: Path, topic: Optional[str] = None) -> KeypointTable:
    """Read people in space from a table or a bag.

    Raises:
        BadInputError: it can not be read, or holds nobody, or people in the image.
    """
    if path.suffix.lower() == '.bag':
        from openpose_ros_tools.ros.keypoint_bag import read_keypoint_bag  # tables can be read without ROS
        poses = read_keypoint_bag(path, topic)
    elif topic is not None:
        raise ParameterError(f'--topic is for bags, and {path} is none')
    else:
        poses = read_keypoint_csv(path)
    if not len(poses):
        raise BadInputError(f'{path} holds nobody')
    if poses.dimensions != 3:
        raise BadInputError(f'{path} holds people in the image [px]; motion capture is compared with people in space')
    frames = sorted(set(poses.frame_ids.tolist()))
    if len(frames) > 1:
        raise BadInputError(f"{path} holds people in several frames of reference: {', '.join(map(repr, frames))}; "
                            'give the people of one camera at a time')
    return poses


def _run(options: argparse.Namespace) -> int:
    transform = None
    if options.transform is not None:
        transform = transform_of(options.transform)
    elif options.transform_from is not None:
        transform = transform_from(options.transform_from)
    poses = read_poses(options.poses, options.topic)
    recording = read_mocap(options.mocap)
    marker_map = chosen_map(recording, read_marker_map(options.markers))
    reference = joints_of(recording, marker_map)
    params = AlignmentParams(options.clock_offset, transform, options.max_clock_offset, options.max_gap,
                             options.use_sigma)
    alignment = align(poses, reference, params, _bar('aligning'))
    comparison = compare(poses, reference, alignment, EvaluationParams(
        options.gate, options.max_gap, _names(options.joints), options.start, options.end), _bar('comparing'))
    values = summary(comparison, alignment, _inputs(options, poses, marker_map))
    for warning in alignment.warnings:
        sys.stderr.write(f'evaluate_mocap: warning: {warning}\n')
    width = max(len(name) for name, _ in facts(values))
    sys.stdout.write('\n'.join([*(f'{name.ljust(width)}  {text}' for name, text in facts(values)), '', table(values)]))
    sys.stdout.write('\n')
    if options.output is not None:
        write_report(options.output, comparison, alignment, values)
        sys.stdout.write(f"\nreport: {options.output / 'report.html'}\n")
    return DONE


def _bar(what: str) -> Any:
    """Return what shows a progress bar over items, on a terminal."""
    def show(items: Iterable) -> Iterable:
        return tqdm(items, desc=what, disable=None, leave=False)

    return show


def _names(text: Optional[str]) -> tuple:
    return tuple(name.strip().replace(' ', '_') for name in text.split(',') if name.strip()) if text else ()


def _inputs(options: argparse.Namespace, poses: KeypointTable, marker_map: MarkerMap) -> Dict[str, str]:
    """Return what was compared, and the options that bear on the figures, for the report."""
    inputs = {'poses': options.poses.name, 'motion capture': options.mocap.name,
              'marker map': Path(marker_map.name).name + ', chosen by the names of the markers' * marker_map.is_choice}
    if poses.frame_ids[0]:
        inputs['frame of the camera'] = str(poses.frame_ids[0])
    told: List[str] = [f"{name.replace('_', '-')} {getattr(options, name):g} {unit}"
                       for name, unit in (('start', 's'), ('end', 's'), ('max_gap', 's'), ('gate', 'm'))
                       if getattr(options, name) is not None]
    if options.use_sigma:
        told.append('joints weighted by sigma')
    inputs['options'] = ', '.join(told)
    return inputs


def _is_rigid(matrix: np.ndarray) -> bool:
    rotation = matrix[:3, :3]
    return bool(np.isfinite(matrix).all() and np.allclose(rotation @ rotation.T, np.eye(3), atol=_ROTATION_TOLERANCE)
                and np.linalg.det(rotation) > 0 and np.allclose(matrix[3], [0, 0, 0, 1]))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog='evaluate_mocap', description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('poses', type=Path, metavar='POSES', help='people in space: .csv, or .bag')
    parser.add_argument('mocap', type=Path, metavar='MOCAP', help='motion capture: .csv of Motive, .c3d or .trc')
    parser.add_argument('-o', '--output', type=Path, metavar='FOLDER', help='write report, figures and pictures here')
    parser.add_argument('--topic', help='of the people, where a bag has several')
    parser.add_argument('--markers', metavar='MAP', help='which markers make up which joint: a YAML file, or the name '
                        'of a shipped map (default: chosen by the names of the markers)')
    clock = parser.add_argument_group('clock and place')
    clock.add_argument('--clock-offset', type=float, metavar='S',
                       help='time of the reference minus time of the poses at the same instant [s] (default: found)')
    clock.add_argument('--max-clock-offset', type=float, metavar='S',
                       help='search offsets up to this, either way (default: wherever the recordings overlap)')
    place = clock.add_mutually_exclusive_group()
    place.add_argument('--transform', nargs='+', metavar='VALUE',
                       help="the camera's place in the reference, x_reference = R x_camera + t (default: found): x y z "
                       '[m] qx qy qz qw, or a file with these or 4 x 4 numbers')
    place.add_argument('--transform-from', type=Path, metavar='FILE', help='take it from the summary.json of a report')
    clock.add_argument('--use-sigma', action='store_true', help='weigh joints by 1 / sigma^2 when aligning')
    what = parser.add_argument_group('what is compared')
    what.add_argument('--joints', metavar='NAMES', help='only these, separated by commas (default: all that both have)')
    what.add_argument('--start', type=float, metavar='S', help='from this time on, since the first pose [s]')
    what.add_argument('--end', type=float, metavar='S', help='up to this time [s]')
    what.add_argument('--max-gap', type=float, default=AlignmentParams.max_gap, metavar='S',
                      help='bridge gaps of the reference up to this [s] (default: %(default)s)')
    what.add_argument('--gate', type=float, default=EvaluationParams.gate, metavar='M',
                      help='who is farther from a subject is somebody else [m] (default: %(default)s)')
    return parser

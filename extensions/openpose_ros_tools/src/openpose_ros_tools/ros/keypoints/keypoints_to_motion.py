"""The programs that write people as motion: keypoints_to_trc, keypoints_to_bvh, keypoints_to_angles."""
import argparse
import csv
import inspect
import logging
import re
import sys
from dataclasses import replace
from typing import Callable, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.command_line import DONE, run_command
from openpose_ros_pkg.command_options import add_output, add_up, command_parser, plain_path
from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.output.files import check_outputs
from openpose_ros_tools.mocap.files import MarkerRecording
from openpose_ros_tools.motion.angles import joint_angles
from openpose_ros_tools.motion.bvh import bvh_text
from openpose_ros_tools.motion.sampling import sample_people
from openpose_ros_tools.motion.trc import marker_name, trc_text
from openpose_ros_tools.outputs import PartFiles, output_file
from openpose_ros_tools.ros.evaluate_mocap import read_poses
from openpose_ros_tools.tables.keypoint_table import KeypointTable

_log = logging.getLogger(__name__)


def trc(arguments: Optional[Sequence[str]] = None) -> int:
    """Write people in space as TRC files, for OpenSim and Pose2Sim: person_ID.trc for each of them.

        rosrun openpose_ros_tools keypoints_to_trc people.bag -o trc/
        rosrun openpose_ros_tools keypoints_to_trc poses.csv -o trc/ --measured

    The markers have the names of Pose2Sim's models (RShoulder, CHip, LBigToe), positions in metres, y up and, of a
    frame with z up, z where its x was. 0 s is for all people the first frame of a bag, also one without people, or the
    first row of a table. Samples are interpolated between the frames; a joint that is missing for longer than a quarter
    of a second has empty cells.

    Exit status: 0 done; 2 nothing was written, as an input is wrong.
    """
    return _run_files('keypoints_to_trc', trc, '.trc', lambda person, name: trc_text(
        replace(person, names=tuple(map(marker_name, person.names))), name), arguments)


def bvh(arguments: Optional[Sequence[str]] = None) -> int:
    """Write people in space as BVH files, for Blender and game engines: person_ID.bvh for each of them.

        rosrun openpose_ros_tools keypoints_to_bvh people.bag -o bvh/

    The skeleton stands with y up, the arms to the sides, and faces z; lengths are in centimetres, the bones have their
    median length in the recording. The place of the hips and the directions of the bones are those of the joints, what
    is missing is interpolated. How a limb is twisted is not known. Bones that a person never has are left out. Frames
    begin at 0 s of keypoints_to_trc: until a person comes, the skeleton is at rest where it comes.

    Exit status: 0 done; 2 nothing was written, as an input is wrong.
    """
    return _run_files('keypoints_to_bvh', bvh, '.bvh', lambda person, _: bvh_text(person), arguments)


def angles(arguments: Optional[Sequence[str]] = None) -> int:
    """Write the joint angles of people in space as a table [deg]: a row for each person in a frame.

        rosrun openpose_ros_tools keypoints_to_angles people.bag -o angles.csv

    Columns: time [ns], person_ID, and of both sides hip_flexion, hip_adduction, knee_flexion, ankle_dorsiflexion,
    shoulder_elevation, shoulder_plane, elbow_flexion; neck_flexion, neck_bending, neck_rotation; nan where a joint is
    missing. docs/recordings.md defines them.

    Exit status: 0 done; 2 nothing was written, as an input is wrong.
    """
    parser = _parser('keypoints_to_angles', angles, 'file')
    options = parser.parse_args(arguments)
    return run_command(parser.prog, lambda: _write_angles(options))


def _run_files(name: str, program: Callable[..., int], suffix: str, text_of: Callable[[MarkerRecording, str], str],
               arguments: Optional[Sequence[str]]) -> int:
    """Run a program that writes a file for each person."""
    parser = _parser(name, program, 'folder')
    add_up(parser)
    return run_command(name, lambda: _write_files(parser.parse_args(arguments), suffix, text_of))


def _write_files(options: argparse.Namespace, suffix: str, text_of: Callable[[MarkerRecording, str], str]) -> int:
    table, begin = _people(options)
    people, texts = sample_people(table, up=options.up, begin=begin), {}
    for person, joints in people.items():
        name = f'person_{person}{suffix}'
        try:
            texts[name] = text_of(joints, name)
        except BadInputError as error:
            _log.warning('person %d has %s; left out', person, error)
    if not texts:
        raise BadInputError(f'{options.file}: no person can be written')
    check_outputs([options.output / name for name in texts], options.overwrite, [options.file])
    with PartFiles() as parts:
        folder = parts.folder(options.output, lambda name: options.overwrite and bool(
            re.fullmatch(rf'person_\d+\{suffix}', name)))
        for name, text in texts.items():
            (folder / name).write_text(text)
    rate = next(iter(people.values())).rate
    sys.stdout.write(f'{len(texts)} people at {rate:g} Hz in {options.output}; 0 s is the stamp '
                     f'{begin // 10**9}.{begin % 10**9:09d} s\n')
    return DONE


def _write_angles(options: argparse.Namespace) -> int:
    with output_file(options.output, options.overwrite, [options.file]) as part:
        table, _ = _people(options)
        found = joint_angles(table.joints, table.positions)
        with part.open('w', newline='', encoding='utf-8') as handle:
            rows = csv.writer(handle, lineterminator='\n')
            rows.writerow(['time', 'person_ID', *found])
            degrees = np.round(np.stack(list(found.values()), axis=1), 2).tolist()
            rows.writerows([stamp, person, *row] for stamp, person, row in
                           zip(table.stamps.tolist(), table.ids.tolist(), degrees))
    sys.stdout.write(f'{len(table)} rows in {options.output}\n')
    return DONE


def _people(options: argparse.Namespace) -> Tuple[KeypointTable, int]:
    """Return the people that are asked for, and the stamp of the first frame of the recording [ns]."""
    table, frames = read_poses(options.file, options.topic)
    begin = min([table.stamps.min(), *([] if frames is None else frames[:1])])
    return (table.measured() if options.measured else table), int(begin)


def _parser(name: str, program: Callable[..., int], output: str) -> argparse.ArgumentParser:
    parser = command_parser(name, inspect.getdoc(program))
    parser.add_argument('file', type=plain_path, metavar='FILE', help='bag or table of process_bag or keypoints_to_csv')
    add_output(parser, output)
    parser.add_argument('--topic', help='of the people, where a bag has several')
    parser.add_argument('--measured', action='store_true', help='leave out joints that are inferred')
    return parser

"""Write the keypoints of a CSV file into a bag: messages of single people, and arrays of all people of a frame.

    rosrun openpose_ros_tools csv_to_bag poses.csv -o poses.bag
    rosrun openpose_ros_tools csv_to_bag poses.csv -o poses.bag --frame-id kinect2_rgb_optical_frame

The file holds the columns of the original project, the extended ones, or those of `rostopic echo -p`;
docs/recordings.md says what they mean. The topics are those of the nodes: detected_poses_keypoints_3d and
detected_poses_3d under openpose_ros/skeleton_3d with joints in space, detected_poses_keypoints and detected_poses under
openpose_ros otherwise. %time becomes the time in the bag.

The bag has no more information than the file. The columns of the original have no status, so each joint with a
position is MEASURED; sigma is NaN, frame_id is empty or that of --frame-id, and the stamp of a frame is the %time of
its first row. Files have no velocities, and no rows for frames without people.

Exit status: 0 done; 2 nothing was written, as the command line or the file is wrong; 130 interrupted, there is no bag.
"""
import argparse
import sys
from pathlib import Path
from typing import Optional, Sequence, Set

import genpy
import numpy as np
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from std_msgs.msg import Header

from openpose_ros_pkg.command_line import DONE, Progress, run_command
from openpose_ros_pkg.command_options import add_output, command_parser, plain_path
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.skeletons import BODY_25, COCO_18, MESSAGE_JOINTS, MPI_15
from openpose_ros_tools.outputs import output_file
from openpose_ros_tools.ros.bag_files import new_bag
from openpose_ros_tools.ros.keypoints.keypoint_bag import person_message
from openpose_ros_tools.tables.keypoint_csv import KeypointCsv, read_csv
from openpose_ros_tools.tables.keypoint_table import frames_of, table_of, with_one_clock
from skeleton_extract_3d.people import MISSING

_NAME = 'csv_to_bag'
# Topics of single people and of arrays, by dimensions.
_TOPICS = {2: ('/openpose_ros/detected_poses_keypoints', '/openpose_ros/detected_poses'),
           3: ('/openpose_ros/skeleton_3d/detected_poses_keypoints_3d', '/openpose_ros/skeleton_3d/detected_poses_3d')}


def known_joints(file: KeypointCsv) -> Set[str]:
    """Return the joints that any person in a file has."""
    known = np.zeros(len(MESSAGE_JOINTS), bool)
    for row in file.rows:
        known |= row.parts[:, 2] > 0 if file.dimensions == 2 else row.parts[:, 4] != MISSING
    return {joint for joint, there in zip(MESSAGE_JOINTS, known) if there}


def pose_model_of(joints: Set[str]) -> str:
    """Return the joint set that has all these joints.

    Raises:
        ParameterError: none has.
    """
    for skeleton in (COCO_18, BODY_25, MPI_15):
        if joints <= set(skeleton.joints):
            return skeleton.name
    raise ParameterError(f'no joint set has all of {", ".join(sorted(joints))}')


def write_bag(file: KeypointCsv, path: Path, frame_id: str, pose_model: str) -> int:
    """Write the people of a file into a bag; return the number of frames.

    Args:
        frame_id: where the file names none.
    """
    of_person, of_frame = _TOPICS[file.dimensions]
    kind = PersonDetection_3dArray if file.dimensions == 3 else PersonDetectionArray
    count = 0
    with new_bag(path) as bag, Progress(total=len(file.rows), unit='row') as bar:
        for count, frame in enumerate(frames_of(file.rows), 1):
            began = _time(frame[0].time)
            headers = [Header(row.sequence, _time(row.stamp), row.frame_id) for row in frame]
            if not file.has_stamps:
                headers = [Header(count - 1, began, row.frame_id or frame_id) for row in frame]
            persons = [person_message(row, header) for row, header in zip(frame, headers)]
            for row, person in zip(frame, persons):
                bag.write(of_person, person, _time(row.time))
            bag.write(of_frame, kind(header=headers[0], pose_model=pose_model, persons=persons), began)
            bar.update(len(frame))
    return count


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    return run_command(_NAME, lambda: _run(_parser().parse_args(arguments)))


def _run(options: argparse.Namespace) -> int:
    with output_file(options.output, options.overwrite, [options.csv]) as part:
        file = read_csv(options.csv)
        with_one_clock(table_of(file.rows, file.dimensions), str(options.csv))  # rosbag would sort two runs into one
        frames = write_bag(file, part, options.frame_id, pose_model_of(known_joints(file)))
    sys.stdout.write(f'{frames} frames in {options.output}\n')
    return DONE


def _time(nanoseconds: int) -> genpy.Time:
    return genpy.Time(0, nanoseconds)


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(_NAME, __doc__)
    parser.add_argument('csv', type=plain_path, metavar='CSV', help='file with keypoints')
    add_output(parser, 'bag')
    parser.add_argument('--frame-id', type=frame_name, default='', help='frame of reference, for files that name none')
    return parser

"""Write the keypoints of a CSV file into a bag: messages of single people, and arrays of all people of a frame.

    rosrun openpose_ros_tools csv_to_bag poses.csv -o poses.bag
    rosrun openpose_ros_tools csv_to_bag poses.csv -o poses.bag --frame-id kinect2_rgb_optical_frame

The file holds the columns of the original project, the extended ones, or those of `rostopic echo -p`. The topics are
those of the nodes; %time becomes the time in the bag. Of the columns of the original, each joint with a position is
MEASURED, and the stamp of a frame is the %time of its first row.

Exit status: 0 done; 2 nothing was written, as the command line or the file is wrong; 130 interrupted, there is no bag.
"""
import argparse
import sys
from pathlib import Path
from typing import Optional, Sequence

import genpy
from openpose_ros_msgs.msg import PersonDetection_3dArray, PersonDetectionArray
from std_msgs.msg import Header

from openpose_ros_pkg.command_line import DONE, Progress, run_command
from openpose_ros_pkg.command_options import add_output, command_parser, plain_path
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_pkg.skeletons import BODY_25, COCO_18, MPI_15
from openpose_ros_tools.outputs import output_file
from openpose_ros_tools.ros.bag_files import new_bag
from openpose_ros_tools.ros.keypoints.keypoint_bag import person_message
from openpose_ros_tools.tables.keypoint_csv import KeypointCsv, read_csv
from openpose_ros_tools.tables.keypoint_table import KeypointTable, frames_of, table_of, with_one_clock
from skeleton_extract_3d.people import MISSING

_NAME = 'csv_to_bag'
# Topics of single people and of arrays, by dimensions.
_TOPICS = {2: ('/openpose_ros/detected_poses_keypoints', '/openpose_ros/detected_poses'),
           3: ('/openpose_ros/skeleton_3d/detected_poses_keypoints_3d', '/openpose_ros/skeleton_3d/detected_poses_3d')}


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    return run_command(_NAME, lambda: _run(_parser().parse_args(arguments)))


def _run(options: argparse.Namespace) -> int:
    with output_file(options.output, options.overwrite, [options.csv]) as part:
        file = read_csv(options.csv)
        # rosbag would sort two runs into one
        table = with_one_clock(table_of(file.rows, file.dimensions), str(options.csv))
        frames = _write_bag(file, part, options.frame_id, _pose_model(table))
    sys.stdout.write(f'{frames} frames in {options.output}\n')
    return DONE


def _pose_model(table: KeypointTable) -> str:
    """Return the joint set that has all joints of a table."""
    known = {joint for joint, status in zip(table.joints, table.status.T) if (status != MISSING).any()}
    for skeleton in (COCO_18, BODY_25, MPI_15):
        if known <= set(skeleton.joints):
            return skeleton.name
    raise ParameterError(f'no joint set has all of {", ".join(sorted(known))}')


def _write_bag(file: KeypointCsv, path: Path, frame_id: str, pose_model: str) -> int:
    """Write the people of a file into a bag, in this frame where it names none; return the number of frames."""
    of_person, of_frame = _TOPICS[file.dimensions]
    kind = PersonDetection_3dArray if file.dimensions == 3 else PersonDetectionArray
    count = 0
    with new_bag(path) as bag, Progress(total=len(file.rows), unit='row') as bar:
        for count, frame in enumerate(frames_of(file.rows), 1):
            began = genpy.Time(0, frame[0].time)
            headers = [Header(row.sequence, genpy.Time(0, row.stamp), row.frame_id) if file.has_stamps else
                       Header(count - 1, began, row.frame_id or frame_id) for row in frame]
            persons = [person_message(row, header) for row, header in zip(frame, headers)]
            for row, person in zip(frame, persons):
                bag.write(of_person, person, genpy.Time(0, row.time))
            bag.write(of_frame, kind(header=headers[0], pose_model=pose_model, persons=persons), began)
            bar.update(len(frame))
    return count


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(_NAME, __doc__)
    parser.add_argument('csv', type=plain_path, metavar='CSV', help='file with keypoints')
    add_output(parser, 'bag')
    parser.add_argument('--frame-id', type=frame_name, default='', help='frame of reference, for files that name none')
    return parser

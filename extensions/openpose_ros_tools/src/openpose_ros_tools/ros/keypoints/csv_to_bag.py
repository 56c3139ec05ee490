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
from typing import Optional, Sequence

import genpy
import rosbag
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
from openpose_ros_tools.tables.keypoint_csv import read_csv
from openpose_ros_tools.tables.keypoint_table import FIELDS, KeypointTable, PersonRow, frames_of, table_of
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
        rows, dimensions = read_csv(options.csv)
        pose_model = _pose_model(table_of(rows, dimensions, str(options.csv)))  # rosbag would sort two runs into one
        frames = 0
        with new_bag(part) as bag, Progress(total=len(rows), unit='row') as bar:
            for frame in frames_of(rows):
                _write_frame(bag, frame, frames, options.frame_id, pose_model)
                frames += 1
                bar.update(len(frame))
    sys.stdout.write(f'{frames} frames in {options.output}\n')
    return DONE


def _pose_model(table: KeypointTable) -> str:
    """Return the joint set that has all joints of a table."""
    known = {joint for joint, status in zip(table.joints, table.status.T) if (status != MISSING).any()}
    for skeleton in (COCO_18, BODY_25, MPI_15):
        if known <= set(skeleton.joints):
            return skeleton.name
    raise ParameterError(f'no joint set has all of {", ".join(sorted(known))}')


def _write_frame(bag: rosbag.Bag, frame: Sequence[PersonRow], number: int, frame_id: str, pose_model: str) -> None:
    """Write the people of a frame, in this frame of reference where the file names none."""
    dimensions = 3 if frame[0].parts.shape[1] == len(FIELDS[3]) else 2
    of_person, of_frame = _TOPICS[dimensions]
    began = genpy.Time(0, frame[0].time)
    headers = [Header(row.sequence, genpy.Time(0, row.stamp), row.frame_id) if row.stamp else
               Header(number, began, row.frame_id or frame_id) for row in frame]
    persons = [person_message(row, header) for row, header in zip(frame, headers)]
    for row, person in zip(frame, persons):
        bag.write(of_person, person, genpy.Time(0, row.time))
    kind = PersonDetection_3dArray if dimensions == 3 else PersonDetectionArray
    bag.write(of_frame, kind(header=headers[0], pose_model=pose_model, persons=persons), began)


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(_NAME, __doc__)
    parser.add_argument('csv', type=plain_path, metavar='CSV', help='file with keypoints')
    add_output(parser, 'bag')
    parser.add_argument('--frame-id', type=frame_name, default='', help='frame of reference, for files that name none')
    return parser

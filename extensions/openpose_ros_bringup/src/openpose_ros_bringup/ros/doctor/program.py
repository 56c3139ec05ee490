"""Check camera, topics, tf and nodes: ten checks that say what is right, what is wrong, and the line to type.

    rosrun openpose_ros_bringup doctor
    rosrun openpose_ros_bringup doctor --camera realsense --fixed-frame base_link
    rosrun openpose_ros_bringup doctor --image /cam/image_raw --depth /cam/depth/image_raw
    rosrun openpose_ros_bringup doctor --report             # for a report of a problem: a file with versions and topics

Without options: the cameras that the running nodes read, or the one whose topics are published. It listens for a few
seconds and changes nothing. docs/nothing_in_rviz.md explains the checks.

Exit status: 0 nothing is wrong; 1 something is; 2 the command line is wrong; 130 interrupted.
"""
import argparse
import os
import sys
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Optional, Sequence

from openpose_ros_pkg.command_line import DONE, SOME_FAILED, run_command
from openpose_ros_pkg.command_options import command_parser, number, plain_path
from openpose_ros_pkg.params.camera_presets import AUTO, find_preset
from openpose_ros_pkg.params.parameters import frame_name

if TYPE_CHECKING:
    from openpose_ros_bringup.doctor.snapshot import Snapshot

# Variable with what comes before commands of ROS where the workspace is not sourced.
PREFIX = 'OPENPOSE_ROS_PREFIX'


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    parser = _parser()
    options = parser.parse_args(
        [word for word in sys.argv[1:] if ':=' not in word] if arguments is None else arguments)
    if (options.points or options.depth or options.camera_info) and not options.image:
        parser.error('--points, --depth and --camera-info need --image')
    return run_command('doctor', lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    from openpose_ros_bringup.doctor.report import diagnose, faults, report
    from openpose_ros_bringup.ros.doctor.facts import gather_facts

    if options.camera != AUTO:
        find_preset(options.camera)  # refused at once
    seen = gather_facts(options)
    findings = diagnose(seen)
    text = report(findings, os.environ.get(PREFIX, ''))
    sys.stdout.write(text)
    if options.report is not None:
        _write_report(options, text, seen)
    return SOME_FAILED if faults(findings) else DONE


def _write_report(options: argparse.Namespace, text: str, seen: 'Snapshot') -> None:
    from openpose_ros_bringup.ros.doctor.details import details
    from openpose_ros_pkg.output.files import jpeg_of, written_whole

    images = [camera.image.bgr for camera in seen.cameras if options.picture and camera.image.bgr is not None]
    options.report.parent.mkdir(parents=True, exist_ok=True)
    with written_whole(options.report) as path, zipfile.ZipFile(str(path), 'w', zipfile.ZIP_DEFLATED) as archive:
        archive.writestr('report.txt', text + details(seen))
        for number, image in enumerate(images):
            archive.writestr(f'picture_{number}.jpg', jpeg_of(image, 90))
    pictures = f'pictures: {len(images)}' + ('' if options.picture else ' (--picture)')
    sys.stdout.write(f'{options.report} has this, versions, topics and parameters; {pictures}; read it before you send '
                     'it\n')


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('doctor', __doc__)
    parser.add_argument('--camera', default=AUTO, metavar='NAME', help='preset of the camera (default: auto)')
    for role in ('image', 'points', 'depth', 'camera-info'):
        parser.add_argument(f'--{role}', metavar='TOPIC', help='of a camera without a preset')
    parser.add_argument('--fixed-frame', type=frame_name, default='', metavar='FRAME', help="RViz's fixed frame")
    parser.add_argument('--camera-ns', default='', metavar='NS', help='of the camera, in place of the preset\'s')
    parser.add_argument('--report', type=plain_path, nargs='?', const=Path('doctor_report.zip'), metavar='FILE',
                        help='write a file for a report of a problem (default: doctor_report.zip)')
    parser.add_argument('--picture', action='store_true',
                        help='with --report: put the newest image of each camera into it')
    parser.add_argument('--seconds', type=number(0.1, 3600), default=5.0, metavar='S',
                        help='listen so long at most (default: 5)')
    return parser

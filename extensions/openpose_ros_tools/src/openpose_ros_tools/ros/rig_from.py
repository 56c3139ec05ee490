"""Make a rig, and the calibration file of each camera, of a calibration that another program has made.

    rosrun openpose_ros_tools rig_from Calib.toml -o room/rig.yaml                    # Pose2Sim, caliscope
    rosrun openpose_ros_tools rig_from capture.qca.txt -o room/rig.yaml               # Qualisys
    rosrun openpose_ros_tools rig_from door.yaml window.yaml -o room/rig.yaml         # OpenCV: camera_matrix, R and T
    rosrun openpose_ros_tools rig_from camchain.yaml -o room/rig.yaml --height 1.4 --tilt 12       # Kalibr
    rosrun openpose_ros_tools rig_from left.yaml right.yaml -o room/rig.yaml --height 1.4          # ROS, stereo

R and T of files are x_camera = R x_world + T, as OpenCV has them. Files of Pose2Sim and Qualisys, and R and T of single
cameras, have the frame of the room, which should have z up; those of Kalibr and stereo cameras of ROS have that of the
first camera: the room then begins on the floor below it, x is where it looks, if it is level but for --tilt.
Calibrations are of the lenses too: beside rig.yaml there is NAME.yaml of each camera, for the camera_info_url of its
driver, or --camera-info of other programs.

Exit status: 0 done; 2 nothing was written, as an input is wrong.
"""
import argparse
import re
import sys
from dataclasses import replace
from typing import List, Optional, Sequence

import numpy as np

from openpose_ros_fusion.rig import Rig, rig_camera, rig_text
from openpose_ros_pkg.calibration import calibration_text
from openpose_ros_pkg.command_line import DONE, run_command
from openpose_ros_pkg.command_options import add_output, command_parser, number, plain_path
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.output.files import check_outputs
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_tools.calibration.known_cameras import KnownCameras, read_known_cameras, seen_from_a_level_camera
from openpose_ros_tools.mocap.files import UNITS
from openpose_ros_tools.outputs import PartFiles

_NAME = 'rig_from'


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    return run_command(_NAME, lambda: _run(_parser().parse_args(arguments)))


def _run(options: argparse.Namespace) -> int:
    known = read_known_cameras(options.files)
    unit = known.unit if options.unit is None else UNITS[options.unit]
    if not known.is_room:
        if options.height is None:
            raise ParameterError('this calibration does not tell how high the first camera is above the floor; give '
                                 'it: --height METRES, and --tilt DEGREES if the camera looks down')
        known = seen_from_a_level_camera(known, options.tilt or 0.0, options.height / unit)
    elif options.tilt is not None or options.height is not None:
        raise ParameterError('--tilt and --height are for calibrations in the frame of a camera; this one is in that '
                             'of a room')
    names = options.cameras or [_ros_name(camera.name) for camera in known.cameras]
    if len(names) != len(known.cameras):
        raise ParameterError(f"--cameras has {len(names)} names, expected {len(known.cameras)}, of "
                             f"{', '.join(camera.name for camera in known.cameras)}")
    try:
        rig = Rig(options.fixed_frame, tuple(
            rig_camera(name, options.frame_id.replace('NAME', name),
                       (camera.rotation.T, -unit * camera.rotation.T @ camera.translation), camera.clock_offset)
            for name, camera in zip(names, known.cameras)))
    except ValueError as error:
        raise ParameterError(f'{error}; name them with --cameras') from error
    texts = {options.output: rig_text(rig), **{
        options.output.with_name(f"{name.replace('/', '_')}.yaml"): calibration_text(
            replace(camera.calibration, name=name)) for name, camera in zip(names, known.cameras)}}
    if len(texts) <= len(names):
        raise ParameterError(f'{options.output} is also the file of a camera; give it another name')
    check_outputs(list(texts), options.overwrite, options.files)
    with PartFiles() as parts:
        for path, text in texts.items():
            parts.file(path).write_text(text)
    sys.stdout.write('\n'.join([*_description(rig, known), f'{options.output.parent}: '
                                f"{', '.join(path.name for path in texts)}", '']))
    return DONE


def _description(rig: Rig, known: KnownCameras) -> List[str]:
    """Return a line for each camera, by which mistakes of units and axes show."""
    lines = []
    for camera, source in zip(rig.cameras, known.cameras):
        (x, y, z), lens = camera.pose[0][:, 2], source.calibration
        down, left, half = np.degrees([np.arcsin(-z), np.arctan2(y, x), np.arctan(lens.width / 2 / lens.matrix[0])])
        place = ' '.join(f'{value:.2f}' for value in camera.translation)
        lines.append(f'{camera.name} ({source.name}): at {place} m, looks {left:.0f} degrees to the left of x and '
                     f'{down:.0f} degrees down; {lens.width} x {lens.height} px, {2 * half:.0f} degrees wide')
    return lines


def _ros_name(name: str) -> str:
    """Return a name that topics may have."""
    plain = re.sub(r'\W', '_', name, flags=re.ASCII)
    return plain if re.match('[A-Za-z]', plain) else f'camera_{plain}'


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(_NAME, __doc__)
    parser.add_argument('files', nargs='+', type=plain_path, metavar='FILE', help='files of one calibration')
    add_output(parser, 'file')
    parser.add_argument('--cameras', type=str.split, metavar='"A B"',
                        help='names of the cameras, as of their namespaces, in the order of the file (default: those '
                        'of the file)')
    parser.add_argument('--frame-id', type=frame_name, default='NAME_rgb_optical_frame', metavar='FRAME',
                        help='frame of the images of a camera NAME (default: %(default)s)')
    parser.add_argument('--fixed-frame', type=frame_name, default='world', metavar='FRAME',
                        help='name of the frame of the room (default: %(default)s)')
    parser.add_argument('--unit', choices=('m', 'cm', 'mm'), help='of the translations, where the file was not written '
                        'in metres, as with boards in millimetres (Qualisys: mm)')
    parser.add_argument('--height', type=number(0.001, 1e6), metavar='M',
                        help='of the first camera above the floor; needed where the frame is that of a '
                        'camera')
    parser.add_argument('--tilt', type=number(-90, 90), metavar='DEGREES', help='by which the first camera looks down')
    return parser

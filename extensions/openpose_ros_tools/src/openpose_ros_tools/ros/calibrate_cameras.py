"""Find where cameras stand to one another, from the people that they see alone: no checkerboard, no markers.

Let one to three people walk through what the cameras see together, for half a minute or longer. FILE is a bag with the
results of the nodes or of process_bag (of a camera without depth with its CameraInfo), several of them, or CSV files of
keypoints_to_csv, one per camera. A camera is named by the namespace of its topics, or by the file. In FOLDER:

    rig.yaml     the cameras in the frame of the room: z up from the floor below the first camera, which looks along x;
                 and clock offsets, which are to be added to the stamps of a camera
    rig.png      cameras and people from above
    report.txt   how good it is: what is printed as well

    rosrun openpose_ros_tools calibrate_cameras recording.bag -o rig/
    rosrun openpose_ros_tools calibrate_cameras kitchen.bag hall.bag -o rig/ --cameras "hall kitchen"
    rosrun openpose_ros_tools calibrate_cameras left.csv right.csv -o rig/ --clocks-agree
    rosrun openpose_ros_tools calibrate_cameras images.bag -o rig/ --distance left right 2.35

Exit status: 0 done; 2 nothing was written, as an input is wrong or the people do not tell where the cameras stand; 130
interrupted.
"""
import argparse
import logging
import sys
from functools import partial
from typing import Optional, Sequence

import numpy as np

from openpose_ros_fusion.rig import write_rig
from openpose_ros_pkg.command_line import DONE, Progress, run_command
from openpose_ros_pkg.command_options import add_output, command_parser, named_value, number, plain_path
from openpose_ros_pkg.params.parameters import frame_name
from openpose_ros_tools.calibration.calibrate import Calibrated, CalibrationParams, calibrate
from openpose_ros_tools.outputs import output_folder
from openpose_ros_tools.ros.camera_recordings import recordings_of_files

_log = logging.getLogger(__name__)
_FILES = ('rig.yaml', 'rig.png', 'report.txt')


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command with the arguments of the command line (None: of this process); return the exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        options.distance = options.distance and (*options.distance[:2], _metres(options.distance[2]))
    except argparse.ArgumentTypeError as error:
        parser.error(f'--distance ends with a number: {error}')
    return run_command('calibrate_cameras', lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    from openpose_ros_tools.plots.plotting import save_figure  # Matplotlib takes a third of the start
    from openpose_ros_tools.plots.rig_plot import rig_figure
    params = CalibrationParams(options.fixed_frame, options.clocks_agree, options.stature, options.distance)
    with output_folder(options.output, options.overwrite, _FILES) as folder:
        recorded = recordings_of_files(options.files, options.cameras, dict(options.camera_info), options.rectified)
        found = calibrate(recorded, params, partial(Progress, unit=' pairs', leave=False))
        write_rig(folder / 'rig.yaml', found.rig)
        save_figure(rig_figure(found), folder / 'rig.png')
        text = report(found)
        (folder / 'report.txt').write_text(text)
    frames = [camera.frame_id for camera in found.rig.cameras]
    for frame in sorted({frame for frame in frames if frames.count(frame) > 1}):
        _log.warning("several cameras have the frame '%s', which tf can not tell apart", frame)
    sys.stdout.write(text)
    return DONE


def report(found: Calibrated) -> str:
    """Return what was found, and how good it is."""
    def text(value: float) -> str:
        return f'{value:.1f}' if np.isfinite(value) else '-'

    lines = [f'cameras in {found.rig.fixed_frame}' + (', z up from the floor' if found.floor else '') + ':',
             f'{"camera":24}{"x":>9}{"y":>9}{"z [m]":>9}{"clock [ms]":>12}   uncertain by [degrees, mm, ms]']
    for camera, (angle, position, clock) in zip(found.rig.cameras, found.std.tolist()):
        lines.append(f'{camera.name:24}' + ''.join(f'{value:9.3f}' for value in camera.translation)
                     + f'{1e3 * camera.clock_offset:12.1f}   {angle:.2f}  {1e3 * position:.0f}  {1e3 * clock:.1f}')
    lines += ['', f'{"cameras that see people together":40}{"joints":>8}{"apart [mm]":>12}{"off [px]":>10}']
    lines += [f'{edge.first + ", " + edge.second:40}{edge.joints:8}{text(1e3 * edge.distance):>12}'
              f'{text(edge.pixels):>10}' for edge in found.edges]
    if found.floor:
        lines += ['', f'floor by {found.floor.ankles} ankles, uncertain by {found.floor.std:.1f} degrees']
    return '\n'.join(lines + [f'warning: {warning}' for warning in found.warnings]) + '\n'


_metres = number(0.001, 1000)


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('calibrate_cameras', __doc__)
    parser.add_argument('files', nargs='+', type=plain_path, metavar='FILE', help='bags or CSV files with people')
    add_output(parser, 'folder')
    parser.add_argument('--cameras', type=str.split, default=[], metavar='"A B"',
                        help='only these, the first one is where the frame of the room begins (default: all, by name)')
    parser.add_argument('--camera-info', type=named_value(plain_path, 'left=camera.yaml'), action='append',
                        default=[], metavar='CAMERA=FILE',
                        help='calibration of a camera without depth, where no CameraInfo is recorded; may be repeated')
    parser.add_argument('--rectified', action='store_true', help='images of cameras without depth are rectified')
    parser.add_argument('--fixed-frame', type=frame_name, default=CalibrationParams.fixed_frame, metavar='FRAME',
                        help='name of the frame of the room (default: %(default)s)')
    parser.add_argument('--clocks-agree', action='store_true',
                        help='all stamps are of one clock: no offsets are searched for')
    parser.add_argument('--stature', type=_metres, default=CalibrationParams.stature, metavar='M',
                        help='mean stature of the people, which is the scale where no camera has depth '
                        '(default: %(default)s)')
    parser.add_argument('--distance', nargs=3, metavar=('A', 'B', 'M'),
                        help='distance of two cameras: the scale in place of the stature')
    return parser

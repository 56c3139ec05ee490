"""Texts of a calibration."""
from typing import List

import numpy as np

from openpose_ros_fusion.rig import Rig
from openpose_ros_tools.calibration.calibrate import Calibrated


def report(found: Calibrated) -> str:
    """Return what was found, and how good it is."""
    lines = [f'cameras in {found.rig.fixed_frame}' + (', z up from the floor' if found.floor else '') + ':',
             f'{"camera":24}{"x":>9}{"y":>9}{"z [m]":>9}{"clock [ms]":>12}   uncertain by [degrees, mm, ms]']
    for camera, (angle, position, clock) in zip(found.rig.cameras, found.std.tolist()):
        lines.append(f'{camera.name:24}' + ''.join(f'{value:9.3f}' for value in camera.translation)
                     + f'{1e3 * camera.clock_offset:12.1f}   {angle:.2f}  {1e3 * position:.0f}  {1e3 * clock:.1f}')
    lines += ['', f'{"cameras that see people together":40}{"joints":>8}{"apart [mm]":>12}{"off [px]":>10}']
    lines += [f'{edge.first + ", " + edge.second:40}{edge.joints:8}{_number(edge.distance, 1e3, 1):>12}'
              f'{_number(edge.pixels, 1, 1):>10}' for edge in found.edges]
    if found.floor:
        lines += ['', f'floor by {found.floor.ankles} ankles, uncertain by {found.floor.std:.1f} degrees']
    return '\n'.join(lines + [f'warning: {warning}' for warning in found.warnings]) + '\n'


def shared_frames(rig: Rig) -> List[str]:
    """Return the frames that several cameras have, which tf can not tell apart."""
    frames = [camera.frame_id for camera in rig.cameras]
    return sorted({frame for frame in frames if frames.count(frame) > 1})


def _number(value: float, scale: float, digits: int) -> str:
    return f'{scale * value:.{digits}f}' if np.isfinite(value) else '-'

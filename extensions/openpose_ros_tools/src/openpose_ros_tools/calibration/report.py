"""Texts of a calibration: the report, and the launch file that publishes the cameras."""
from typing import List, Mapping, Tuple
from xml.sax.saxutils import quoteattr

import numpy as np

from openpose_ros_fusion.rig import Rig, rig_camera
from openpose_ros_tools.calibration.calibrate import Calibrated
from skeleton_extract_3d.points.transform import Transform


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


def launch_text(rig: Rig, mounts: Mapping[str, Tuple[str, Transform]]) -> str:
    """Return a launch file that publishes where the cameras are.

    Args:
        mounts: by optical frame the frame at the root of the camera's own transforms, and the transform from the former
            to the latter: then that root is published, as a frame has one parent. Others are published themselves.
    """
    lines = ['<launch>', '  <!-- written by calibrate_cameras: x y z, quaternion x y z w, parent, child -->']
    for camera in rig.cameras:
        if camera.frame_id in mounts:
            frame, (rotation, shift) = mounts[camera.frame_id]
            turn = camera.pose[0] @ rotation.T
            camera = rig_camera(camera.name, frame, (turn, camera.translation - turn @ shift))
        numbers = ' '.join(f'{value:.6f}' for value in (*camera.translation, *camera.rotation))
        name = ''.join(letter if letter.isalnum() else '_' for letter in camera.name).strip('_')
        lines += [f'  <node pkg="tf2_ros" type="static_transform_publisher" name="pose_of_{name}"',
                  f'        args={quoteattr(f"{numbers} {rig.fixed_frame} {camera.frame_id}")}/>']
    return '\n'.join([*lines, '</launch>']) + '\n'


def shared_frames(rig: Rig) -> List[str]:
    """Return the frames that several cameras have, which tf can not tell apart."""
    frames = [camera.frame_id for camera in rig.cameras]
    return sorted({frame for frame in frames if frames.count(frame) > 1})


def _number(value: float, scale: float, digits: int) -> str:
    return f'{scale * value:.{digits}f}' if np.isfinite(value) else '-'

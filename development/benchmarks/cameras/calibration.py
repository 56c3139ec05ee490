#!/usr/bin/python3
"""Measure how well cameras are placed to one another by the people that they see, without a prior.

Printed are the largest errors of all cameras to the first one: angle [degrees], position [mm], clock [ms], the errors
that the calibration itself expects of the worst camera (1 sigma), and the error of the vertical [degrees].

STAGE is a folder with one sequence per camera, see cameras/fusion.py.

    ./run bench cameras calibration STAGE
"""
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import List, NamedTuple, Optional, Tuple

import numpy as np
import pandas as pd
from fusion import Recorded, record

from common import Parser, elapsed, markdown
from openpose_ros_pkg.command_line import run_command
from openpose_ros_tools.calibration.calibrate import CalibrationParams, calibrate
from openpose_ros_tools.calibration.recording import CameraRecording
from simulated_room import rig_errors, up_error
from skeleton_extract_3d.people import MEASURED

# Time of the first frame of a recording, delay of stamps or images that are late [s].
BEGIN, DELAY = 100.0, 0.07
HEAD = ('case', 'angle deg', 'position mm', 'clock ms', 'expected', 'up deg', 'seconds')


class Case(NamedTuple):
    """How the recorded cameras are given to the calibration.

    Attributes:
        rgb: numbers of the cameras names depth is withheld.
        stamped, seen: number of the camera names stamps, or images, are late.
        distance: the distance of the first two cameras is given.
    """

    title: str
    rgb: Tuple[int, ...] = ()
    stamped: Optional[int] = None
    seen: Optional[int] = None
    distance: bool = False


def cases(number: int) -> List[Case]:
    """Return the cases for a number of cameras."""
    everyone = tuple(range(number))
    return [
        Case('depth'),
        *(Case(f'stamps of camera {camera} 70 ms late', stamped=camera) for camera in everyone[1:]),
        *(Case(f'camera {camera} sees 70 ms late', seen=camera) for camera in everyone[1:]),
        *(Case(f'camera {camera} without depth', (camera,)) for camera in everyone),
        Case('camera 0 with depth, the others without', everyone[1:]),
        Case('no depth, mean stature of adults', everyone),
        Case('no depth, distance of two cameras given', everyone, distance=True)]


def recording(camera: Recorded, has_depth: bool, stamped: float, seen: float) -> CameraRecording:
    """Return the people of one camera, as the calibration takes them."""
    stamps, ids, points, sigma = [], [], [], []
    for stamp, people, image in camera.frames:
        measured = people.status == MEASURED
        there = np.where(measured[..., np.newaxis], people.xyz, np.nan) if has_depth else (
            camera.model.rays(image.xy.reshape(-1, 2)).reshape(len(image), -1, 3))
        names = people.ids if has_depth else image.ids
        stamps.append(np.full(len(names), round((BEGIN + stamp + stamped) * 1e9), np.int64))
        ids.append(names)
        points.append(there)
        sigma.append(np.where(measured, people.sigma, np.nan) if has_depth else np.full(there.shape[:2], np.nan))
    found = CameraRecording(camera.name, 'camera', np.concatenate(stamps), np.concatenate(ids).astype(np.int64),
                            np.concatenate(points).astype(np.float64), np.concatenate(sigma).astype(np.float64),
                            has_depth, float(camera.model.matrix[0, 0]))
    return delayed(found, seen) if seen else found


def delayed(found: CameraRecording, delay: float) -> CameraRecording:
    """Return the recording of a camera that sees late: rows between two frames, with the later stamp."""
    frames = np.unique(found.stamps, return_inverse=True)[1]
    rows = pd.DataFrame({'frame': frames, 'person': found.ids, 'row': np.arange(len(frames)), 'stamp': found.stamps})
    pairs = rows.merge(rows.assign(frame=rows.frame + 1), on=['frame', 'person'], suffixes=('', '_before'))
    part = (delay * 1e9 / (pairs.stamp - pairs.stamp_before)).to_numpy()[:, np.newaxis, np.newaxis]
    return replace(found, stamps=found.stamps[pairs.row], ids=found.ids[pairs.row], sigma=found.sigma[pairs.row],
                   points=(1 - part) * found.points[pairs.row] + part * found.points[pairs.row_before])


def stage(folder: Path) -> List[Tuple[object, ...]]:
    """Return the table of a folder."""
    recorded, rows = record(folder), [HEAD]
    for case in cases(len(recorded)):
        late = [(DELAY * (number == case.stamped), DELAY * (number == case.seen)) for number in range(len(recorded))]
        given = [recording(camera, number not in case.rgb, *late[number]) for number, camera in enumerate(recorded)]
        apart = float(np.linalg.norm(recorded[0].pose[1] - recorded[1].pose[1]))
        params = CalibrationParams(distance=(recorded[0].name, recorded[1].name, apart) if case.distance else None)
        took, found = elapsed(lambda given=given, params=params: calibrate(given, params))
        true = [SimpleNamespace(pose=camera.pose, clock=sum(delays)) for camera, delays in zip(recorded, late)]
        angle, position, clock = rig_errors(found.rig, true).max(axis=0)
        expected = found.std.max(axis=0)
        rows.append((case.title, f'{angle:.2f}', f'{1e3 * position:.1f}', f'{1e3 * clock:.1f}',
                     f'{expected[0]:.2f}, {1e3 * expected[1]:.0f}, {1e3 * expected[2]:.1f}',
                     f'{up_error(found.rig, true):.1f}', f'{took / 1e3:.1f}'))
    return rows


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('stage', type=Path, help='folder with the sequences of cameras')
    sys.stdout.write(markdown(stage(parser.parse_args().stage)))
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

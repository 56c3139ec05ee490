#!/usr/bin/python3
"""Measure how well cameras are placed to one another by the people that they see, without a prior.

Told are the largest errors of all cameras to the first one: angle [degrees], position [mm], clock [ms], what the
calibration itself expects of the worst camera (1 sigma), and of the vertical [degrees].

Simulated rigs: cameras around walking people, 10 s at 15 Hz, errors of 15 mm per axis; medians and worst of --seeds.
--stage: a folder with one sequence per camera (see fusion.py), on which the chain of the project runs, mode balanced. A
camera that sees late has its joints interpolated between its frames, so that they are those of an earlier time.

    benchmarks/calibration.py --seeds 5
    benchmarks/calibration.py --seeds 0 --stage STAGE
"""
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np

from common import Parser, elapsed, errors_end_the_program, markdown
from fusion import Recorded, record
from openpose_ros_fusion.rig import RigCamera
from openpose_ros_tools.calibration.calibrate import Calibrated, CalibrationParams, calibrate
from openpose_ros_tools.calibration.recording import CameraRecording
from simulated_room import around, record_all
from skeleton_extract_3d.people import MEASURED
from skeleton_extract_3d.points.transform import Transform

# Frames of a recording begin at this time [s].
BEGIN = 100.0
HEAD = ('case', 'angle deg', 'position mm', 'clock ms', 'expected', 'up deg', 'seconds')


@dataclass(frozen=True)
class Case:
    """How the recorded cameras are given to the calibration.

    Attributes:
        rgb: numbers of those whose depth is withheld.
        stamped, seen: by which the stamps of a camera, and what it sees, are late [s].
        scale: 'stature' or 'distance': what is told of a rig without depth.
    """

    title: str
    rgb: Tuple[int, ...] = ()
    stamped: Dict[int, float] = field(default_factory=dict)
    seen: Dict[int, float] = field(default_factory=dict)
    scale: str = ''


def cases(number: int) -> List[Case]:
    """Return the cases for a number of cameras."""
    everyone = tuple(range(number))
    return [
        Case('depth'),
        *(Case(f'stamps of camera {camera} 70 ms late', stamped={camera: 0.07}) for camera in everyone[1:]),
        *(Case(f'camera {camera} sees 70 ms late', seen={camera: 0.07}) for camera in everyone[1:]),
        *(Case(f'camera {camera} without depth', (camera,)) for camera in everyone),
        Case('camera 0 with depth, the others without', everyone[1:]),
        Case('no depth, mean stature of adults', everyone),
        Case('no depth, distance of two cameras given', everyone, scale='distance')]


def recording(camera: Recorded, has_depth: bool, stamped: float, seen: float) -> CameraRecording:
    """Return what one camera saw, as the calibration takes it."""
    stamps, ids, points, sigma = [], [], [], []
    for stamp, people, image in camera.frames:
        measured = people.status == MEASURED
        there = np.where(measured[..., np.newaxis], people.xyz, np.nan) if has_depth else (
            camera.model.rays(image.xy.reshape(-1, 2)).reshape(len(image), -1, 3))
        whose = people.ids if has_depth else image.ids
        stamps.append(np.full(len(whose), round((BEGIN + stamp + stamped) * 1e9), np.int64))
        ids.append(whose)
        points.append(there)
        sigma.append(np.where(measured, people.sigma, np.nan) if has_depth else np.full(there.shape[:2], np.nan))
    found = CameraRecording(camera.name, 'camera', np.concatenate(stamps), np.concatenate(ids).astype(np.int64),
                            np.concatenate(points).astype(np.float64), np.concatenate(sigma).astype(np.float64),
                            has_depth, float(camera.model.matrix[0, 0]))
    return delayed(found, seen) if seen else found


def delayed(found: CameraRecording, delay: float) -> CameraRecording:
    """Return the recording of a camera that sees late: rows between two frames, with the later stamp."""
    frames, row_of = np.unique(found.stamps), {}
    for row, key in enumerate(zip(found.stamps.tolist(), found.ids.tolist())):
        row_of[key] = row
    before = dict(zip(frames[1:].tolist(), frames[:-1].tolist()))
    rows, old, share = [], [], []
    for (stamp, person), row in row_of.items():
        if (before.get(stamp), person) in row_of:
            rows.append(row)
            old.append(row_of[before[stamp], person])
            share.append(delay * 1e9 / (stamp - before[stamp]))
    part = np.array(share)[:, np.newaxis, np.newaxis]
    return replace(found, stamps=found.stamps[rows], ids=found.ids[rows], sigma=found.sigma[rows],
                   points=(1 - part) * found.points[rows] + part * found.points[old])


def errors(found: Calibrated, truth: Sequence[Transform], clocks: Sequence[float]) -> Tuple[float, ...]:
    """Return the largest errors: angle [degrees], position [mm], clock [ms], and that of up [degrees]."""
    def relative(pose: Transform, root: Transform) -> Transform:
        return root[0].T @ pose[0], root[0].T @ (pose[1] - root[1])

    def angle(cosine: float) -> float:
        return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))

    cameras: Sequence[RigCamera] = found.rig.cameras
    rows = []
    for camera, pose, clock in zip(cameras[1:], truth[1:], clocks[1:]):
        one, other = relative(camera.pose, cameras[0].pose), relative(pose, truth[0])
        rows.append((angle((np.trace(one[0].T @ other[0]) - 1) / 2), 1e3 * float(np.linalg.norm(one[1] - other[1])),
                     1e3 * abs(camera.clock_offset - clocks[0] + clock)))
    up = angle(float(cameras[0].pose[0].T[:, 2] @ truth[0][0].T[:, 2]))
    return (*np.max(rows, axis=0).tolist(), up)


def row(title: str, found: Calibrated, wrong: Sequence[float], seconds: float) -> Tuple[object, ...]:
    """Return a row of the table."""
    angle, position, clock = found.std.max(axis=0)
    return (title, f'{wrong[0]:.2f}', f'{wrong[1]:.1f}', f'{wrong[2]:.1f}',
            f'{angle:.2f}, {1e3 * position:.0f}, {1e3 * clock:.1f}', f'{wrong[3]:.1f}', f'{seconds:.1f}')


def stage(folder: Path) -> List[Tuple[object, ...]]:
    """Return the table of a folder."""
    recorded = record(folder)
    truth = [camera.pose for camera in recorded]
    rows: List[Tuple[object, ...]] = [HEAD]
    for case in cases(len(recorded)):
        late = [(case.stamped.get(number, 0.0), case.seen.get(number, 0.0)) for number in range(len(recorded))]
        given = [recording(camera, number not in case.rgb, *late[number]) for number, camera in enumerate(recorded)]
        distance: Optional[Tuple[str, str, float]] = None
        if case.scale == 'distance':
            apart = float(np.linalg.norm(truth[0][1] - truth[1][1]))
            distance = (recorded[0].name, recorded[1].name, apart)
        params = CalibrationParams(distance=distance)
        took, found = elapsed(lambda given=given, params=params: calibrate(given, params))
        rows.append(row(case.title, found, errors(found, truth, [sum(each) for each in late]), took / 1e3))
    return rows


def simulated(seeds: int) -> List[Tuple[object, ...]]:
    """Return the table of simulated rigs."""
    rows: List[Tuple[object, ...]] = [('case', 'angle deg', 'position mm', 'clock ms', 'up deg')]
    for title, depth, people in (('4 cameras, 2 people', True, 2), ('4 cameras, 1 person', True, 1),
                                 ('4 cameras, 2 people, one camera with depth', False, 2)):
        found = []
        for seed in range(seeds):
            cameras = [replace(camera, clock=clock) for camera, clock in zip(around(4), (0.0, 0.07, -0.2, 0.4))]
            cameras = [replace(camera, depth=depth or not number) for number, camera in enumerate(cameras)]
            result = calibrate(record_all(cameras, people=people, seed=seed))
            found.append(errors(result, [camera.pose for camera in cameras], [camera.clock for camera in cameras]))
        median, worst = np.median(found, axis=0), np.max(found, axis=0)
        rows.append((title, *(f'{one:.2f} ({other:.2f})' for one, other in zip(median, worst))))
    return rows


def main() -> None:
    """Run the benchmark from the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--seeds', type=int, default=5, help='simulated rigs of each kind (default: %(default)s)')
    parser.add_argument('--stage', type=Path, help='folder with the sequences of cameras')
    options = parser.parse_args()
    with errors_end_the_program():
        if options.seeds:
            sys.stdout.write(markdown(simulated(options.seeds)))
        if options.stage:
            sys.stdout.write(markdown(stage(options.stage)))


if __name__ == '__main__':
    main()

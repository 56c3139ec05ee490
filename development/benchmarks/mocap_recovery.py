#!/usr/bin/python3
"""Measure how well clock offset and camera pose are found between poses and motion capture, without a prior.

From the truth of sequence folders (gt.json) both recordings are made: poses with noise, outliers, hidden joints and
dropped frames, and motion capture at 120 Hz by another clock and in another frame of reference. With --poses, the
poses are the CSV files that `benchmarks/accuracy_3d.py SEQUENCES --out FOLDER` wrote: those of the real detector, whose
joints are not quite those of the truth.

    benchmarks/mocap_recovery.py skeleton_extract_3d/demo/cross --seeds 10
    benchmarks/mocap_recovery.py SEQUENCE [SEQUENCE ...] --poses FOLDER

Told are the errors of the offset [ms], of the rotation [degrees], and of the place of the camera [mm]: at the people,
where it bears on errors of joints, and at the camera, where it is larger by rotation times distance. Limits: a quarter
of a frame, 0.5 degrees, 5 mm. `std` is what the alignment itself expects. Exit status 1: a limit is passed at the
people by the worst seed.
"""
import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from common import Parser, errors_end_the_program, markdown
from openpose_ros_tools.alignment.alignment import AlignmentParams, align
from openpose_ros_tools.tables.keypoint_csv import read_keypoint_csv
from openpose_ros_tools.tables.keypoint_table import measured_people
from simulated_mocap import CAMERA_START, Simulated, errors, sequence_truth, simulate

# Of offset in frames, rotation [degrees], translation [mm].
LIMITS = (0.25, 0.5, 5.0)


def scene_of(folder: Path, seed: int, options: argparse.Namespace) -> Simulated:
    """Return both recordings of a sequence."""
    scene = simulate(sequence_truth(folder), seed, noise=1e-3 * options.noise / np.sqrt(3))
    if options.poses is None:
        return scene
    poses = read_keypoint_csv(options.poses / f'{folder.resolve().parent.name}_{folder.resolve().name}.csv')
    return replace(scene, estimate=replace(poses, stamps=poses.stamps + np.int64(1e9 * CAMERA_START)))


def main() -> int:
    """Run the benchmark from the command line; return 1 if a limit is passed."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders with gt.json')
    parser.add_argument('--seeds', type=int, default=10, help='recordings of each (default: %(default)s)')
    parser.add_argument('--noise', type=float, default=15.0, metavar='MM',
                        help='root mean square distance of measured joints from the truth [mm] (default: %(default)s)')
    parser.add_argument('--poses', type=Path, help='folder with the CSV of accuracy_3d.py, in place of noise')
    parser.add_argument('--use-sigma', action='store_true', help='weigh joints by 1 / sigma^2')
    options = parser.parse_args()
    passed = True
    table = [('sequence', 'offset [ms]', '[frames]', 'rotation [deg]', 'at people [mm]', 'at camera [mm]',
              'recordings within limits')]
    with errors_end_the_program():
        for folder in options.sequences:
            rows, expected = [], []
            for seed in tqdm(range(options.seeds), desc=folder.name, disable=None, leave=False):
                scene = scene_of(folder, seed, options)
                found = align(measured_people(scene.estimate), scene.reference,
                              AlignmentParams(use_sigma=options.use_sigma))
                rows.append(errors(scene, found))
                expected.append((1e3 * found.clock_std, found.rotation_std, 1e3 * found.translation_std))
            frame = 1e3 * np.median(np.diff(np.unique(scene.estimate.stamps))) * 1e-9
            offset, angle, people, camera = np.array(rows).T
            std = np.median(expected, axis=0)
            within = [(error <= limit).sum() for error, limit in zip((offset / frame, angle, people), LIMITS)]
            passed &= min(within) == options.seeds
            table.append((folder.name, f'{_spread(offset, 1)} ± {std[0]:.1f}', _spread(offset / frame, 2),
                          f'{_spread(angle, 2)} ± {std[1]:.2f}', f'{_spread(people, 1)} ± {std[2]:.1f}',
                          _spread(camera, 1), f'{" ".join(map(str, within))} of {options.seeds}'))
    print('median (worst) of the errors; ± what the alignment expects (median)\n')
    print(markdown(table))
    print('PASS' if passed else 'FAIL')
    return 0 if passed else 1


def _spread(values: np.ndarray, digits: int) -> str:
    return f'{np.median(values):.{digits}f} ({values.max():.{digits}f})'


if __name__ == '__main__':
    sys.exit(main())

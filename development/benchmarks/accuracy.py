#!/usr/bin/python3
"""Measure the 3D chain, without ROS, on RGB-D sequences with known joints (see chain_runs.py).

Prints the figures of each sequence, and of all with their 95 % intervals by bootstrap over sequences (scoring/).
Without sequences: the small ones of this repository. Each frame is searched in full before its people count, as
process_bag does; with --budget, people count before the search, as in the nodes, and the networks may do that much work
per frame, in units of one pass of mobilenet_thin over 656 x 368 pixels; work counts pixels, not time.

    ./run bench accuracy
    ./run bench accuracy SEQUENCE [SEQUENCE ...] --set mode=balanced
    ./run bench accuracy SEQUENCE --exact-2d
    ./run bench accuracy SEQUENCE --set lifting=mean3x3 --set tracking=false   # the original
"""
import sys
from pathlib import Path
from typing import Sequence

import numpy as np
import pandas as pd

import chain_runs
from common import SCENES, Parser, markdown, scenes_of
from ground_truth import VISIBLE, true_frames
from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.command_line import add_settings, run_command, setting_values
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import keypoints_in
from openpose_ros_pkg.skeletons import COCO_18
from scoring.figures import figures, rows_of
from scoring.people import STATISTICS, TABLE, score_people
from skeleton_extract_3d.chain_settings import ChainSettings

# In the image: maximum median distance of the joints of a person from the true ones, in half diagonals; visible joints
# of a person that counts; a joint is near [px].
SAME_IN_IMAGE, LEAST_VISIBLE, NEAR = 0.5, 4, 20


def report_2d(folders: Sequence[Path], runs: Sequence[chain_runs.Run]) -> str:
    """Return the people found in the images, how exactly, and the work, as text."""
    count = found = joints = near = 0
    for folder, run in zip(folders, runs):
        for true, people in zip(true_frames(folder), run.people):
            found_xy = keypoints_in(people.keypoints, people.skeleton, COCO_18)[..., :2]
            apart = true.apart_in_image(found_xy)
            found_as = dict(match(apart, apart < SAME_IN_IMAGE))
            for row, (uv, visible) in enumerate(zip(true.uv, true.labels == VISIBLE)):
                if visible.sum() >= LEAST_VISIBLE:
                    count, joints, found = count + 1, joints + visible.sum(), found + (row in found_as)
                    there = found_xy[found_as[row]] if row in found_as else np.full_like(uv, np.nan)
                    near += (np.linalg.norm(there - uv, axis=1)[visible] < NEAR).sum()
    text = f'in the image: {found / count:.3f} of the people, {near / joints:.3f} of the visible joints within 20 px'
    work = pd.DataFrame([(len(people), done) for run in runs for people, done in zip(run.people, run.work)])
    by_people = ', '.join(f'{number}: {mean:.2f}' for number, mean in work.groupby(0)[1].mean().items())
    return f'{text}\nwork per frame: {work[1].mean():.2f}, at most {work[1].max():.2f}; by people {by_people}'


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='*', type=Path, help='sequence folders')
    parser.add_argument('--exact-2d', action='store_true', help='take the true pixels instead of the detector')
    add_settings(parser, 'of the chain')
    parser.add_argument('--budget', type=float, default=0.0, help='search after each frame, with this work per frame')
    parser.add_argument('--floor', action='store_true', help='the true floor is known, as with use_floor')
    arguments = parser.parse_args()
    folders = arguments.sequences or scenes_of(SCENES)
    settings = build(ChainSettings, setting_values(parser, arguments.settings))
    finder = chain_runs.Finder(settings, arguments.budget, exact=arguments.exact_2d)
    # z of the world by the coordinates of the camera
    runs = [finder.run(folder, chain_runs.camera_poses(folder)[:, 2] if arguments.floor else None)
            for folder in folders]
    detecting, estimating = 1e3 * np.median([times for run in runs for times in run.times], axis=0)
    print(f'median ms per frame: 2D {detecting:.1f}, 3D {estimating:.2f}')
    if not arguments.exact_2d:
        print(report_2d(folders, runs))
    counts = [score_people(folder, run.frames) for folder, run in zip(folders, runs)]
    rows = rows_of({**{f'{number}: {each.scene}': [each] for number, each in enumerate(counts, 1)}, 'all': counts},
                   STATISTICS, TABLE, 'scene')
    print(markdown(rows), 'all, with 95 % intervals; of less than five scenes they are hardly more than their range:',
          *(f'{each.text}: {each.interval} {each.unit}'.rstrip() + f', n {each.n}'
            for each in figures(counts, STATISTICS).values()), sep='\n')
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

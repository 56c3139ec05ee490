#!/usr/bin/python3
"""Ablation of the fusion: each constant at half and at twice its value; what moves by how much.

Simulated cameras round walking people lose people, give them new ids, err for a while, are late and stand a little
elsewhere. Recorded stages: folders with one sequence per camera (see chain_runs.py), run through the chain once.

    ./run bench ablation fusion --stories 12 STAGE...
"""
import sys
from functools import partial
from pathlib import Path
from typing import Any, List, Sequence, Tuple

import numpy as np

from ablation_tools import command, rigs
from ablation_tools.changes import counted
from ablation_tools.kept import found_in
from ablation_tools.variants import constant_paths, with_values
from chain_runs import VISIBLE, camera_poses, open_sequence, read_truth
from common import Parser
from openpose_ros_fusion.constants import FUSION, FusionConstants
from openpose_ros_fusion.observations import Sighting, from_image, from_space
from openpose_ros_pkg.command_line import run_command

PEOPLE = ('depth', 'rgb', 'mixed', 'stages')
SUITES = {**dict.fromkeys(('association', 'estimate', 'motion'), PEOPLE),
          'collector': ('collector',), 'cameras': ('judge',), 'single_view': ('rgb', 'mixed', 'stages'), 'shape': ()}


def record(stage: Path, cache: Path) -> List[Any]:
    """Return name, model, pose and frames (stamp [s], people in space and in the image) of the cameras of a folder."""
    recorded = []
    for folder in sorted(stage.glob('cam*')):
        source, (in_space, in_image) = open_sequence(folder), found_in(folder, cache / stage.name)
        pose = camera_poses(folder, source)[0]
        recorded.append((folder.name, source.camera, (pose[:3, :3], pose[:3, 3]),
                         [(stamp, people, image) for (stamp, people), image in zip(in_space, in_image)]))
    return recorded


def cases_of(stage: Path, recorded: List[Any]) -> List[Any]:
    """Return how cameras are given to the fusion: all, two of them, one; with depth, one with depth, none."""
    truth, order = read_truth(stage, 'gt_world.json')
    names = [name for name, *_ in recorded]
    ids = sorted({person['id'] for frame in truth['frames'] for person in frame['people']})
    joints, visible = [], []
    for frame in truth['frames']:
        by_id = {person['id']: person for person in frame['people']}
        joints.append(np.array([np.array(by_id[name]['xyz'], float)[order] if name in by_id
                                else np.full((len(order), 3), np.nan) for name in ids]))
        visible.append({name: np.array([np.array(by_id[one]['vis'][name])[order] == VISIBLE if one in by_id
                                        else np.zeros(len(order), bool) for one in ids]) for name in names})
    every = tuple(range(len(recorded)))
    chosen = [(every, ()), (every[:2], ()), (every[:1], ()), (every, every), (every, every[1:]), (every[:2], every)]
    found = []
    for cameras, rgb in chosen:
        seen_by = [np.any([frame[names[camera]] for camera in cameras], axis=0) for frame in visible]
        kept = [one.any(axis=1) for one in seen_by]
        found.append((partial(sightings_of, recorded, cameras, rgb), [joint[keep] for joint, keep in zip(joints, kept)],
                      [one[keep] for one, keep in zip(seen_by, kept)], 'stage rays ' if rgb == every else 'stage '))
    return found


def sightings_of(recorded: List[Any], cameras: Sequence[int], rgb: Sequence[int], constants: FusionConstants
                 ) -> List[Tuple[float, List[Sighting]]]:
    """Return stamp and sightings of each frame by some cameras, of which those of `rgb` have no depth."""
    frames = []
    for number, (stamp, *_) in enumerate(recorded[0][3]):
        seen = [(recorded[camera], *recorded[camera][3][number], camera in rgb) for camera in cameras]
        frames.append((stamp, [from_image(name, at, image, model, pose, constants.estimate) if no_depth
                               else from_space(name, at, people, pose, constants.estimate)
                               for (name, model, pose, _), at, people, image, no_depth in seen]))
    return frames


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('stages', nargs='*', type=Path, help='folders with one sequence per camera')
    parser.add_argument('--stories', type=int, default=12, help='simulated stories of each kind (default: %(default)s)')
    command.add_options(parser)
    arguments = parser.parse_args()
    suites = rigs.suites(arguments.stories)
    cases = [case for stage in arguments.stages for case in cases_of(stage, record(stage, arguments.cache))]
    if cases:
        suites['stages'] = partial(counted, rigs.count_fused, cases)
    command.run(constant_paths(FUSION), partial(with_values, FUSION), suites, SUITES, arguments)
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

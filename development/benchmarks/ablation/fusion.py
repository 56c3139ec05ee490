#!/usr/bin/python3
"""Ablation of the fusion: each constant at half and at twice its value; what moves by how much.

Simulated cameras round walking people lose people, give them new ids, err for a while, are late and stand a little
elsewhere. Recorded stages: folders with one sequence per camera (see chain_runs.py), run through the chain once.

    ./run bench ablation fusion --stories 12 STAGE...
"""
import pickle
import sys
from functools import partial
from pathlib import Path
from typing import Any, Dict, List, Tuple

import numpy as np

import simulated_fusion as simulated
from ablation_table import FACTORS, NEAR_FACTORS, changes, names_of, print_base, table, variants
from chain_runs import VISIBLE, Finder, camera_poses, open_sequence, read_truth
from common import Parser
from openpose_ros_fusion.constants import FUSION, FusionConstants
from openpose_ros_fusion.observations import from_image, from_space
from openpose_ros_pkg.command_line import run_command
from openpose_ros_pkg.params.parameters import build
from skeleton_extract_3d.chain_settings import ChainSettings

PEOPLE = ('depth', 'rgb', 'mixed', 'stages')
SUITES = {'collector': ('collector',), 'cameras': ('judge',), 'single_view': ('rgb', 'mixed', 'stages')}


def record(stage: Path, cache: Path) -> List[Any]:
    """Return model, pose and frames of the cameras of a folder."""
    path = cache / f'{stage.resolve().parent.name}_{stage.name}_cameras.pickle'
    if not path.is_file():
        recorded = []
        for folder in sorted(stage.glob('cam*')):
            source = open_sequence(folder)
            run, pose = Finder(build(ChainSettings, {})).run(source), camera_poses(folder, source)[0]
            recorded.append((folder.name, source.camera, (pose[:3, :3], pose[:3, 3]),
                             [(stamp, people, image) for (stamp, people), image in zip(run.frames, run.people)]))
        cache.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps(recorded))
    return pickle.loads(path.read_bytes())  # noqa: S301  a file of this program


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
        def make(constants: FusionConstants, cameras: Any = cameras, rgb: Any = rgb) -> Any:
            frames = []
            for number in range(len(joints)):
                sightings = []
                for camera in cameras:
                    name, model, pose, seen = recorded[camera]
                    stamp, people, image = seen[number]
                    sightings.append(from_image(name, stamp, image, model, pose, constants.estimate) if camera in rgb
                                     else from_space(name, stamp, people, pose, constants.estimate))
                frames.append((recorded[0][3][number][0], sightings))
            return frames
        seen_by = [np.any([frame[names[camera]] for camera in cameras], axis=0) for frame in visible]
        kept = [one.any(axis=1) for one in seen_by]
        found.append((make, [joint[keep] for joint, keep in zip(joints, kept)],
                      [one[keep] for one, keep in zip(seen_by, kept)], 'stage rays ' if rgb == every else 'stage '))
    return found


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('stages', nargs='*', type=Path, help='folders with one sequence per camera')
    parser.add_argument('--stories', type=int, default=12, help='simulated stories of each kind (default: %(default)s)')
    parser.add_argument('--only', default='', help='constants whose dotted names begin like this')
    parser.add_argument('--before', type=Path, help='counts to compare with; the file is written if it is not there')
    parser.add_argument('--suites', nargs='*', default=(), help='these alone')
    parser.add_argument('--near', action='store_true', help='factors 0.8 and 1.25: which constants are fragile')
    parser.add_argument('--cache', type=Path, default=Path('logs/ablation'), help='folder for the people of cameras')
    arguments = parser.parse_args()
    suites = simulated.suites(arguments.stories)
    cases = [case for stage in arguments.stages for case in cases_of(stage, record(stage, arguments.cache))]
    if cases:
        suites['stages'] = partial(simulated.score_recorded, cases)
    factors = NEAR_FACTORS if arguments.near else FACTORS
    suites = {name: score for name, score in suites.items() if not arguments.suites or name in arguments.suites}
    base = {suite: score(FUSION) for suite, score in suites.items()}
    print_base(base, arguments.before)
    names = [name for name in names_of(FUSION) if name.startswith(arguments.only) and name != 'shape.keypoints']
    found: Dict[Tuple[str, str], Any] = {}
    for variant in variants(FUSION, names, factors):
        run = [suite for suite in SUITES.get(variant.name.split('.')[0], PEOPLE) if suite in suites]
        found[variant.name, variant.how] = {figure: change for suite in run for figure, change in changes(
            base[suite], suites[suite](variant.constants)).items()}
        print(variant.name, variant.how, {k: tuple(round(float(x), 3) for x in v[:3]) for k, v in found[variant.name, variant.how].items()
                                          if v.is_clear}, file=sys.stderr, flush=True)
    print(table(FUSION, found, [*factors]))
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

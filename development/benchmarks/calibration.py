#!/usr/bin/python3
"""Fit the calibration of sigma (skeleton_extract_3d.track.calibration) to scenes with known joints.

The chain runs on each scene in the modes fast and balanced, searched in full and followed, without calibration. The
changes of sigma minimise the quantile loss of errors (Koenker and Bassett, Econometrica 1978), so that `WITHIN` of them
are within 2 sigma whatever is known of a joint. Sigma never falls where what is stated or the distance grows, nor grows
with the share of joints that are MEASURED. Printed: the fields of `SigmaConstants`.

    ./run bench calibration SCENE ... --out FOLDER     # keeps what was counted; empty it after changes
"""
import sys
from pathlib import Path
from typing import List, Tuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from ablation import changed, in_place_of
from chain_runs import Finder
from common import Parser
from openpose_ros_pkg.command_line import run_command
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import COCO_18
from scoring.counts import Counts, load
from scoring.people import score_people
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.people import INFERRED
from skeleton_extract_3d.track.calibration import kinds_of, share_measured
from skeleton_extract_3d.track.feet import FEET

# Mode, and work of the networks per frame (0: all of the image is searched).
RUNS = (('fast', 0.0), ('fast', 0.6), ('balanced', 0.0), ('balanced', 0.6))
# Share of the errors that 2 sigma is to hold: some more than what is said, as scenes differ.
WITHIN = 0.955
# Weight of the squared changes, in units of the mean loss; width of the rounded corner of the loss. Chosen.
RIDGE, CORNER = 3e-4, 0.03
# Least factor of sigma where what is stated grows: less would turn their order. Chosen.
ORDER = 0.9
# What is known of a joint, in the order of `SigmaConstants.knots`.
EVIDENCE = ('sigma', 'share', 'distance')


def counted(folders: List[Path], out: Path) -> pd.DataFrame:
    """Return the rows of the joints of scenes in all runs, see `rows_of`, with weights: each run has the same."""
    bare, runs = METHOD, []
    for field in ('joints', 'evidence'):
        bare = changed(bare, ['track', 'sigma', field], 0.0)
    with in_place_of(METHOD, bare):
        for mode, budget in RUNS:
            finder, found = Finder(build(ChainSettings, {'mode': mode, 'threads': 1}), budget), []
            for folder in folders:
                path = out / f'{mode}_{budget:g}_{folder.name}.npz'
                if not path.is_file():
                    score_people(folder, finder.run(folder).frames).save(path)
                found.append(rows_of(load(path)))
            run = pd.concat(found)
            runs.append(run.assign(weight=1 / len(run) / len(RUNS)))
    return pd.concat(runs)


def rows_of(counts: Counts) -> pd.DataFrame:
    """Return the joints of a scene that was counted: logarithm of error by stated sigma, status, kind, EVIDENCE."""
    share, parts = share_measured(counts.rows['joints']['status'].reshape(-1, len(COCO_18.joints))), []
    for name, joints in (('joints', COCO_18.joints), ('feet', FEET)):
        rows = counts.rows[name].reshape(-1, len(joints))
        columns = {'error': rows['error'], 'inferred': rows['status'] == INFERRED, 'kind': kinds_of(joints),
                   'sigma': rows['sigma'], 'share': share, 'distance': rows['distance']}
        table = pd.DataFrame({key: np.broadcast_to(each, rows.shape).ravel() for key, each in columns.items()})
        parts.append(table[(table.error > 0) & (table.sigma > 0)])
    joined = pd.concat(parts)
    return joined.assign(ratio=np.log(joined.error / joined.sigma))


def design_of(rows: pd.DataFrame) -> Tuple[np.ndarray, List[Tuple[float, float]]]:
    """Return what each unknown adds to the logarithm of sigma (N, M), and the bounds of the unknowns, (M,).

    Unknown for each status are the change of each kind of joint, then by each evidence its steps from knot to knot.
    """
    constants, columns, bounds = METHOD.track.sigma, [], []
    for inferred in (False, True):
        own = (rows.inferred.to_numpy() == inferred)[:, None]
        columns.append(own * (rows.kind.to_numpy()[:, None] == np.arange(constants.joints.shape[1])))
        bounds += [(-np.inf, np.inf)] * constants.joints.shape[1]
        for number, (name, knots) in enumerate(zip(EVIDENCE, constants.knots)):
            lows, highs = knots[:-1], knots[1:]
            columns.append(own * np.clip((rows[name].to_numpy()[:, None] - lows) / (highs - lows), 0, 1))
            bounds += [[(-ORDER * (high - low) / high, np.inf), (-np.inf, 0), (0, np.inf)][number]
                       for low, high in zip(lows, highs)]
    return np.concatenate(columns, axis=1), bounds


def fitted(rows: pd.DataFrame) -> Tuple[np.ndarray, np.ndarray]:
    """Return `SigmaConstants.joints` and `.evidence`."""
    (design, bounds), ratio, weight = design_of(rows), rows.ratio.to_numpy(), rows.weight.to_numpy()

    def loss(unknown: np.ndarray) -> Tuple[float, np.ndarray]:
        left = ratio - design @ unknown - np.log(2)
        size = np.where(abs(left) < CORNER, left ** 2 / CORNER / 2 + CORNER / 2, abs(left))
        slope = weight * (np.clip(left / CORNER, -1, 1) / 2 + WITHIN - 0.5)
        return (weight @ (size / 2 + (WITHIN - 0.5) * left) + RIDGE * unknown @ unknown,
                2 * RIDGE * unknown - design.T @ slope)

    shape = METHOD.track.sigma.evidence.shape
    found = minimize(loss, np.zeros(len(bounds)), jac=True, method='L-BFGS-B', bounds=bounds, options={'maxiter': 500})
    unknown = found.x.reshape(2, -1)
    kinds = unknown.shape[1] - shape[0] * (shape[2] - 1)
    steps = np.cumsum(unknown[:, kinds:].reshape(2, shape[0], -1), axis=2)
    return unknown[:, :kinds], np.insert(steps, 0, 0.0, axis=2).swapaxes(0, 1)


def main() -> int:
    """Run the fit from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('scenes', nargs='+', type=Path)
    parser.add_argument('--out', type=Path, default=Path('build/calibration'))
    arguments = parser.parse_args()
    rows = counted(arguments.scenes, arguments.out)
    print(f'{np.bincount(rows.inferred.astype(int))} joints MEASURED, INFERRED')
    for name, values in zip(('joints', 'evidence'), fitted(rows)):
        print(name, np.array2string(np.round(values, 2), separator=', ', max_line_width=110), sep='\n')
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

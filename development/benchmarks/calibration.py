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
from typing import List, NamedTuple, Tuple

import numpy as np
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


class Rows(NamedTuple):
    """N joints: logarithm of error by stated sigma, status and kind, evidence (3, N), weights; see `SigmaConstants`."""

    ratio: np.ndarray
    inferred: np.ndarray
    kind: np.ndarray
    evidence: np.ndarray
    weight: np.ndarray


def counted(folders: List[Path], out: Path) -> Rows:
    """Return the joints of scenes in all runs, each of the same weight."""
    bare, parts = METHOD, []
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
            rows = Rows(*(np.concatenate(values, axis=-1) for values in zip(*found)))
            parts.append(rows._replace(weight=rows.weight / len(rows.weight) / len(RUNS)))
    return Rows(*(np.concatenate(values, axis=-1) for values in zip(*parts)))


def rows_of(counts: Counts) -> Rows:
    """Return the joints of a scene that was counted."""
    parts, share = [], np.zeros((0, 1))
    for name, joints in (('joints', COCO_18.joints), ('feet', FEET)):
        rows = counts.rows[name].reshape(-1, len(joints))
        if name == 'joints':
            share = share_measured(rows['status'])
        known = (rows['error'] > 0) & (rows['sigma'] > 0)
        evidence = np.array(np.broadcast_arrays(rows['sigma'], share, rows['distance']))[:, known]
        parts.append(Rows(np.log(rows['error'][known] / rows['sigma'][known]), rows['status'][known] == INFERRED,
                          np.broadcast_to(kinds_of(joints), rows.shape)[known], evidence, np.ones(known.sum())))
    return Rows(*(np.concatenate(values, axis=-1) for values in zip(*parts)))


def design_of(rows: Rows) -> Tuple[np.ndarray, List[Tuple[float, float]]]:
    """Return what each unknown adds to the logarithm of sigma (N, M), and the bounds of the unknowns, (M,).

    Unknown for each status are the change of each kind of joint, then by each evidence its steps from knot to knot.
    """
    constants, columns, bounds = METHOD.track.sigma, [], []
    for inferred in (False, True):
        own = (rows.inferred == inferred)[:, None]
        columns.append(own * (rows.kind[:, None] == np.arange(constants.joints.shape[1])))
        bounds += [(-np.inf, np.inf)] * constants.joints.shape[1]
        for number, (value, knots) in enumerate(zip(rows.evidence, constants.knots)):
            lows, highs = knots[:-1], knots[1:]
            columns.append(own * np.clip((value[:, None] - lows) / (highs - lows), 0, 1))
            bounds += [[(-ORDER * (high - low) / high, np.inf), (-np.inf, 0), (0, np.inf)][number]
                       for low, high in zip(lows, highs)]
    return np.concatenate(columns, axis=1), bounds


def fitted(rows: Rows) -> Tuple[np.ndarray, np.ndarray]:
    """Return `SigmaConstants.joints` and `.evidence`."""
    design, bounds = design_of(rows)

    def loss(unknown: np.ndarray) -> Tuple[float, np.ndarray]:
        left = rows.ratio - design @ unknown - np.log(2)
        size = np.where(abs(left) < CORNER, left ** 2 / CORNER / 2 + CORNER / 2, abs(left))
        slope = rows.weight * (np.clip(left / CORNER, -1, 1) / 2 + WITHIN - 0.5)
        return (rows.weight @ (size / 2 + (WITHIN - 0.5) * left) + RIDGE * unknown @ unknown,
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

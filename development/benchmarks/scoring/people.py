"""People in the frame of a camera, or fused in the world, against the true joints of a scene.

People of a frame are paired with true ones by the median distance of the joints that are visible in truth, of all
joints where fewer than three are, at most `GATE` apart. Labels of true joints: 2 visible; hidden by 1 the own body, 3
another person, 4 furniture; 0 outside the image, which does not count. A share counts all joints of its kind, those
without a position as wrong. In the world a person counts in a frame in which a camera sees one of the joints at least;
visible are joints that a camera sees.
"""
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np
import pandas as pd
from scipy.optimize import linear_sum_assignment

from ground_truth import FURNITURE, OTHER_PERSON, OUTSIDE, OWN_BODY, VISIBLE, TrueFrame, true_frames, true_world
from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.people import values_in
from openpose_ros_pkg.skeletons import BODY_25, COCO_18, SkeletonModel
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D
from skeleton_extract_3d.track.feet import FEET

from .counts import WHOLE, Counts, at_times, tags_of
from .figures import Quantile, Ratio, Rows, every, mean_of, of_rows, of_sums, values_of, within

# Maximum median distance of the joints of a person from the true ones [m].
GATE = 0.6
_SIDES = np.array([[COCO_18.index[f'{side}_{joint}'] for side in ('right', 'left')] for joint in ('shoulder', 'hip')])
# A visible joint is right within the first, a hidden one within the second [m].
NEAR, NEAR_HIDDEN = 0.1, 0.15
# One row for each joint of each true person of a frame: errors are NaN where there is no position; in the world the
# number of cameras that see it.
JOINT = np.dtype([('joint', 'u1'), ('label', 'u1'), ('status', 'u1'), ('distance', 'f4'), ('error', 'f8'),
                  ('sigma', 'f8'), ('cameras', 'u1')])
# One row for each visible joint in three consecutive frames: error of the acceleration [m/s^2].
ACCELERATION = np.dtype([('error', 'f8')])
# Toes and heels.
_FEET_ROWS = [BODY_25.index[name] for name in FEET]
# Kinds of scenes in which no person lies, sits or kneels. A visible toe or heel is right within this [m].
UPRIGHT = ('stand', 'turn', 'walk', 'cross', 'meet', 'hand_over', 'hug', 'group')
NEAR_FOOT = 0.06

# Stamp [s], from the first frame of the scene, and people of each frame.
Frames = Sequence[Tuple[float, People3D]]
# Errors of the visible joints (K, 3) [m] of each true person, by id and number of the frame.
Paths = Dict[int, Dict[int, np.ndarray]]


def score_people(folder: Path, frames: Frames, part: slice = WHOLE) -> Counts:
    """Count what was found in a scene.

    Args:
        folder: of the scene, with gt.json and meta.json.
        frames: those at no true time count as `stray` people alone.
        part: of the true frames that count.
    """
    return _score(folder, tags_of(folder), true_frames(folder)[part], frames)


def score_world(folder: Path, frames: Frames, part: slice = WHOLE) -> Counts:
    """Count the fused people that were found in a stage, a folder with gt_world.json; see `score_people`."""
    return _score(folder, {'kind': 'stage'}, true_world(folder)[part], frames)


def _score(folder: Path, tags: Dict[str, str], true: Sequence[TrueFrame], frames: Frames) -> Counts:
    times = [frame.time for frame in true]
    given = [next(iter(found), People3D.empty(BODY_25)) for found in at_times(frames, times)]
    sums: Dict[str, float] = dict.fromkeys(('found', 'true', 'paired', 'all_right', 'exchanged', 'sides'), 0)
    rows: List[np.ndarray] = [np.zeros(0, JOINT)]
    feet: List[np.ndarray] = [np.zeros(0, JOINT)]
    ids: List[Tuple[int, int]] = []
    paths: Paths = {}
    for number, (there, everything) in enumerate(zip(true, given)):
        people, body, visible = found_of(everything), found_of(everything, BODY_25), there.labels == VISIBLE
        pairs = pair(there.xyz, visible, people)
        for name, count in (('true', len(there.ids)), ('found', len(people)), ('paired', len(pairs)),
                            ('all_right', len(pairs) == len(there.ids) == len(people))):
            sums[name] += count
        for row, (xyz, labels) in enumerate(zip(there.feet, there.feet_labels)):
            feet.append(joint_rows(xyz, labels, body, pairs.get(row), _FEET_ROWS))
        for row, cameras in enumerate(np.broadcast_to(there.cameras, there.labels.shape)):
            rows.append(joint_rows(there.xyz[row], there.labels[row], people, pairs.get(row)))
            rows[-1]['cameras'] = cameras
        for row, other in pairs.items():
            sides = exchanged_sides(there.xyz[row], people.xyz[other])
            sums['exchanged'], sums['sides'] = sums['exchanged'] + int(sides.sum()), sums['sides'] + len(sides)
            ids.append((there.ids[row], int(people.ids[other])))
            seen = visible[row] & (people.status[other] != MISSING)
            paths.setdefault(there.ids[row], {})[number] = np.where(
                seen[:, np.newaxis], people.xyz[other] - there.xyz[row], np.nan)
    stray = sum(len(people) for _, people in frames) - sums['found']
    sums.update(frames=len(true), stray=stray, **ids_over_time(ids))
    period = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else 1.0
    return Counts(folder.resolve().name, tags, sums,
                  {'joints': np.concatenate(rows), 'feet': np.concatenate(feet),
                   'accelerations': accelerations(paths, period)})


def found_of(people: People3D, joints: SkeletonModel = COCO_18) -> People3D:
    """Return people with the joints of a set."""
    xyz, confidence, status, sigma, velocity = (
        values_in(getattr(people, name), people.skeleton, joints, missing) for name, missing in (
            ('xyz', np.nan), ('confidence', 0), ('status', MISSING), ('sigma', np.nan), ('velocity', np.nan)))
    return People3D(joints, xyz, confidence, status, sigma, people.ids, velocity)


def pair(true: np.ndarray, visible: np.ndarray, people: People3D) -> Dict[int, int]:
    """Return the row of the found person for each true one (T, K, 3) that was found; `visible` is (T, K)."""
    there = people.status != MISSING
    errors = np.linalg.norm(true[:, np.newaxis] - people.xyz[np.newaxis].astype(np.float64), axis=3)
    costs = np.full(errors.shape[:2], np.inf)
    for row, other in np.ndindex(*costs.shape):
        joints = there[other] & visible[row]
        joints = joints if joints.sum() >= 3 else there[other]
        if joints.any():
            costs[row, other] = np.median(errors[row, other][joints])
    return dict(match(costs, costs <= GATE))


def joint_rows(xyz: np.ndarray, labels: np.ndarray, people: People3D, found: Any, columns: Any = slice(None)
               ) -> np.ndarray:
    """Return the rows of a true person, (K,) JOINT.

    Args:
        found: row of the person among the people; None: it was not found.
        columns: of their joints.
    """
    rows = np.zeros(len(xyz), JOINT)
    rows['joint'], rows['label'], rows['distance'] = np.arange(len(xyz)), labels, xyz[:, 2]
    rows['error'] = rows['sigma'] = np.nan
    if found is not None:
        rows['status'], rows['sigma'] = people.status[found, columns], people.sigma[found, columns]
        there = rows['status'] != MISSING
        rows['error'][there] = np.linalg.norm(people.xyz[found, columns] - xyz, axis=1)[there]
    return rows


def exchanged_sides(true: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Return whether left and right of shoulders and hips are exchanged, (N,) bool, of those pairs with a position.

    Args:
        true, found: (K, 3) joints of a person [m].
    """
    wanted, given, other = true[_SIDES], found[_SIDES], found[_SIDES[:, ::-1]]
    known = np.isfinite(given).all(axis=(1, 2))
    off, off_exchanged = (np.linalg.norm(each - wanted, axis=2).sum(axis=1) for each in (given, other))
    return (off_exchanged < off)[known]


def ids_over_time(pairs: Sequence[Tuple[int, int]]) -> Dict[str, int]:
    """Return the switches of ids, and the pairs that remain where each true person is given one id (Ristani 2016).

    Args:
        pairs: id of a true person and found id, in the order of the frames.
    """
    ids = pd.DataFrame(pairs, columns=['true', 'found'], dtype=int)
    together = pd.crosstab(ids.true, ids.found).to_numpy(float)
    return {'switches': int((ids.groupby('true').found.diff().fillna(0) != 0).sum()),
            'kept': int(together[linear_sum_assignment(-together)].sum())}


def accelerations(paths: Paths, period: float) -> np.ndarray:
    """Return the errors of the acceleration of visible joints, (N,) ACCELERATION; period [s] of the frames."""
    errors = [np.linalg.norm(path[i - 1] - 2 * path[i] + path[i + 1], axis=1) / period ** 2
              for path in paths.values() for i in path if i - 1 in path and i + 1 in path]
    joined = np.concatenate([np.zeros(0), *errors])
    return joined[np.isfinite(joined)].astype(ACCELERATION)


def is_visible(joints: np.ndarray) -> np.ndarray:
    """Return which joints are visible in truth, (N,)."""
    return joints['label'] == VISIBLE


def is_hidden(joints: np.ndarray) -> np.ndarray:
    """Return which joints are hidden in truth, (N,)."""
    return (joints['label'] != VISIBLE) & (joints['label'] != OUTSIDE)


def _given(joints: np.ndarray) -> np.ndarray:
    return np.isfinite(joints['error'])


def _with_sigma(joints: np.ndarray) -> np.ndarray:
    return np.isfinite(joints['error']) & np.isfinite(joints['sigma'])


def within_sigmas(number: float, of: str = '', among: Rows = every) -> Ratio:
    """Return the share of errors within so many sigma, of those joints that have both."""
    return of_rows(f'errors {of}within {number:g} sigma', 'joints',
                   lambda joints: joints['error'] <= number * joints['sigma'],
                   lambda joints: among(joints) & _with_sigma(joints))


def _hidden_by(label: int, by: str) -> Ratio:
    return within(f'hidden by {by} within 150 mm', 'joints', NEAR_HIDDEN, lambda joints: joints['label'] == label)


_VISIBLE_ERRORS, _HIDDEN_ERRORS = values_of('joints', 'error', is_visible), values_of('joints', 'error', is_hidden)
# Figures of joints: for any selection of their rows.
JOINT_STATISTICS = {
    'visible_100': within('visible joints within 100 mm', 'joints', NEAR, is_visible),
    'visible_median': Quantile('median error of visible joints', _VISIBLE_ERRORS, 0.5, 'mm', 1, 1e3),
    'visible_90': Quantile('90 % of visible joints are within', _VISIBLE_ERRORS, 0.9, 'mm', 1, 1e3),
    'visible_mean': mean_of('mean error of visible joints', _VISIBLE_ERRORS, 'mm', 1, 1e3),
    'visible_given': of_rows('visible joints with a position', 'joints', _given, is_visible),
    'visible_inferred': of_rows('visible joints called INFERRED, of those with a position', 'joints',
                                lambda joints: joints['status'] == INFERRED,
                                lambda joints: is_visible(joints) & _given(joints)),
    'hidden_150': within('hidden joints within 150 mm', 'joints', NEAR_HIDDEN, is_hidden),
    'hidden_median': Quantile('median error of hidden joints', _HIDDEN_ERRORS, 0.5, 'mm', 1, 1e3),
    'hidden_mean': mean_of('mean error of hidden joints', _HIDDEN_ERRORS, 'mm', 1, 1e3),
    'hidden_given': of_rows('hidden joints with a position', 'joints', _given, is_hidden),
    'hidden_measured': of_rows('hidden joints called MEASURED', 'joints',
                               lambda joints: _given(joints) & (joints['status'] != INFERRED), is_hidden),
    'lies': of_rows('hidden joints called MEASURED and wrong by more than 150 mm', 'joints',
                    lambda joints: (joints['status'] != INFERRED) & (joints['error'] > NEAR_HIDDEN), is_hidden),
    'hidden_by_itself_150': _hidden_by(OWN_BODY, 'the own body'),
    'hidden_by_others_150': _hidden_by(OTHER_PERSON, 'another person'),
    'hidden_by_furniture_150': _hidden_by(FURNITURE, 'furniture'),
    'within_1_sigma': within_sigmas(1), 'within_2_sigma': within_sigmas(2)}
_PERSONS = {'persons_recall': of_sums('people found, of the true ones', 'paired', 'true'),
            'persons_precision': of_sums('people who are real, of those found', 'paired', 'found')}
_OVER_TIME = {'switches': of_sums('switches of ids', 'switches', digits=0),
              'idf1': Ratio('IDF1: people who keep their id', lambda counts: 2 * counts.sums['kept'],
                            lambda counts: counts.sums['true'] + counts.sums['found'])}
STATISTICS = {
    **_PERSONS, **JOINT_STATISTICS, **_OVER_TIME,
    'exchanged': of_sums('shoulders and hips with left and right exchanged', 'exchanged', 'sides'),
    'jitter': mean_of('mean error of the acceleration', values_of('accelerations', 'error'), 'm/s^2', 2)}
# Those of fused people.
WORLD_STATISTICS = {
    **_PERSONS, 'all_right': of_sums('frames with all people, each once', 'all_right', 'frames'),
    'visible_100': within('joints that a camera sees, within 100 mm', 'joints', NEAR, is_visible),
    'visible_median': JOINT_STATISTICS['visible_median'], 'visible_mean': JOINT_STATISTICS['visible_mean'],
    'hidden_100': within('joints that no camera sees, within 100 mm', 'joints', NEAR, is_hidden),
    **_OVER_TIME,
    **{f'within_{number}_sigma': within_sigmas(number, 'of visible joints ', is_visible) for number in (1, 2)}}
# Toes and heels, where the truth has them.
FEET_STATISTICS = {
    'feet_60': within('visible toes and heels within 60 mm', 'feet', NEAR_FOOT, is_visible),
    'feet_median': Quantile('median error of visible toes and heels', values_of('feet', 'error', is_visible), 0.5,
                            'mm', 1, 1e3),
    'feet_measured': of_rows('visible toes and heels called MEASURED', 'feet',
                             lambda rows: rows['status'] == MEASURED, is_visible),
    'feet_surprise': mean_of('mean of (error / sigma)^2 of visible toes and heels', lambda counts: (
        counts.rows['feet']['error'] / counts.rows['feet']['sigma'])[
            is_visible(counts.rows['feet']) & _with_sigma(counts.rows['feet'])] ** 2, '', 2),
    'feet_lies': of_rows('hidden toes and heels called MEASURED and wrong by more than 150 mm', 'feet',
                         lambda rows: (rows['status'] != INFERRED) & (rows['error'] > NEAR_HIDDEN), is_hidden)}
FEET_TABLE = {'feet_60': 'within 60 mm', 'feet_median': 'median [mm]', 'feet_measured': 'called MEASURED',
              'feet_surprise': 'mean of (error / sigma)^2', 'feet_lies': 'lies'}
# Those of a table of one row per scene, with short titles.
TABLE = {'persons_recall': 'people found', 'persons_precision': 'real', 'visible_100': 'visible within 100 mm',
         'visible_median': 'median [mm]', 'visible_90': '90 % [mm]', 'hidden_150': 'hidden within 150 mm',
         'lies': 'lies', 'switches': 'switches', 'idf1': 'IDF1', 'within_2_sigma': 'within 2 sigma',
         'jitter': 'jitter [m/s^2]'}
# Those of tables with intervals.
SHORT_TABLE = {name: TABLE[name] for name in ('persons_recall', 'persons_precision', 'visible_100', 'visible_median',
                                              'hidden_150', 'lies', 'switches', 'within_2_sigma')}

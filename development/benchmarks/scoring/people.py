"""People in the frame of a camera against the true joints of a scene.

People of a frame are paired with true ones by the median distance of the joints that are visible in truth, of all
joints where fewer than three are, at most `GATE` apart. Labels of true joints: 2 visible; hidden by 1 the own body, 3
another person, 4 furniture; 0 outside the image, which does not count. A share counts all joints of its kind, those
without a position as wrong.
"""
import json
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, List, NamedTuple, Sequence, Tuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import INFERRED, MISSING, People3D

from .counts import WHOLE, Counts, tags_of
from .figures import Quantile, Ratio

# Maximum median distance of the joints of a person from the true ones [m].
GATE = 0.6
OUTSIDE, OWN_BODY, VISIBLE, OTHER_PERSON, FURNITURE = range(5)
HIDDEN = (OWN_BODY, OTHER_PERSON, FURNITURE)
# A visible joint is right within the first, a hidden one within the second [m].
NEAR, NEAR_HIDDEN = 0.1, 0.15
# One row for each joint of each true person of a frame: errors are NaN where there is no position.
JOINT = np.dtype([('joint', 'u1'), ('label', 'u1'), ('status', 'u1'), ('distance', 'f4'), ('error', 'f8'),
                  ('sigma', 'f8')])
# One row for each visible joint in three consecutive frames: error of the acceleration [m/s^2].
ACCELERATION = np.dtype([('error', 'f8')])

# Stamp [s], from the first frame of the scene, and people of each frame.
Frames = Iterable[Tuple[float, People3D]]


class Found(NamedTuple):
    """People found in a frame: ids (P,), positions (P, K, 3) [m], status (P, K), sigma (P, K) [m]."""

    ids: np.ndarray
    xyz: np.ndarray
    status: np.ndarray
    sigma: np.ndarray


def score_people(folder: Path, frames: Frames, part: slice = WHOLE) -> Counts:
    """Count what was found in a scene.

    Args:
        folder: of the scene, with gt.json and meta.json.
        frames: a frame counts for the nearest true one, within half a period.
        part: of the true frames that count.
    """
    truth = json.loads((folder / 'gt.json').read_text())
    order = [truth['joints'].index(joint) for joint in COCO_18.joints]
    true = truth['frames'][part]
    found, stray = nearest([frame['t'] for frame in true], frames)
    sums: Dict[str, float] = dict.fromkeys(('found', 'true', 'paired', 'ghosts', 'answered', 'with_people'), 0)
    rows: List[np.ndarray] = [np.zeros(0, JOINT)]
    history = History()
    for number, (frame, people) in enumerate(zip(true, found)):
        there = frame['people']
        xyz = np.array([person['xyz'] for person in there], np.float64).reshape(-1, len(order), 3)[:, order]
        labels = np.array([person['vis'] for person in there], np.uint8).reshape(-1, len(order))[:, order]
        pairs = pair(xyz, labels == VISIBLE, people)
        for name, count in (('true', len(there)), ('found', len(people.ids)), ('paired', len(pairs)),
                            ('with_people', bool(there)), ('answered', bool(there) and len(people.ids) > 0),
                            ('ghosts', 0 if there else len(people.ids))):
            sums[name] += count
        rows += [joint_rows(xyz[row], labels[row], people, pairs.get(row)) for row in range(len(there))]
        history.add(number, {there[row]['id']: (xyz[row], labels[row] == VISIBLE, people, other)
                             for row, other in pairs.items()})
    sums.update(frames=len(true), stray=stray, **history.sums())
    times = [frame['t'] for frame in true]
    period = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else 1.0
    return Counts(folder.resolve().name, tags_of(folder), sums,
                  {'joints': np.concatenate(rows), 'accelerations': history.accelerations(period)})


def nearest(times: Sequence[float], frames: Frames) -> Tuple[List[Found], int]:
    """Return what was found at each true time, and the number of people at no such time."""
    stamps = np.round(np.asarray(times) * 1e9).astype(np.int64)
    half = np.median(np.diff(stamps)) / 2 if len(stamps) > 1 else np.inf
    parts: List[List[People3D]] = [[] for _ in times]
    stray = 0
    for seconds, people in frames:
        away = np.abs(stamps - round(seconds * 1e9))
        if away.min() <= half:
            parts[int(away.argmin())].append(people)
        else:
            stray += len(people)
    none = People3D.empty(COCO_18)
    return [Found(*(np.concatenate([np.asarray(getattr(people, name)) for people in (none, *part)])
                    for name in Found._fields)) for part in parts], stray


def pair(true: np.ndarray, visible: np.ndarray, people: Found, gate: float = GATE) -> Dict[int, int]:
    """Return the row of the found person for each true one (T, K, 3) that was found; `visible` is (T, K)."""
    there = people.status != MISSING
    errors = np.linalg.norm(true[:, np.newaxis] - people.xyz[np.newaxis].astype(np.float64), axis=3)
    costs = np.full(errors.shape[:2], 1e3)
    for row, other in np.ndindex(*costs.shape):
        joints = there[other] & visible[row]
        joints = joints if joints.sum() >= 3 else there[other]
        if joints.any():
            costs[row, other] = np.median(errors[row, other][joints])
    costs[costs > gate] = 1e3
    return {int(row): int(other) for row, other in zip(*linear_sum_assignment(costs)) if costs[row, other] <= gate}


def joint_rows(xyz: np.ndarray, labels: np.ndarray, people: Found, found: Any) -> np.ndarray:
    """Return the rows of a true person, (K,) JOINT; `found` is its row among the people, None: it was not found."""
    rows = np.zeros(len(xyz), JOINT)
    rows['joint'], rows['label'], rows['distance'] = np.arange(len(xyz)), labels, xyz[:, 2]
    rows['error'] = rows['sigma'] = np.nan
    if found is not None:
        there = people.status[found] != MISSING
        rows['status'], rows['sigma'] = people.status[found], people.sigma[found]
        rows['error'][there] = np.linalg.norm(people.xyz[found] - xyz, axis=1)[there]
    return rows


class History:
    """Found people over time: switches of ids, people who keep theirs, jitter."""

    def __init__(self) -> None:
        self._last: Dict[int, int] = {}
        self._together: Dict[Tuple[int, int], int] = {}
        self._paths: Dict[int, Dict[int, np.ndarray]] = {}
        self._switches = 0

    def add(self, number: int, people: Dict[int, Tuple[np.ndarray, np.ndarray, Found, int]]) -> None:
        """Add the true people of a frame that were found, by id: xyz, visible joints, found people, row of its own."""
        for true, (xyz, visible, found, row) in people.items():
            name = int(found.ids[row])
            self._switches += self._last.get(true, name) != name
            self._last[true] = name
            self._together[true, name] = self._together.get((true, name), 0) + 1
            off = np.where((visible & (found.status[row] != MISSING))[:, np.newaxis], found.xyz[row] - xyz, np.nan)
            self._paths.setdefault(true, {})[number] = off

    def sums(self) -> Dict[str, float]:
        """Return the switches, and the pairs that remain where each true person is given one id (Ristani 2016)."""
        trues, names = ({key: row for row, key in enumerate(sorted({pair[side] for pair in self._together}))}
                        for side in (0, 1))
        frames = np.zeros((len(trues), len(names)))
        for (true, name), count in self._together.items():
            frames[trues[true], names[name]] = count
        return {'switches': self._switches, 'kept': int(frames[linear_sum_assignment(-frames)].sum())}

    def accelerations(self, period: float) -> np.ndarray:
        """Return the errors of the acceleration of visible joints, (N,) ACCELERATION; period [s] of the frames."""
        errors = [np.linalg.norm(path[i - 1] - 2 * path[i] + path[i + 1], axis=1) / period ** 2
                  for path in self._paths.values() for i in path if i - 1 in path and i + 1 in path]
        joined = np.concatenate([np.zeros(0), *errors])
        return joined[np.isfinite(joined)].astype(ACCELERATION)


def _sum(name: str) -> Callable[[Counts], float]:
    return lambda counts: counts.sums[name]


def _joints(wanted: Callable[[np.ndarray], np.ndarray]) -> Callable[[Counts], np.ndarray]:
    return lambda counts: counts.rows['joints'][wanted(counts.rows['joints'])]


def _share(text: str, of: Callable[[np.ndarray], np.ndarray], wanted: Callable[[np.ndarray], np.ndarray]) -> Ratio:
    """Return the share of rows `wanted` among the rows `of`."""
    rows = _joints(of)
    return Ratio(text, lambda counts: float(wanted(rows(counts)).sum()), lambda counts: float(len(rows(counts))))


def _errors(of: Callable[[np.ndarray], np.ndarray]) -> Callable[[Counts], np.ndarray]:
    rows = _joints(lambda joints: of(joints) & np.isfinite(joints['error']))
    return lambda counts: rows(counts)['error']


def _mean(text: str, of: Callable[[np.ndarray], np.ndarray]) -> Ratio:
    errors = _errors(of)
    return Ratio(text, lambda counts: float(errors(counts).sum()), lambda counts: float(len(errors(counts))), 'mm', 1,
                 1e3)


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


def within_sigmas(number: float) -> Ratio:
    """Return the share of errors within so many sigma, of all joints with both."""
    return _share(f'errors within {number:g} sigma', _with_sigma,
                  lambda joints: joints['error'] <= number * joints['sigma'])


def _hidden_by(label: int, by: str) -> Ratio:
    return _share(f'hidden by {by} within 150 mm', lambda joints: joints['label'] == label,
                  lambda joints: joints['error'] <= NEAR_HIDDEN)


# Figures of joints: for any selection of their rows.
JOINT_STATISTICS = {
    'visible_100': _share('visible joints within 100 mm', is_visible, lambda joints: joints['error'] <= NEAR),
    'visible_median': Quantile('median error of visible joints', _errors(is_visible), 0.5, 'mm', 1, 1e3),
    'visible_90': Quantile('90 % of visible joints are within', _errors(is_visible), 0.9, 'mm', 1, 1e3),
    'visible_mean': _mean('mean error of visible joints', is_visible),
    'visible_given': _share('visible joints with a position', is_visible, _given),
    'visible_inferred': _share('visible joints called INFERRED, of those with a position',
                               lambda joints: is_visible(joints) & _given(joints),
                               lambda joints: joints['status'] == INFERRED),
    'hidden_150': _share('hidden joints within 150 mm', is_hidden, lambda joints: joints['error'] <= NEAR_HIDDEN),
    'hidden_median': Quantile('median error of hidden joints', _errors(is_hidden), 0.5, 'mm', 1, 1e3),
    'hidden_mean': _mean('mean error of hidden joints', is_hidden),
    'hidden_given': _share('hidden joints with a position', is_hidden, _given),
    'hidden_measured': _share('hidden joints called MEASURED', is_hidden,
                              lambda joints: _given(joints) & (joints['status'] != INFERRED)),
    'lies': _share('hidden joints called MEASURED and wrong by more than 150 mm', is_hidden,
                   lambda joints: (joints['status'] != INFERRED) & (joints['error'] > NEAR_HIDDEN)),
    'hidden_by_itself_150': _hidden_by(OWN_BODY, 'the own body'),
    'hidden_by_others_150': _hidden_by(OTHER_PERSON, 'another person'),
    'hidden_by_furniture_150': _hidden_by(FURNITURE, 'furniture'),
    'within_1_sigma': within_sigmas(1), 'within_2_sigma': within_sigmas(2)}
STATISTICS = {
    'persons_recall': Ratio('people found, of the true ones', _sum('paired'), _sum('true')),
    'persons_precision': Ratio('people who are real, of those found', _sum('paired'), _sum('found')),
    **JOINT_STATISTICS,
    'switches': Ratio('switches of ids', _sum('switches'), digits=0),
    'idf1': Ratio('IDF1: people who keep their id', lambda counts: 2 * counts.sums['kept'],
                  lambda counts: counts.sums['true'] + counts.sums['found']),
    'jitter': Ratio('mean error of the acceleration', lambda counts: float(counts.rows['accelerations']['error'].sum()),
                    lambda counts: float(len(counts.rows['accelerations'])), 'm/s^2', 2)}
# Those of a table of one row per scene, with short titles.
TABLE = {'persons_recall': 'people found', 'persons_precision': 'real', 'visible_100': 'visible within 100 mm',
         'visible_median': 'median [mm]', 'visible_90': '90 % [mm]', 'hidden_150': 'hidden within 150 mm',
         'lies': 'lies', 'switches': 'switches', 'idf1': 'IDF1', 'within_2_sigma': 'within 2 sigma',
         'jitter': 'jitter [m/s^2]'}
# Those of tables with intervals.
SHORT_TABLE = {name: TABLE[name] for name in ('persons_recall', 'persons_precision', 'visible_100', 'visible_median',
                                              'hidden_150', 'lies', 'switches', 'within_2_sigma')}

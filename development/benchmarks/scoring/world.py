"""People fused from several cameras, in the world, against the true joints of a stage.

A person counts in a frame in which a camera sees one of the joints at least. Visible: joints that a camera sees.
"""
import json
from pathlib import Path
from typing import Callable, Dict, List

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18

from .counts import WHOLE, Counts
from .figures import Quantile, Ratio
from .people import NEAR, VISIBLE, Frames, History, nearest, pair

# One row for each joint of each true person of a frame: number of cameras that see it; errors are NaN where there is
# no position.
JOINT = np.dtype([('joint', 'u1'), ('cameras', 'u1'), ('error', 'f8'), ('sigma', 'f8')])


def score_world(folder: Path, frames: Frames, part: slice = WHOLE) -> Counts:
    """Count what was found in the frames of a stage: a folder with gt_world.json.

    Args:
        frames: stamps [s] as those of the truth, people in the world; of several in one true frame the nearest counts.
        part: of the true frames that count.
    """
    truth = json.loads((folder / 'gt_world.json').read_text())
    order = [truth['joints'].index(joint) for joint in COCO_18.joints]
    true = truth['frames'][part]
    times = np.array([frame['t'] for frame in true])
    closest = {}
    for seconds, people in frames:
        number = int(np.abs(times - seconds).argmin())
        if number not in closest or abs(times[number] - seconds) < abs(times[number] - closest[number][0]):
            closest[number] = (seconds, people)
    found, stray = nearest(times, closest.values())
    sums: Dict[str, float] = dict.fromkeys(('found', 'true', 'paired', 'all_right'), 0)
    rows: List[np.ndarray] = [np.zeros(0, JOINT)]
    history = History()
    for number, (frame, people) in enumerate(zip(true, found)):
        xyz = np.array([person['xyz'] for person in frame['people']], np.float64).reshape(-1, len(order), 3)[:, order]
        cameras = np.array([(np.array([person['vis'][name] for name in truth['cameras']]) == VISIBLE).sum(axis=0)
                            for person in frame['people']], int).reshape(-1, len(order))[:, order]
        seen = np.flatnonzero(cameras.any(axis=1))
        xyz, cameras = xyz[seen], cameras[seen]
        pairs = pair(xyz, cameras > 0, people)
        for name, count in (('true', len(xyz)), ('found', len(people.ids)), ('paired', len(pairs)),
                            ('all_right', len(pairs) == len(xyz) == len(people.ids))):
            sums[name] += count
        for row in range(len(xyz)):
            rows.append(np.zeros(len(order), JOINT))
            rows[-1]['joint'], rows[-1]['cameras'] = np.arange(len(order)), cameras[row]
            rows[-1]['error'] = rows[-1]['sigma'] = np.nan
            if row in pairs:
                rows[-1]['error'] = np.linalg.norm(people.xyz[pairs[row]] - xyz[row], axis=1)
                rows[-1]['sigma'] = people.sigma[pairs[row]]
        ids = [frame['people'][row]['id'] for row in seen]
        history.add(number, {ids[row]: (xyz[row], cameras[row] > 0, people, other) for row, other in pairs.items()})
    sums.update(frames=len(times), stray=stray, **history.sums())
    return Counts(folder.resolve().name, {'kind': 'stage'}, sums, {'joints': np.concatenate(rows)})


def _errors(visible: bool) -> Callable[[Counts], np.ndarray]:
    def errors(counts: Counts) -> np.ndarray:
        rows = counts.rows['joints']
        return rows['error'][((rows['cameras'] > 0) == visible) & np.isfinite(rows['error'])]
    return errors


def _near(visible: bool) -> Ratio:
    errors = _errors(visible)
    return Ratio(f"joints that {'a' if visible else 'no'} camera sees, within 100 mm",
                 lambda counts: float((errors(counts) <= NEAR).sum()),
                 lambda counts: float(((counts.rows['joints']['cameras'] > 0) == visible).sum()))


def _within(number: int) -> Ratio:
    def rows(counts: Counts) -> np.ndarray:
        joints = counts.rows['joints']
        return joints[(joints['cameras'] > 0) & np.isfinite(joints['error']) & np.isfinite(joints['sigma'])]
    return Ratio(f'errors of visible joints within {number} sigma',
                 lambda counts: float((rows(counts)['error'] <= number * rows(counts)['sigma']).sum()),
                 lambda counts: float(len(rows(counts))))


STATISTICS = {
    'persons_recall': Ratio('people found, of the true ones', lambda counts: counts.sums['paired'],
                            lambda counts: counts.sums['true']),
    'persons_precision': Ratio('people who are real, of those found', lambda counts: counts.sums['paired'],
                               lambda counts: counts.sums['found']),
    'all_right': Ratio('frames with all people, each once', lambda counts: counts.sums['all_right'],
                       lambda counts: counts.sums['frames']),
    'visible_100': _near(True),
    'visible_median': Quantile('median error of visible joints', _errors(True), 0.5, 'mm', 1, 1e3),
    'visible_mean': Ratio('mean error of visible joints', lambda counts: float(_errors(True)(counts).sum()),
                          lambda counts: float(len(_errors(True)(counts))), 'mm', 1, 1e3),
    'hidden_100': _near(False),
    'switches': Ratio('switches of ids', lambda counts: counts.sums['switches'], digits=0),
    'idf1': Ratio('IDF1: people who keep their id', lambda counts: 2 * counts.sums['kept'],
                  lambda counts: counts.sums['true'] + counts.sums['found']),
    'within_1_sigma': _within(1), 'within_2_sigma': _within(2)}

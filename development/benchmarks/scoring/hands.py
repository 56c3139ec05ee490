"""Hands and faces in the image and in space against the true points of a scene.

A true hand counts where 5 points are in the image. Hands of a frame are paired whatever their side, by the median
distance of their points in the image, in sizes of the hand: the longer edge of the box around its true points. A face
is that of the true person whose face points are near; its direction is square to the line of the eyes and to that from
the mouth to the eyes.
"""
import json
from pathlib import Path
from typing import Any, Dict, Iterable, List, NamedTuple, Sequence, Tuple

import numpy as np

from ground_truth import OUTSIDE
from openpose_ros_pkg.assignment import match
from skeleton_extract_3d.people import INFERRED, MEASURED

from .counts import WHOLE, Counts, at_times, tags_of
from .figures import Quantile, Ratio, of_rows, of_sums, values_of, within
from .people import is_hidden, is_visible

LEAST_POINTS = 5
# Maximum median distance of a pair, in sizes of the hand; of the points of a face from the true middle [m].
GATE, SAME_FACE = 1.0, 0.15
# One row for each point of each true hand: error in space [m] and in the image [hand sizes].
POINT = np.dtype([('label', 'u1'), ('status', 'u1'), ('error', 'f8'), ('apart', 'f8'), ('sigma', 'f8')])
# One row for each face: angle between its direction and the true one [deg], and in its sigma.
FACE = np.dtype([('angle', 'f8'), ('sigmas', 'f8')])


class Hand(NamedTuple):
    """A hand.

    Attributes:
        left: whether it is the left one.
        uv, xyz: its points in the image (21, 2) [px] and in space (21, 3) [m].
        status, sigma: of its points (21,) [m].
    """

    left: bool
    uv: np.ndarray
    xyz: np.ndarray
    status: np.ndarray = np.zeros(21, np.uint8)
    sigma: np.ndarray = np.full(21, np.nan)


class Face(NamedTuple):
    """The points of a face (N, 3) [m], the direction that it looks in (3,), and its sigma [rad]."""

    xyz: np.ndarray
    direction: np.ndarray
    sigma: float


Frame = Tuple[float, Tuple[Sequence[Hand], Sequence[Face]]]


def score_hands(folder: Path, frames: Iterable[Frame], part: slice = WHOLE) -> Counts:
    """Count the hands and faces of a part of the true frames of a scene; frames are given by their stamps [s]."""
    everything = json.loads((folder / 'gt.json').read_text())
    truth = everything['frames'][part]
    found: List[List[Hand]] = []
    angles: List[Tuple[float, float]] = []
    for frame, given in zip(truth, at_times(frames, [frame['t'] for frame in truth])):
        found.append([hand for hands, _ in given for hand in hands])
        for person in frame['people'] if given and 'face_points' in everything else ():
            angles += _angles(dict(zip(everything['face_points'], np.array(person['face']['xyz']))), given[0][1])
    sums: Dict[str, float] = dict.fromkeys(('true', 'found', 'paired', 'sides'), 0)
    rows = [np.zeros(0, POINT)]
    for frame, hands in zip(truth, found):
        true = [(Hand(hand['side'] == 'left', np.array(hand['uv']), np.array(hand['xyz'])), np.array(hand['vis']))
                for person in frame['people'] for hand in person.get('hands', ())]
        true = [(hand, labels) for hand, labels in true if (labels != OUTSIDE).sum() >= LEAST_POINTS]
        apart = np.full((len(true), len(hands)), 1e3)
        for row, other in np.ndindex(*apart.shape):
            distances = _apart(true[row][0], hands[other])
            if np.isfinite(distances).any():
                apart[row, other] = min(np.nanmedian(distances), 1e3)
        pairs = {row: hands[other] for row, other in match(apart, apart <= GATE)}
        for name, count in (('true', len(true)), ('found', len(hands)), ('paired', len(pairs)),
                            ('sides', sum(true[row][0].left == other.left for row, other in pairs.items()))):
            sums[name] += count
        rows += [_rows(hand, labels, pairs.get(row)) for row, (hand, labels) in enumerate(true)]
    return Counts(folder.resolve().name, tags_of(folder), sums, {
        'points': np.concatenate(rows), 'faces': np.array(angles, FACE)})


def _angles(true: Dict[str, np.ndarray], faces: Sequence[Face]) -> List[Tuple[float, float]]:
    """Return the rows of the faces that are at the place of a true one."""
    middle = np.mean([*true.values()], axis=0)
    eyes = np.mean([point for name, point in true.items() if name.endswith(('_eye_inner', '_eye_outer'))], axis=0)
    ahead = np.cross(true['left_eye_outer'] - true['right_eye_outer'],
                     eyes - (true['mouth_left'] + true['mouth_right']) / 2)
    near = [face for face in faces if np.linalg.norm(np.nanmedian(face.xyz, axis=0) - middle) < SAME_FACE]
    angles = [float(np.degrees(np.arccos(np.clip(face.direction @ ahead / (
        np.linalg.norm(face.direction) * np.linalg.norm(ahead)), -1, 1)))) for face in near]
    return [(angle, angle / np.degrees(face.sigma)) for angle, face in zip(angles, near)]


def _apart(true: Hand, other: Hand) -> np.ndarray:
    """Return the distances of points in the image, (21,) [hand sizes]."""
    return np.linalg.norm(true.uv - other.uv, axis=1) / np.ptp(true.uv, axis=0).max()


def _rows(true: Hand, labels: np.ndarray, found: Any) -> np.ndarray:
    rows = np.zeros(len(labels), POINT)
    rows['label'] = labels
    rows['error'] = rows['apart'] = rows['sigma'] = np.nan
    if found is not None:
        rows['error'], rows['apart'] = np.linalg.norm(true.xyz - found.xyz, axis=1), _apart(true, found)
        rows['status'], rows['sigma'] = found.status, found.sigma
    return rows


def _within_2_sigma(name: str, status: int) -> Ratio:
    return of_rows(f'errors of {name} points within 2 sigma', 'points',
                   lambda points: points['error'] / points['sigma'] <= 2, lambda points: (
                       points['status'] == status) & np.isfinite(points['error']) & np.isfinite(points['sigma']))


STATISTICS = {
    'recall': of_sums('hands found, of the true ones', 'paired', 'true'),
    'precision': of_sums('hands that are real, of those found', 'paired', 'found'),
    'side': of_sums('of these with the right side', 'sides', 'paired'),
    'visible_20': within('visible points within 20 mm', 'points', 0.02, is_visible),
    'visible_10': within('visible points within 10 mm', 'points', 0.01, is_visible),
    'visible_median': Quantile('median error of visible points', values_of('points', 'error', is_visible), 0.5, 'mm', 1,
                               1e3),
    'hidden_20': within('hidden points within 20 mm', 'points', 0.02, is_hidden),
    'image_01': within('visible points within 0.1 hand sizes in the image', 'points', 0.1, is_visible, 'apart'),
    'image_02': within('visible points within 0.2 hand sizes in the image', 'points', 0.2, is_visible, 'apart'),
    'image_median': Quantile('median error of visible points in the image',
                             values_of('points', 'apart', is_visible), 0.5, 'hand sizes', 3),
    'measured_within_2_sigma': _within_2_sigma('MEASURED', MEASURED),
    'inferred_within_2_sigma': _within_2_sigma('INFERRED', INFERRED),
    'head_median': Quantile('median angle of the directions of faces', lambda counts: counts.rows['faces']['angle'],
                            0.5, 'deg', 1),
    **{f'head_within_{most}_sigma': within(f'directions of faces within {most} sigma', 'faces', most, column='sigmas')
       for most in (1, 2)}}

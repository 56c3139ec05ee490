"""Gestures, postures and pointing against the labels of a scene.

People are paired by their necks. A label counts in each frame that holds it in truth or in what was found, without
frames near a change of that label of that person. Pointing: the angle at the origin of the ray between its direction
and the true target; frames of true pointing without a ray count as wrong. Coverage: the share of rays with the target
within 1 and 2 sigma, separately for people who point from the eyes and from the shoulder.
"""
import json
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import Any, Dict, Iterable, List, NamedTuple, Sequence, Tuple

import numpy as np

from openpose_ros_tools.alignment.people import pair_people

from .counts import WHOLE, Counts, at_times, tags_of
from .figures import Average, Quantile, Ratio, of_rows, of_sums, values_of, within

LABELS = ('wave', 'point', 'raise_hand', 'arms_crossed', 'sit', 'stand')
# Maximum distance of necks [m]; frames this near to a change of a label do not count for it [s].
GATE, MARGIN = 0.6, 0.2
# One row for each frame of true pointing: angle to the target [deg], the same in sigma, that of the ray of the true
# style in its sigma, NaN without a ray; and the style, 'eye' or 'shoulder'.
RAY = np.dtype([('angle', 'f8'), ('sigmas', 'f8'), ('own_sigmas', 'f8'), ('style', 'U8')])


class Label(NamedTuple):
    """A label of a person: its arm, 'left', 'right' or '', and for pointing the ray.

    Attributes:
        origin, direction, sigma: (3,) [m], (3,) and [rad] of the ray.
        styles: the rays of people who point from the 'eye' or the 'shoulder'.
    """

    arm: str = ''
    origin: Any = None
    direction: Any = None
    sigma: float = np.nan
    styles: Any = MappingProxyType({})


class Person(NamedTuple):
    """The neck of a person (3,) [m], and labels."""

    neck: np.ndarray
    labels: Dict[str, Label]


def score_signals(folder: Path, frames: Iterable[Tuple[float, Sequence[Person]]], margin: float = MARGIN,
                  part: slice = WHOLE) -> Counts:
    """Count the labels of a part of the true frames of a scene; frames are given by their stamps [s]."""
    truth = json.loads((folder / 'gt.json').read_text())
    neck, true = truth['joints'].index('neck'), truth['frames'][part]
    found = [list(chain(*each)) for each in at_times(frames, [frame['t'] for frame in true])]
    sums: Dict[str, float] = dict.fromkeys(
        [f'{kind}_{label}' for label in LABELS for kind in ('right', 'wrong', 'missed')] + ['arms', 'arms_right'], 0)
    rays: List[Tuple[float, float, float, str]] = []
    changes = _changes(truth['frames'])
    for frame, people in zip(true, found):
        true_necks, necks = (np.array(each).reshape(-1, 1, 3) for each in (
            [person['xyz'][neck] for person in frame['people']], [person.neck for person in people]))
        pairs = dict(pair_people(true_necks, necks, GATE))
        for row, person in enumerate(people):
            if row not in pairs.values():
                for label in set(person.labels) & set(LABELS):
                    sums[f'wrong_{label}'] += 1
        for row, person in enumerate(frame['people']):
            given = people[pairs[row]].labels if row in pairs else {}
            for label in LABELS:
                near = any(abs(frame['t'] - time) < margin for time in changes.get((person['id'], label), ()))
                if not near and (label in given or label in person['labels']):
                    sums[('right_' if label in given and label in person['labels'] else
                          'wrong_' if label in given else 'missed_') + label] += 1
            for detail in person['detail']:
                label = given.get(detail['label'], Label())
                if 'arm' in detail and label.arm:
                    sums['arms'] += 1
                    sums['arms_right'] += label.arm[0] == detail['arm'][0]
                if detail['label'] == 'point':
                    target, style = np.array(detail['target']), detail.get('style', '')
                    own = label.styles.get(style, Label())
                    away, own_away = _angle(label, target), _angle(own, target)
                    rays.append((away, away / np.degrees(label.sigma), own_away / np.degrees(own.sigma), style))
    return Counts(folder.resolve().name, tags_of(folder), sums, {'rays': np.array(rays, RAY)})


def _changes(frames: Sequence[Dict[str, Any]]) -> Dict[Tuple[int, str], List[float]]:
    seen: Dict[Tuple[int, str], List[Tuple[float, bool]]] = {}
    for frame in frames:
        for person in frame['people']:
            for label in LABELS:
                seen.setdefault((person['id'], label), []).append((frame['t'], label in person['labels']))
    return {key: [(a[0] + b[0]) / 2 for a, b in zip(states, states[1:]) if a[1] != b[1]]
            for key, states in seen.items()}


def _angle(label: Label, target: np.ndarray) -> float:
    """Return the angle between a ray and a target [deg]; NaN without a ray."""
    if label.direction is None:
        return float('nan')
    to = target - label.origin
    cosine = to @ label.direction / (np.linalg.norm(to) * np.linalg.norm(label.direction))
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def _f1(label: str) -> Ratio:
    return Ratio(f'F1 of {label}', lambda counts: 2 * counts.sums[f'right_{label}'], lambda counts: (
        2 * counts.sums[f'right_{label}'] + counts.sums[f'wrong_{label}'] + counts.sums[f'missed_{label}']), digits=2)


def _covered(style: str, column: str, most: int) -> Ratio:
    ray = 'rays' if column == 'sigmas' else f'{style} rays'
    return within(f'{ray} with the target within {most} sigma, people who point from the {style}', 'rays', most,
                  lambda rays: (rays['style'] == style) & np.isfinite(rays['angle']), column, digits=2)


STATISTICS = {
    **{f'f1_{label}': _f1(label) for label in LABELS},
    'f1': Average('mean F1 of all labels', [_f1(label) for label in LABELS], digits=2),
    'arm': of_sums('gestures with the right arm', 'arms_right', 'arms', digits=2),
    'point_given': of_rows('frames of pointing with a ray', 'rays', lambda rays: np.isfinite(rays['angle']), digits=2),
    **{f'point_{degrees}': within(f'frames of pointing with a ray within {degrees} deg', 'rays', degrees,
                                  column='angle', digits=2)
       for degrees in (10, 15, 20)},
    'point_median': Quantile('median angle of the rays', values_of('rays', 'angle'), 0.5, 'deg', 1),
    **{f'{style}_{column}_{most}': _covered(style, column, most) for style in ('eye', 'shoulder')
       for column in ('sigmas', 'own_sigmas') for most in (1, 2)}}

"""Matching by place: people of a frame with others, and people of one recording whose ids do not stay."""
from typing import Dict, List, Tuple, Union

import numpy as np

from openpose_ros_pkg.assignment import match

# People move by less than this speed and noise from frame to frame [m/s, m].
_FASTEST, _NOISE = 4.0, 0.15
# A person that is away for longer gets a new id [s].
_LONGEST_AWAY = 0.5
# Ids are taken as those of people if less than this share of their steps are jumps.
_FEW_JUMPS = 0.02


def pair_people(people: np.ndarray, others: np.ndarray, gate: Union[float, np.ndarray]) -> List[Tuple[int, int]]:
    """Return pairs of people (P, K, 3) and others (S, K, 3), as many as possible, with the least sum of distances.

    Args:
        gate: greatest distance, by the median of the joints [m]; (S,) or one for all.
    """
    distances = np.linalg.norm(people[:, None] - others[None], axis=3)
    # not nan-functions, which warn of people without a common joint
    costs = np.array([[np.median(pair[np.isfinite(pair)]) if np.isfinite(pair).any() else np.inf for pair in person]
                      for person in distances]).reshape(len(people), len(others))
    return match(costs, costs <= gate)


def steady_ids(times: np.ndarray, ids: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return ids (R,) that stay with people: those given, or, where these jump from one to the other, by place.

    The original project numbers the people of each frame.

    Args:
        times: (R,) [s], ascending.
        ids: (R,) as given.
        positions: (R, K, 3) [m], NaN where missing.
    """
    if _jumps(times, ids, positions) < _FEW_JUMPS:
        return ids
    steady = np.zeros(len(ids), np.int64)
    last: Dict[int, int] = {}  # last row of each person
    count = 0
    for rows in np.split(np.arange(len(times)), np.flatnonzero(np.diff(times)) + 1):
        last = {person: row for person, row in last.items() if times[rows[0]] - times[row] <= _LONGEST_AWAY}
        known, before = list(last), np.array(list(last.values()), int)
        gates = _NOISE + _FASTEST * (times[rows[0]] - times[before])
        found = {row: known[person] for row, person in pair_people(positions[rows], positions[before], gates)}
        for number, row in enumerate(rows.tolist()):
            if number not in found:
                found[number] = count
                count += 1
            steady[row] = found[number]
            last[found[number]] = row
    return steady


def _jumps(times: np.ndarray, ids: np.ndarray, positions: np.ndarray) -> float:
    """Return the share of the steps of the ids that are too long for a person."""
    order = np.lexsort((times, ids))
    steps = np.diff(times[order])
    distances = np.linalg.norm(np.diff(positions[order], axis=0), axis=2)
    used = (np.diff(ids[order]) == 0) & (steps <= _LONGEST_AWAY) & np.isfinite(distances).any(axis=1)
    if not used.any():
        return 0.0
    return float((np.nanmedian(distances[used], axis=1) > _NOISE + _FASTEST * steps[used]).mean())

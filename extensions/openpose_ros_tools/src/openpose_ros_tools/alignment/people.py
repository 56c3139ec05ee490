"""Who is who, by place: people of a frame paired with others, and people followed where their ids do not stay."""
from typing import Dict, List, Tuple, Union

import numpy as np
from scipy.optimize import linear_sum_assignment

# People move by less than this speed and noise from frame to frame [m/s, m].
_FASTEST, _NOISE = 4.0, 0.15
# Who is away for longer is somebody new [s].
_LONGEST_AWAY = 0.5
# Ids are taken as those of people if less than this share of their steps are jumps.
_FEW_JUMPS = 0.02


def pair_people(people: np.ndarray, others: np.ndarray, gate: Union[float, np.ndarray]) -> List[Tuple[int, int]]:
    """Return pairs of people (P, K, 3) and others (S, K, 3) with the least sum of distances (Hungarian method).

    Args:
        gate: who is farther away than this, by the median of the joints, is somebody else [m]; (S,) or one for all.
    """
    if not len(people) or not len(others):
        return []
    gates = np.broadcast_to(np.asarray(gate, float), (len(others),))
    distances = np.linalg.norm(people[:, None] - others[None], axis=3)
    # not nan-functions, which warn of people without a common joint
    costs = np.array([[np.median(pair[np.isfinite(pair)]) if np.isfinite(pair).any() else np.inf for pair in person]
                      for person in distances])
    return [(person, other) for person, other in zip(*linear_sum_assignment(np.minimum(costs, 10 * gates)))
            if costs[person, other] <= gates[other]]


def steady_ids(times: np.ndarray, ids: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return ids (R,) that stay with people.

    They are those given, unless these jump from one to the other, as numbers of people in a frame do: the original
    project has no others. Then people are followed from frame to frame by place.

    Args:
        times: (R,) [s], ascending.
        ids: (R,) as given.
        positions: (R, K, 3) [m], NaN where missing.
    """
    if _jumps(times, ids, positions) < _FEW_JUMPS:
        return ids
    steady = np.zeros(len(ids), np.int64)
    last: Dict[int, int] = {}  # row of each person who may still come back
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

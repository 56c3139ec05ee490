"""Matching of the people of a frame with others, by place."""
from typing import List, Tuple, Union

import numpy as np

from openpose_ros_pkg.assignment import match


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

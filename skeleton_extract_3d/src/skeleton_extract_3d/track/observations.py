"""The people of one frame as the tracks take them in: observed, identified and lifted, in one record."""
from typing import NamedTuple

import numpy as np

from skeleton_extract_3d.lift.records import Lifted, ObservedPeople
from skeleton_extract_3d.track.appearance import Clothes


class Observations(NamedTuple):
    """P people of one frame.

    Attributes:
        row: (P,) int64, row of each person's track; -1 where there is none.
        observed: keypoints and surfaces.
        clothes: colours of the clothes.
        lifted: joints in space.
    """

    row: np.ndarray
    observed: ObservedPeople
    clothes: Clothes
    lifted: Lifted

    def select(self, people: np.ndarray) -> 'Observations':
        """Return some of the people, by indices, in the order of these."""
        return Observations(self.row[people], self.observed.select(people), self.clothes.select(people),
                            self.lifted.select(people))

    def others(self, count: int) -> np.ndarray:
        """Return which of the first tracks are of none of these people, (count,) bool."""
        others = np.ones(max(count, self.row.max(initial=-1) + 1), bool)
        others[self.row[self.row >= 0]] = False
        return others[:count]

    def size_error(self, stature_spread: float) -> np.ndarray:
        """Return the error of the depth of people without a measured joint, (P, 1) [m]; 0 of others.

        Args:
            stature_spread: standard deviation of the stature, which alone gives their depth, as a share.
        """
        lifted = self.lifted
        return np.where(lifted.measured.any(axis=1), 0.0, stature_spread * lifted.root)[:, None]

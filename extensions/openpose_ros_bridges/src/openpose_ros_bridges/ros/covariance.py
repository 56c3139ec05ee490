"""Covariances of messages."""
from typing import List

import numpy as np

# Variance of what is not known, [m^2], [(m/s)^2] or [rad^2]: spencer_tracking_msgs has more than 99999 for it.
UNKNOWN = 999999.0


def covariance(sigma: float, turn_sigma: float) -> List[float]:
    """Return a 6 x 6 covariance, row by row: of x, y, z, and turns about x, y, z.

    Args:
        sigma: root mean square length of the error in space, the same in all directions; NaN: not known.
        turn_sigma: that of the turn about z; NaN: not known. The others are not known.
    """
    variances = np.array([sigma ** 2 / 3] * 3 + [np.nan, np.nan, turn_sigma ** 2])
    return np.diag(np.where(np.isfinite(variances), variances, UNKNOWN)).ravel().tolist()

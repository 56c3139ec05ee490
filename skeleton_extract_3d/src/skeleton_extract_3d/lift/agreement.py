"""Agreement of people in the image with the depth at their joints: depth of another camera or unit does not agree."""
from typing import NamedTuple, Optional

import numpy as np

from skeleton_extract_3d.body.body import TRUNK
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.lift.surfaces import lower_median
from skeleton_extract_3d.points.plausibility import Doubt

# A trunk with fewer joints, or depths, is not judged.
_LEAST_JOINTS, _LEAST_DEPTHS = 3, 2


class Agreement(NamedTuple):
    """How the last N observations of people agree with the depth at their joints, the newest last.

    Attributes:
        sizes: (N,) depth at the trunk over that at which an adult would look as large.
        fits: (N,) bool, whether the size is that of a person, and the joints of the trunk are at about one depth.
    """

    sizes: np.ndarray = np.zeros(0)
    fits: np.ndarray = np.zeros(0, bool)

    def with_frame(self, observed: ObservedPeople, method: MethodConstants = METHOD) -> 'Agreement':
        """Return it with the people of one more frame whose trunk has enough joints and depths."""
        constants = method.plausibility
        joints = observed.known[:, TRUNK] & (observed.scores[:, TRUNK] > method.sizes.least_score)
        depths = np.where(joints, lower_median(observed.samples[:, TRUNK]), np.nan)
        middle = lower_median(depths)
        near = (np.abs(depths - middle[:, None]) < method.trunk.reach).sum(axis=1)
        sizes = middle / observed.adult_depth
        count, (least, most) = joints.sum(axis=1), constants.sizes
        judged = ((count >= _LEAST_JOINTS) & (np.isfinite(depths).sum(axis=1) >= _LEAST_DEPTHS)
                  & np.isfinite(observed.adult_depth))
        fits = (sizes > least) & (sizes < most) & (2 * near > count)
        last = slice(-constants.sightings, None)
        return Agreement(np.concatenate([self.sizes, sizes[judged]])[last],
                         np.concatenate([self.fits, fits[judged]])[last])

    def doubt(self, method: MethodConstants = METHOD) -> Optional[Doubt]:
        """Return the doubt that the depth is that of the image, if there is one."""
        constants = method.plausibility
        count, unfit = len(self.fits), int((~self.fits).sum())
        if count < constants.sightings or 2 * unfit <= count:
            return None
        stature = float(np.median(self.sizes)) * method.body.adult_stature
        return Doubt('people do not fit the depth',
                     f'{unfit} of the last {count} people; by the depth at their joints they are {stature:.2g} m tall '
                     'in the median: are image and depth of different cameras, is the depth in another unit, or K of '
                     'another resolution?')

"""Whether people in the image fit the depth at their joints: that of another camera or in another unit does not."""
from typing import NamedTuple, Optional

import numpy as np

from skeleton_extract_3d.body.body import TRUNK
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.lift.surfaces import lower_median
from skeleton_extract_3d.points.plausibility import Doubt

_BODY, _PLAUSIBLE = METHOD.body, METHOD.plausibility
# A trunk of fewer joints tells nothing.
_LEAST_JOINTS, _LEAST_DEPTHS = 3, 2


class Agreement(NamedTuple):
    """How the last N people fitted the depth at their joints, the newest last.

    Attributes:
        sizes: (N,) depth at the trunk over that at which an adult would look as large.
        fits: (N,) bool, whether this can be somebody's, and whether the joints of the trunk are at about one depth.
    """

    sizes: np.ndarray = np.zeros(0)
    fits: np.ndarray = np.zeros(0, bool)

    def with_frame(self, seen: ObservedPeople) -> 'Agreement':
        """Return it with the people of one more frame, those whose trunk and its depth are seen."""
        joints = seen.known[:, TRUNK] & (seen.scores[:, TRUNK] > _PLAUSIBLE.sure_score)
        depths = np.where(joints, lower_median(seen.samples[:, TRUNK]), np.nan)
        middle = lower_median(depths)
        with np.errstate(invalid='ignore'):
            near = (np.abs(depths - middle[:, None]) < _PLAUSIBLE.spread).sum(axis=1)
            sizes = middle / seen.adult_depth
        count, (least, most) = joints.sum(axis=1), _PLAUSIBLE.sizes
        judged = ((count >= _LEAST_JOINTS) & (np.isfinite(depths).sum(axis=1) >= _LEAST_DEPTHS)
                  & np.isfinite(seen.adult_depth))
        with np.errstate(invalid='ignore'):
            fits = (sizes > least) & (sizes < most) & (near >= _PLAUSIBLE.least_near * count)
        last = slice(-_PLAUSIBLE.sightings, None)
        return Agreement(np.concatenate([self.sizes, sizes[judged]])[last],
                         np.concatenate([self.fits, fits[judged]])[last])

    def doubt(self) -> Optional[Doubt]:
        """Return what is wrong, if anything is."""
        count, unfit = len(self.fits), int((~self.fits).sum())
        if count < _PLAUSIBLE.least_sightings or unfit <= _PLAUSIBLE.most_unfit * count:
            return None
        stature = float(np.median(self.sizes)) * _BODY.adult_stature
        return Doubt('people do not fit the depth',
                     f'{unfit} of the last {count} people; by the depth at their joints they are {stature:.2g} m tall '
                     'in the median: are image and depth of different cameras, is the depth in another unit, or K of '
                     'another resolution?')

"""Lifting methods: from observed people to joints in space. One is chosen when the estimator is built."""
from dataclasses import dataclass
from typing import Callable

import numpy as np

from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.people import values_in
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.records import Expectation, Lifted, ObservedPeople
from skeleton_extract_3d.lift.robust import lift_robustly
from skeleton_extract_3d.lift.window_mean import lift_by_window
from skeleton_extract_3d.points.point_grid import PointGrid


@dataclass(frozen=True)
class LiftingParams(Parameters):
    """How a keypoint's position is read from the cloud."""

    retired = ('surface_offsets',)

    lifting: str = parameter(
        'robust', "'robust': all joints of a person together, from the surfaces around them, the lengths of bones and "
                  "the frame before. 'mean3x3': each joint at the mean of the points around its pixel, as the original "
                  'does.', choices=('robust', 'mean3x3'))
    window: int = parameter(
        3, "With 'mean3x3': side of the square of points around a keypoint that are summarised; larger bridges larger "
           'holes but mixes in the background.', unit='px', choices=tuple(range(1, 32, 2)))
    statistic: str = parameter(
        'mean', "With 'mean3x3': how the finite points of the window are summarised, per coordinate: 'mean' as the "
                "original does, 'median' where the window may touch the background.", choices=('mean', 'median'))


LiftingMethod = Callable[[ObservedPeople, PointGrid, Expectation], Lifted]
"""Returns where the joints of people are, by points and what is expected of the same people before the frame."""


def make_lifting(params: LiftingParams, occlusion: bool, method: MethodConstants = METHOD) -> LiftingMethod:
    """Return the chosen lifting method; see `OcclusionParams.occlusion`.

    Without occlusion each joint with a point is measured, robustly on the nearest surface in its window.
    """
    body = method.body

    def lift(observed: ObservedPeople, points: PointGrid, expected: Expectation) -> Lifted:
        lifted = lift_robustly(observed, points, expected, method)
        if params.lifting == 'mean3x3':
            people = lift_by_window(observed.people_2d, observed.image_size, points, params.window, params.statistic)
            xyz = values_in(people.xyz.astype(np.float64), people.skeleton, COCO_18, np.nan)
        elif occlusion:
            return lifted
        else:
            depth = surfaces.foreground(observed.samples) + body.under_skin * (
                lifted.stature / body.adult_stature)[:, None]
            xyz = observed.rays * np.where(observed.known, depth, np.nan)[..., None]
        measured = np.isfinite(xyz).all(axis=2)
        if occlusion:
            measured &= lifted.measured
        return lifted._replace(xyz=np.where(measured[..., None], xyz, lifted.xyz), measured=measured)

    return lift

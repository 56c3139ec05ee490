"""Lifting methods: from observed people to joints in space. One is chosen when the estimator is built."""
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from openpose_ros_pkg.params.parameters import Parameters, parameter
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.records import Expectation, Lifted, ObservedPeople
from skeleton_extract_3d.lift.robust import RobustLifting
from skeleton_extract_3d.lift.window_mean import in_coco, lift_by_window
from skeleton_extract_3d.points.point_grid import PointGrid


@dataclass(frozen=True)
class LiftingParams(Parameters):
    """How a keypoint's position is read from the cloud."""

    lifting: str = parameter(
        'robust', "'robust': all joints of a person together, from the surfaces around them, the lengths of bones and "
                  "the frame before. 'mean3x3': each joint at the mean of the points around its pixel, as the original "
                  'does.', choices=('robust', 'mean3x3'))
    surface_offsets: str = parameter(
        'anatomical', "With 'robust', where a measured joint is put: 'anatomical' inside the body, as deep under the "
                      "surface as joints lie; 'none' on the surface.", choices=('anatomical', 'none'))
    window: int = parameter(
        3, "With 'mean3x3': side of the square of points around a keypoint that are summarised; larger bridges larger "
           'holes but mixes in the background.', unit='px', choices=tuple(range(1, 32, 2)))
    statistic: str = parameter(
        'mean', "With 'mean3x3': how the finite points of the window are summarised, per coordinate: 'mean' as the "
                "original does, 'median' where the window may touch the background.", choices=('mean', 'median'))


class LiftingMethod(Protocol):
    """A lifting method."""

    def lift(self, observed: ObservedPeople, points: PointGrid, expected: Expectation) -> Lifted:
        """Return where the joints of people are, by points and what is expected of the same people before the frame."""


def make_lifting(params: LiftingParams, occlusion: bool, method: MethodConstants = METHOD) -> LiftingMethod:
    """Return the chosen lifting method; see `OcclusionParams.occlusion`."""
    on_skin = params.lifting == 'robust' and params.surface_offsets == 'none'
    robust = RobustLifting(method, on_skin)
    if params.lifting == 'mean3x3':
        return WindowMean(robust, params.window, params.statistic, occlusion)
    return robust if occlusion else NearestSurface(robust, method, on_skin)


class WindowMean:
    """Another method with the joints at the mean of the points in a window around their pixel.

    With `occlusion`, joints that `inner` has as hidden stay hidden; without, each joint with a point is measured.
    """

    def __init__(self, inner: LiftingMethod, window: int, statistic: str, occlusion: bool) -> None:
        self._inner, self._window, self._statistic, self._occlusion = inner, window, statistic, occlusion

    def lift(self, observed: ObservedPeople, points: PointGrid, expected: Expectation) -> Lifted:
        """Return where the joints are; see `LiftingMethod`."""
        lifted = self._inner.lift(observed, points, expected)
        xyz = in_coco(lift_by_window(observed.people_2d, observed.image_size, points, self._window, self._statistic))
        measured = np.isfinite(xyz).all(axis=2)
        if self._occlusion:
            measured &= lifted.measured
        return lifted._replace(xyz=np.where(measured[..., None], xyz, lifted.xyz), measured=measured)


class NearestSurface:
    """Another method, but each joint with a keypoint is on or under the nearest surface in its window."""

    def __init__(self, inner: LiftingMethod, method: MethodConstants = METHOD, on_skin: bool = False) -> None:
        self._inner, self._method, self._on_skin = inner, method, on_skin

    def lift(self, observed: ObservedPeople, points: PointGrid, expected: Expectation) -> Lifted:
        """Return where the joints are; see `LiftingMethod`."""
        lifted = self._inner.lift(observed, points, expected)
        body, depth = self._method.body, surfaces.foreground(observed.samples)
        if not self._on_skin:
            depth = depth + body.surface_offsets * (lifted.stature / body.adult_stature)[:, None]
        measured = np.isfinite(depth) & observed.known
        xyz = np.where(measured[..., None], observed.rays * depth[..., None], lifted.xyz)
        return lifted._replace(xyz=xyz, measured=measured)

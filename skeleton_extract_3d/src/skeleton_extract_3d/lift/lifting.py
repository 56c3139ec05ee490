"""Ways of lifting: what puts the joints of a frame's people into space. One is chosen when the estimator is built."""
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from openpose_ros_pkg.params.parameters import Parameters, parameter
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.records import Expectation, Lifted, ObservedPeople
from skeleton_extract_3d.lift.robust import RobustLifting
from skeleton_extract_3d.lift.window_mean import in_coco, lift_by_window
from skeleton_extract_3d.points.point_grid import PointGrid

_SURFACE_OFFSETS = METHOD.body.surface_offsets


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
    """A way of lifting."""

    def lift(self, seen: ObservedPeople, points: PointGrid, expected: Expectation) -> Lifted:
        """Return where the joints of the people of a frame are.

        Args:
            seen: the people of the frame.
            points: cloud or depth image that they were observed in.
            expected: what is known of the same people before the frame.
        """


def make_lifting(params: LiftingParams, occlusion: bool) -> LiftingMethod:
    """Return the chosen way of lifting.

    Args:
        occlusion: tell hidden joints from those that are seen; see `OcclusionParams.occlusion`.
    """
    robust = RobustLifting()
    if params.lifting == 'mean3x3':
        return WindowMean(robust, params.window, params.statistic, occlusion)
    on_skin = params.surface_offsets == 'none'
    if not occlusion:
        return NearestSurface(robust, on_skin)
    return OnSkin(robust) if on_skin else robust


class WindowMean:
    """Another method with the joints at the mean of the points in a window around their pixel.

    Args:
        inner: decides what is seen and where all other joints are.
        window, statistic: see `LiftingParams`.
        occlusion: True: what the other method has as hidden stays hidden. False: each joint with a point is measured.
    """

    def __init__(self, inner: LiftingMethod, window: int, statistic: str, occlusion: bool) -> None:
        self._inner, self._window, self._statistic, self._occlusion = inner, window, statistic, occlusion

    def lift(self, seen: ObservedPeople, points: PointGrid, expected: Expectation) -> Lifted:
        """Return where the joints are; see `LiftingMethod`."""
        lifted = self._inner.lift(seen, points, expected)
        xyz = in_coco(lift_by_window(seen.people_2d, seen.image_size, points, self._window, self._statistic))
        measured = np.isfinite(xyz).all(axis=2)
        if self._occlusion:
            measured &= lifted.measured
        return lifted._replace(xyz=np.where(measured[..., None], xyz, lifted.xyz), measured=measured)


class NearestSurface:
    """Another method with every joint that has a keypoint on, or under, the nearest surface in its window.

    Args:
        inner: tells the stature, and where joints without a keypoint are.
        on_skin: True: joints are put on the surface. False: as much deeper as they lie under the skin.
    """

    def __init__(self, inner: LiftingMethod, on_skin: bool) -> None:
        self._inner, self._on_skin = inner, on_skin

    def lift(self, seen: ObservedPeople, points: PointGrid, expected: Expectation) -> Lifted:
        """Return where the joints are; see `LiftingMethod`."""
        lifted = self._inner.lift(seen, points, expected)
        depth = surfaces.foreground(seen.samples)
        if not self._on_skin:
            depth = depth + _SURFACE_OFFSETS * (lifted.stature / METHOD.body.adult_stature)[:, None]
        measured = np.isfinite(depth) & seen.known
        xyz = np.where(measured[..., None], seen.rays * depth[..., None], lifted.xyz)
        return lifted._replace(xyz=xyz, measured=measured)


class OnSkin:
    """Another method with the measured joints on the surface in front of them.

    Args:
        inner: the other method.
    """

    def __init__(self, inner: LiftingMethod) -> None:
        self._inner = inner

    def lift(self, seen: ObservedPeople, points: PointGrid, expected: Expectation) -> Lifted:
        """Return where the joints are; see `LiftingMethod`."""
        lifted = self._inner.lift(seen, points, expected)
        return lifted._replace(xyz=np.where(np.isfinite(lifted.surface), lifted.surface, lifted.xyz))

"""Ways of lifting: what puts the joints of a frame's people into space."""
from dataclasses import dataclass

import numpy as np

from openpose_ros_pkg.params.parameters import Parameters, parameter
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.records import Expectation, Lifted, ObservedPeople
from skeleton_extract_3d.lift.robust import lift_together
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


def lift(seen: ObservedPeople, points: PointGrid, expected: Expectation, params: LiftingParams, occlusion: bool
         ) -> Lifted:
    """Return where the joints of the people of a frame are.

    Args:
        points: cloud or depth image that the people were observed in.
        expected: what is known of the same people before the frame.
        occlusion: tell hidden joints from those that are seen; see `OcclusionParams.occlusion`.
    """
    lifted = lift_together(seen, points, expected)
    on_skin = params.surface_offsets == 'none'
    if params.lifting == 'mean3x3':
        return at_window_means(lifted, seen, points, params, occlusion)
    if not occlusion:
        return on_nearest_surfaces(lifted, seen, on_skin)
    return on_surfaces(lifted) if on_skin else lifted


def at_window_means(lifted: Lifted, seen: ObservedPeople, points: PointGrid, params: LiftingParams, occlusion: bool
                    ) -> Lifted:
    """Return people with the joints at the mean of the points in a window around their pixel.

    Args:
        occlusion: True: what was lifted as hidden stays hidden. False: each joint with a point is measured.
    """
    xyz = in_coco(lift_by_window(seen.people_2d, seen.image_size, points, params.window, params.statistic))
    measured = np.isfinite(xyz).all(axis=2)
    if occlusion:
        measured &= lifted.measured
    return lifted._replace(xyz=np.where(measured[..., None], xyz, lifted.xyz), measured=measured)


def on_nearest_surfaces(lifted: Lifted, seen: ObservedPeople, on_skin: bool) -> Lifted:
    """Return people with every joint that has a keypoint on, or under, the nearest surface in its window.

    Args:
        on_skin: True: joints are put on the surface. False: as much deeper as they lie under the skin.
    """
    depth = surfaces.foreground(seen.samples)
    if not on_skin:
        depth = depth + _SURFACE_OFFSETS * (lifted.stature / METHOD.body.adult_stature)[:, None]
    measured = np.isfinite(depth) & seen.known
    xyz = np.where(measured[..., None], seen.rays * depth[..., None], lifted.xyz)
    return lifted._replace(xyz=xyz, measured=measured)


def on_surfaces(lifted: Lifted) -> Lifted:
    """Return people with the measured joints on the surface in front of them."""
    return lifted._replace(xyz=np.where(np.isfinite(lifted.surface), lifted.surface, lifted.xyz))

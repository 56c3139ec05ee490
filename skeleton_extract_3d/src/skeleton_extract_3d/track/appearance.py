"""Appearance of people: mean colours of the upper and the lower part of their clothes."""
from typing import NamedTuple, Optional, Sequence, Tuple, Union

import cv2
import numpy as np

from skeleton_extract_3d.body.body import HIPS, MIDDLES, SHOULDERS
from skeleton_extract_3d.body.constants import SizeConstants
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.observation import grid_positions
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.points.depth import NoDepth
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.track.constants import AppearanceConstants

# Corners of the trunk.
_CHEST = np.concatenate([SHOULDERS, HIPS])
# The same corner of the other side.
_OTHER_SIDE = [1, 0, 3, 2]
# Hip and knee of both sides, (2 sides, 2 ends).
_THIGHS = np.stack([HIPS, MIDDLES[2:]], axis=1)


def _end_weights(shares: Sequence[float]) -> np.ndarray:
    """Return the weights of two ends at places between them, (N, 2)."""
    return np.array([(1 - share, share) for share in shares])


# Weights of the joints at pixels on the chest, in four rows of three, (12, 4), and of those on a thigh, (3, 2).
_ON_CHEST = np.kron(_end_weights([0.2, 0.4, 0.6, 0.8]), _end_weights([0.15, 0.5, 0.85]))
_ON_THIGH = _end_weights([0.15, 0.4, 0.65])
# Where the pixels of the upper and of the lower part begin.
_PARTS = (0, len(_ON_CHEST))


class Clothes(NamedTuple):
    """Mean colours (P, 2, 3) of the upper and lower clothes of P people, CIELAB with L 0..100, and the number of frames
    (P, 2) in the mean; 0 where unknown.
    """

    colours: np.ndarray
    weights: np.ndarray

    @classmethod
    def unknown(cls, people: int) -> 'Clothes':
        """Return the clothes of people before any observation."""
        return cls(np.zeros((people, len(_PARTS), 3)), np.zeros((people, len(_PARTS))))

    def select(self, people: np.ndarray) -> 'Clothes':
        """Return the clothes of some of the people, by a mask or by indices."""
        return Clothes(self.colours[people], self.weights[people])

    def learnt(self, frame: 'Clothes', usable: np.ndarray, constants: SizeConstants = METHOD.sizes) -> 'Clothes':
        """Return the mean with one more frame of usable people, (P,) bool."""
        known = (frame.weights > 0) & usable[:, None]
        weights = np.minimum(self.weights + known, constants.most_frames)
        share = np.where(known, 1 / np.maximum(weights, 1), 0.0)
        return Clothes(self.colours + share[..., None] * (frame.colours - self.colours), weights)


def observe_clothes(observed: ObservedPeople, points: PointGrid, bgr: Optional[np.ndarray],
                    method: MethodConstants = METHOD) -> Clothes:
    """Return the colours of clothes in an image (H, W, 3) uint8 or None, where the surface is near the trunk's; without
    depth wherever they should be.
    """
    if bgr is None or not len(observed):
        return Clothes.unknown(len(observed))
    pixels = clothes_pixels(np.where(observed.scores[..., None] >= method.sizes.least_score, observed.uv, np.nan))
    depths = surfaces.depths_at(points, np.where(np.isfinite(pixels), pixels, -1e6))
    trunk = surfaces.lower_median(observed.samples[:, _CHEST].reshape(len(observed), -1))
    usable = (np.abs(depths - trunk[:, None]) < method.trunk.reach) | isinstance(points, NoDepth)
    return mean_colours(bgr, grid_positions(pixels, (points.width, points.height), observed.image_size), usable)


def clothes_pixels(uv: np.ndarray) -> np.ndarray:
    """Return pixels on the chest and then on the thighs, (P, 18, 2), NaN where joints (P, 18, 2) are missing."""
    # a corner without a keypoint is taken from the other side of the trunk
    corners = uv[:, _CHEST]
    corners = np.where(np.isfinite(corners), corners, corners[:, _OTHER_SIDE])
    thighs = _ON_THIGH @ uv[:, _THIGHS]
    return np.concatenate([_ON_CHEST @ corners, thighs.reshape(len(uv), 2 * len(_ON_THIGH), 2)], axis=1)


def mean_colours(bgr: np.ndarray, pixels: np.ndarray, usable: np.ndarray) -> Clothes:
    """Return the mean colours at pixels of each person.

    Args:
        pixels: (P, 18, 2) of `clothes_pixels` [px of the image].
        usable: (P, 18) bool, which of them show the person.
    """
    height, width = bgr.shape[:2]
    at = np.rint(np.where(usable[..., None] & np.isfinite(pixels), pixels, -1.0)).astype(np.int64)
    u, v = at[..., 0], at[..., 1]
    usable = (u >= 0) & (v >= 0) & (u < width) & (v < height)
    if not usable.any():
        return Clothes.unknown(len(pixels))
    colours = bgr[np.where(usable, v, 0), np.where(usable, u, 0)]
    lab = cv2.cvtColor(colours.astype(np.float32) / 255, cv2.COLOR_BGR2LAB) * usable[..., None]
    count = np.add.reduceat(usable, _PARTS, axis=1, dtype=np.float64)
    return Clothes(np.add.reduceat(lab, _PARTS, axis=1) / np.maximum(count, 1)[..., None], np.minimum(count, 1))


def colour_distances(first: Clothes, second: Clothes) -> np.ndarray:
    """Return the mean difference (Delta E of CIE 1976) of the parts known of T and P people, (T, P); 0 where none is.
    """
    both = (first.weights > 0)[:, None] & (second.weights > 0)[None]
    difference = np.sqrt(((first.colours[:, None] - second.colours[None]) ** 2).sum(axis=3))
    return np.where(both, difference, 0.0).sum(axis=2) / np.maximum(both.sum(axis=2), 1)


def clothes_evidence(absent: Clothes, new: Clothes, constants: AppearanceConstants = METHOD.track.appearance
                     ) -> Tuple[np.ndarray, np.ndarray]:
    """Return the log likelihood ratio of the same person, (T, N), and which parts were compared, (T, N, 2) bool."""
    both = (absent.weights > 0)[:, None] & (new.weights > 0)[None]
    same = log_normal(new.colours[None] - absent.colours[:, None], constants.same_colour)
    strange = log_normal(new.colours - constants.mean_colour, constants.strange_colour)[None]
    evidence = np.minimum((same - strange).sum(axis=3), constants.most_evidence)
    return np.where(both, evidence, 0.0).sum(axis=2), both


def log_normal(difference: np.ndarray, spread: Union[float, np.ndarray]) -> np.ndarray:
    """Return the logarithm of a normal density, without its constant factor."""
    return -np.log(spread) - (difference / spread) ** 2 / 2

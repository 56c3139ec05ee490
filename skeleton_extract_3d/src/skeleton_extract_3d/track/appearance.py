"""What people wear: mean colours of the upper and the lower part of the clothes."""
from typing import NamedTuple, Optional, Sequence, Tuple

import cv2
import numpy as np

from skeleton_extract_3d.body.body import HIPS, MIDDLES, SHOULDERS
from skeleton_extract_3d.lift import surfaces
from skeleton_extract_3d.lift.observation import grid_positions
from skeleton_extract_3d.lift.records import ObservedPeople
from skeleton_extract_3d.points.point_grid import PointGrid
from skeleton_extract_3d.track.constants import AppearanceConstants

# Corners of the trunk.
_CHEST = np.concatenate([SHOULDERS, HIPS])
# Hip and knee of both sides, (2 sides, 2 ends).
_THIGHS = np.stack([HIPS, MIDDLES[2:]], axis=1)
# Upper and lower part.
PARTS = 2


def _between(shares: Sequence[float]) -> np.ndarray:
    """Return the weights of two ends at places between them, (N, 2)."""
    return np.array([(1 - share, share) for share in shares])


# Weights of the joints at pixels on the chest, in four rows of three, (12, 4), and of those on a thigh, (3, 2).
_ON_CHEST = np.kron(_between([0.2, 0.4, 0.6, 0.8]), _between([0.15, 0.5, 0.85]))
_ON_THIGH = _between([0.15, 0.4, 0.65])


class Clothes(NamedTuple):
    """Colours of the clothes of P people, of the upper and the lower part.

    Attributes:
        colours: (P, 2, 3) CIELAB, L 0..100.
        weights: (P, 2) number of frames that they are the mean of; 0 where nothing is known.
    """

    colours: np.ndarray
    weights: np.ndarray

    @classmethod
    def unknown(cls, people: int) -> 'Clothes':
        """Return what is known of people whose clothes were not seen."""
        return cls(np.zeros((people, PARTS, 3)), np.zeros((people, PARTS)))

    def select(self, people: np.ndarray) -> 'Clothes':
        """Return the clothes of some of the people, by a mask or by indices."""
        return Clothes(self.colours[people], self.weights[people])

    def learnt(self, frame: 'Clothes', usable: np.ndarray, constants: AppearanceConstants) -> 'Clothes':
        """Return the mean with one more frame of usable people, (P,) bool."""
        known = (frame.weights > 0) & usable[:, None]
        weights = np.minimum(self.weights + known, constants.memory)
        share = np.where(known, 1 / np.maximum(weights, 1), 0.0)
        return Clothes(self.colours + share[..., None] * (frame.colours - self.colours), weights)


def observe_clothes(seen: ObservedPeople, points: PointGrid, bgr: Optional[np.ndarray], constants: AppearanceConstants
                    ) -> Clothes:
    """Return the colours of the clothes in one frame, where the surface is near the trunk's.

    Args:
        bgr: (H, W, 3) uint8, the image; None: the clothes stay unknown.
    """
    if bgr is None or not len(seen):
        return Clothes.unknown(len(seen))
    trunk = surfaces.lower_median(seen.samples[:, _CHEST].reshape(len(seen), -1))
    upper, lower = clothes_pixels(seen.uv)
    pixels, count = np.concatenate([upper, lower], axis=1), upper.shape[1]
    with np.errstate(invalid='ignore'):
        usable = np.abs(surfaces.depths_at(points, np.where(np.isfinite(pixels), pixels, -1e6))
                        - trunk[:, None]) < constants.depth_range
    pixels = grid_positions(pixels, (points.width, points.height), seen.image_size)
    parts = [mean_colours(bgr, pixels[:, part], usable[:, part]) for part in (slice(None, count), slice(count, None))]
    return Clothes(np.stack([colours for colours, _ in parts], axis=1),
                   np.stack([number > 0 for _, number in parts], axis=1).astype(np.float64))


def clothes_pixels(uv: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return pixels on the chest and on the thighs, (P, 12, 2) and (P, 6, 2), NaN where joints are missing.

    Args:
        uv: (P, 18, 2) [px].
    """
    thighs = _ON_THIGH @ uv[:, _THIGHS]
    return _ON_CHEST @ uv[:, _CHEST], thighs.reshape(len(uv), 2 * len(_ON_THIGH), 2)


def mean_colours(bgr: np.ndarray, pixels: np.ndarray, usable: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the mean colour at pixels of each person (CIELAB, L 0..100), (P, 3), and how many were usable, (P,).

    Args:
        bgr: (H, W, 3) uint8.
        pixels: (P, N, 2) [px of this image].
        usable: (P, N) which of them show the person.
    """
    height, width = bgr.shape[:2]
    at = np.rint(np.where(usable[..., None] & np.isfinite(pixels), pixels, -1.0)).astype(np.int64)
    u, v = at[..., 0], at[..., 1]
    usable = (u >= 0) & (v >= 0) & (u < width) & (v < height)
    if not usable.any():
        return np.zeros((len(pixels), 3)), np.zeros(len(pixels), np.int64)
    colours = bgr[np.where(usable, v, 0), np.where(usable, u, 0)]
    lab = cv2.cvtColor(colours.astype(np.float32) / 255, cv2.COLOR_BGR2LAB)
    count = usable.sum(axis=1)
    return (lab * usable[..., None]).sum(axis=1) / np.maximum(count, 1)[:, None], count


def colour_distances(first: Clothes, second: Clothes) -> np.ndarray:
    """Return the mean difference (Delta E of CIE 1976) of the parts that are known of both, (T, P); 0 where none is.

    Args:
        first: of T people; second: of P people.
    """
    both = (first.weights > 0)[:, None] & (second.weights > 0)[None]
    difference = np.sqrt(((first.colours[:, None] - second.colours[None]) ** 2).sum(axis=3))
    return np.where(both, difference, 0.0).sum(axis=2) / np.maximum(both.sum(axis=2), 1)

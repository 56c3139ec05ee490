"""What tracks tell of a frame before it is lifted."""
import numpy as np

from skeleton_extract_3d.body import measures
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.lift.records import Expectation
from skeleton_extract_3d.track.tracks import Tracks


def expect(tracks: Tracks, row: np.ndarray, method: MethodConstants = METHOD) -> Expectation:
    """Return the expectation of people with tracks in rows (P,), predicted to this frame."""
    constants, old = method.track.expectation, row >= 0
    if not old.any():
        return Expectation.of_strangers(len(row), method.body)
    row = np.maximum(row, 0)
    sizes = tracks.sizes.select(row)
    variance = tracks.joints.position_covariance[row, :, 2, 2]
    known = Expectation(
        root=tracks.root.position[row, 0, 2],
        depth=np.where(tracks.has[row], tracks.joints.position[row, :, 2], np.nan),
        depth_sigma=constants.depth_factor * np.sqrt(variance + constants.depth_sigma ** 2),
        left=tracks.left[row] * constants.turning_frames, stature=sizes.stature,
        stature_spread=measures.stature_spread(sizes, method),
        lengths=measures.expected_lengths(sizes, method), length_spread=measures.length_spreads(sizes, method))
    if old.all():
        return known
    return Expectation(*(np.where(old if value.ndim == 1 else old[:, None], value, other)
                         for value, other in zip(known, Expectation.of_strangers(len(row), method.body))))

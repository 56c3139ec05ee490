"""What the tracks tell the lifting of a frame's people."""
import numpy as np

from skeleton_extract_3d.body import measures
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.records import Expectation
from skeleton_extract_3d.track.identity import stature_spread
from skeleton_extract_3d.track.tracks import Tracks

_EXPECTATION = METHOD.track.expectation

def expect(tracks: Tracks, row: np.ndarray, elapsed: float) -> Expectation:
    """Return what is known of the people of a frame.

    Args:
        tracks: predicted to this frame.
        row: (P,) of each person in the tracks; -1: a stranger.
        elapsed: since the frame before [s].
    """
    old = row >= 0
    if not old.any():
        return Expectation.of_strangers(len(row))
    row = np.maximum(row, 0)
    sizes = tracks.sizes.select(row)
    weight = min(_EXPECTATION.turning_time / max(elapsed, _EXPECTATION.least_elapsed), _EXPECTATION.most_turning_weight)
    variance = tracks.joints.position_covariance[row, :, 2, 2]
    known = Expectation(
        root=tracks.root.position[row, 0, 2],
        depth=np.where(tracks.has[row], tracks.joints.position[row, :, 2], np.nan),
        depth_sigma=_EXPECTATION.depth_factor * np.sqrt(variance + _EXPECTATION.depth_sigma ** 2),
        left=tracks.left[row] * weight, stature=sizes.stature, stature_spread=stature_spread(sizes),
        lengths=measures.expected_lengths(sizes), length_spread=measures.length_spreads(sizes))
    if old.all():
        return known
    return Expectation(*(np.where(old if value.ndim == 1 else old[:, None], value, default)
                         for value, default in zip(known, Expectation.of_strangers(len(row)))))

"""Left and right of people: networks exchange them where the face is hidden, as by what a person holds up.

A body does not turn round from one frame to the next, and arms do not bend backwards.
"""
from typing import Tuple

import numpy as np

from skeleton_extract_3d.body.body import ENDS, HIPS, JOINTS, MIDDLES, ROOTS, SHOULDERS, SWAP
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.frame import FrameView
from skeleton_extract_3d.lift.records import Lifted, ObservedPeople
from skeleton_extract_3d.lift.surfaces import lower_median
from skeleton_extract_3d.track.tracks import Tracks

_NOSE, _WRISTS, _CORNERS = JOINTS.index('nose'), ENDS[:2], np.stack([SHOULDERS, HIPS], axis=1)
_PAIRED = np.concatenate([ROOTS, MIDDLES, ENDS])


def sides_of(observed: ObservedPeople, lifted: Lifted, tracks: Tracks, row: np.ndarray, view: FrameView,
             method: MethodConstants = METHOD) -> Tuple[np.ndarray, np.ndarray]:
    """Return which people have left and right exchanged, (P,) bool, and `Tracks.trust` in their sides, (P,) [s]; by
    tracks, predicted to this frame, in rows (P,), -1 where there is none.

    Hands that would reach backwards tell sides at once, without a track. Trust grows while what is seen clearly agrees
    with the track, up to a limit, and falls while it clearly does not, or while neither is clear, as from the side;
    without any, what is seen is right.
    """
    constants = method.track.sides
    trust, tracked = np.zeros(len(row)), np.flatnonzero(row >= 0)
    agreeing, opposite = np.zeros((2, len(row)), bool)
    backwards = reaching_backwards(observed, lifted, method)
    if len(tracked):
        old = tracks.select(row[tracked])
        agreeing[tracked], opposite[tracked] = sides_by_track(
            observed.select(tracked).exchanged(backwards[tracked]), old, view.stamp, method)
        trust[tracked] = old.trust
    sure = opposite & (observed.scores[:, _NOSE] > constants.face)
    fade = trust * np.expm1(-view.elapsed / constants.fading)
    change = np.where(agreeing, view.elapsed, np.where(opposite, -view.elapsed, fade))
    change = np.where(observed.people_2d.looked, change, 0.0)  # registration repeats the sides of the track
    trust = np.where(sure, 0.0, np.clip(trust + change, 0.0, constants.hold))
    return backwards ^ (opposite & (trust > 0)), trust


def reaching_backwards(observed: ObservedPeople, lifted: Lifted, method: MethodConstants = METHOD) -> np.ndarray:
    """Return which people show their back, by the sides of their joints, but hands far before them, (P,) bool."""
    constants, body, surface = method.track.sides, method.body, lower_median(observed.samples)
    trunk = observed.uv[:, _CORNERS]  # (P, left and right, shoulder and hip, 2)
    across, down = (trunk[:, 0] - trunk[:, 1]).mean(axis=1), (trunk[..., 1, :] - trunk[..., 0, :]).mean(axis=1)
    depth = lifted.xyz[:, _CORNERS, 2].mean(axis=(1, 2))
    # of a trunk behind a thing, the legs tell more
    legs = np.where(observed.detached[:, HIPS].any(axis=(1, 2)), surface[:, MIDDLES[2:]].max(axis=1), np.nan)
    depth = np.fmax(depth, legs)
    scale = depth / observed.focal / (lifted.stature / body.adult_stature)
    length = np.sqrt((down * down).sum(axis=1))
    breadth = (across[:, 1] * down[:, 0] - across[:, 0] * down[:, 1]) / np.maximum(length, 1e-6)  # of a back
    seen = (breadth * scale > constants.back * (body.shoulder_width + body.hip_width) / 2) & (
        length * scale > constants.back * body.trunk_length)
    ahead = depth[:, None] - surface[:, _WRISTS]
    return seen & ((ahead > constants.ahead[0]) & (ahead < constants.ahead[1])).all(axis=1)


def sides_by_track(observed: ObservedPeople, tracks: Tracks, stamp: float, method: MethodConstants = METHOD
                   ) -> Tuple[np.ndarray, np.ndarray]:
    """Return which people are clearly nearer to where their tracks expect them as they are, and which with left and
    right exchanged, (P,) bool each.
    """
    constants, position = method.track.sides, tracks.joints.position
    place = observed.rays[..., :2] * position[..., 2:]

    def off(partners: np.ndarray) -> np.ndarray:
        distance = np.sqrt(((place - position[:, partners, :2]) ** 2).sum(axis=2))
        both = (observed.known & tracks.has[:, partners])[:, _PAIRED]
        return np.where(both, distance[:, _PAIRED], 0.0).sum(axis=1) / np.maximum(both.sum(axis=1), 1)

    as_given, exchanged = off(np.arange(len(JOINTS))), off(SWAP)
    recent = stamp - tracks.last_seen <= constants.gap
    return (recent & (exchanged > constants.apart) & (as_given < exchanged * constants.nearer),
            recent & (as_given > constants.apart) & (exchanged < as_given * constants.nearer))

"""The depths of all joints of a person at once: what the surfaces say of each, and what bones allow between them.

Pictorial structures (Felzenszwalb and Huttenlocher, IJCV 2005), with the depth along each keypoint's ray in place of a
place in the image. Each joint has candidates on its ray, with a cost of -2 log likelihood. The skeleton is a tree but
for shoulders and hips, whose pairs are treated as one variable each; so the cheapest assignment that goes through each
candidate (its min-marginal) is found exactly, by passing messages once inwards and once outwards.

Costs of bones: ((distance - length) / sigma)^2. Two depths explain the length of most bones; which way people face
decides then: elbows are outside of shoulders, forearms bend forwards, shins backwards (`body.UPPER_DIRECTIONS`). Where
they face comes from a first round over the trunk alone and from the time before.
"""
from typing import NamedTuple, Tuple

import numpy as np

from skeleton_extract_3d import compiled
from skeleton_extract_3d.body.body import ADULT_STATURE, BONES, LOWER_DIRECTIONS, SIDES, UPPER_DIRECTIONS
from skeleton_extract_3d.lift.surfaces import DELTAS, HALF, STEP, STEPS

# Order of the joints in the arrays of this module: left and right shoulder, left and right hip, then their middles
# (elbows, knees) and ends (wrists, ankles).
ROOT_ROWS, MIDDLE_ROWS, END_ROWS = slice(0, 4), slice(4, 8), slice(8, 12)
# Kinds of a person's bones, and where the fields of `Bones` are among them.
_KINDS = [BONES.index(name) for name in ('upper_arm', 'upper_arm', 'thigh', 'thigh', 'forearm', 'forearm', 'shin',
                                         'shin', 'shoulders', 'hips', 'trunk', 'head')]
_UPPER, _LOWER, _PAIRS, _TRUNK, _HEAD = slice(0, 4), slice(4, 8), slice(8, 10), 10, 11
# Error of a length by those of its ends, by one whose ray is a guess, and of the head's by nodding [m].
_KEYPOINT_ERROR, _GUESS_ERROR, _NODDING = 0.02, 0.25, 0.02
# No violation of a length costs more: a keypoint may be elsewhere.
_LENGTH_LIMIT = 30.0
# The same for directions, and for the turn of hips against shoulders and against the time before.
_DIRECTION_LIMIT, _TURN_LIMIT = 9.0, 9.0
# Standard deviation of the difference of depth of shoulders and hips, given where the person faces [m].
_TURN_SPREAD = np.array([0.10, 0.07], np.float32)
# Error of the direction between two shoulders or hips beyond that of their depths [m].
_PAIR_ERROR = 0.03
# Shoulders and hips are level but for this share.
_LEVEL = 0.5
# Nothing is nearer than this [m].
_NEAREST = 0.15
# Vectors below this length [m] have no direction.
_LEAST_LENGTH = 1e-3
# The spread of a depth is measured around the mean of so many candidates on both sides of the cheapest one.
_MODE = 3


class Bones(NamedTuple):
    """Lengths [m] and how well they are known.

    Attributes:
        upper, lower: (P, 4) of the four limbs; pairs: (P, 2) shoulders and hips; trunk, head: (P,).
        *_sigma: of the same shape, standard deviations [m].
    """

    upper: np.ndarray
    lower: np.ndarray
    pairs: np.ndarray
    trunk: np.ndarray
    head: np.ndarray
    upper_sigma: np.ndarray
    lower_sigma: np.ndarray
    pairs_sigma: np.ndarray
    trunk_sigma: np.ndarray
    head_sigma: np.ndarray


class Beliefs(NamedTuple):
    """What is left after all joints have been heard.

    Attributes:
        joints: (P, 12, 45) float32 min-marginals of the joints, in this module's order.
        head: (P, 45) float32, of the middle of the ears.
        left: (P, 3) unit vectors to the left of the people.
    """

    joints: np.ndarray
    head: np.ndarray
    left: np.ndarray


def bones_of(lengths: np.ndarray, spread: np.ndarray, unknown: np.ndarray) -> Bones:
    """Return the bones of people.

    Args:
        lengths: (P, 8) [m], in the order of `body.BONES`.
        spread: (P, 8) standard deviation of each length, as a share.
        unknown: (P, 12) joints without a keypoint: their rays are guesses, so their bones say little.
    """
    variance = ((spread * lengths) ** 2 + _KEYPOINT_ERROR ** 2)[:, _KINDS]
    guess = np.where(unknown, _GUESS_ERROR ** 2, 0.0)
    variance[:, _UPPER] += guess[:, ROOT_ROWS] + guess[:, MIDDLE_ROWS]
    variance[:, _LOWER] += guess[:, MIDDLE_ROWS] + guess[:, END_ROWS]
    variance[:, _PAIRS] += guess[:, 0:4:2] + guess[:, 1:4:2]
    sigma = np.sqrt(variance)
    sigma[:, _HEAD] += _NODDING
    return Bones(*(values[:, bones] for values in (lengths[:, _KINDS].astype(np.float32), sigma.astype(np.float32))
                   for bones in (_UPPER, _LOWER, _PAIRS, _TRUNK, _HEAD)))


def infer_depths(costs: np.ndarray, head_costs: np.ndarray, rays: np.ndarray, head_ray: np.ndarray, root: np.ndarray,
                 bones: Bones, stature: np.ndarray, left_before: np.ndarray) -> Beliefs:
    """Return the min-marginals of the joints' depths.

    Args:
        costs: (P, 12, 45) float32 of the joints alone, in this module's order.
        head_costs: (P, 45) float32 of the head.
        rays: (P, 12, 3) with z = 1; of joints without a keypoint, a guess.
        head_ray: (P, 3) with z = 1.
        root: (P,) depth of the trunk [m]; candidates are `root + DELTAS`.
        bones: of these people.
        stature: (P,) [m].
        left_before: (P, 3) to the left of the people just before; its length says how much it counts against this
            frame; NaN where unknown.
    """
    twin = compiled.load()[0]
    if twin is not None:
        return Beliefs(*twin.infer_depths(
            costs, head_costs, rays, head_ray, root, bones, stature, left_before, steps=STEPS, half=HALF, step=STEP,
            mode=_MODE, nearest=_NEAREST, length_limit=_LENGTH_LIMIT, direction_limit=_DIRECTION_LIMIT,
            turn_limit=_TURN_LIMIT, turn_spread=_TURN_SPREAD, pair_error=_PAIR_ERROR, level=_LEVEL,
            least_length=_LEAST_LENGTH, adult_stature=ADULT_STATURE, sides=SIDES, upper_directions=UPPER_DIRECTIONS,
            lower_directions=LOWER_DIRECTIONS))
    rays, head_ray = rays.astype(np.float32), head_ray.astype(np.float32)
    z = np.maximum(root[:, None] + DELTAS, _NEAREST).astype(np.float32)
    # the middle of a pair of joints is between two candidates as well
    half_steps = (np.arange(2 * STEPS - 1) - 2 * HALF) * (STEP / 2)
    z_middle = np.maximum(root[:, None] + half_steps, _NEAREST).astype(np.float32)
    roots, middles, ends = rays[:, ROOT_ROWS], rays[:, MIDDLE_ROWS], rays[:, END_ROWS]
    neck, hips = (roots[:, 0] + roots[:, 1]) / 2, (roots[:, 2] + roots[:, 3]) / 2
    trunk_cost = _length_costs(z_middle, neck[:, None], z_middle, hips[:, None], bones.trunk[:, None],
                               bones.trunk_sigma[:, None])[:, 0]
    head_cost = _length_costs(z_middle, neck[:, None], z, head_ray[:, None], bones.head[:, None],
                              bones.head_sigma[:, None])[:, 0]
    from_head = (head_cost + head_costs[:, None, :]).min(axis=2)
    pair_costs = _length_costs(z, roots[:, 0::2], z, roots[:, 1::2], bones.pairs, bones.pairs_sigma)

    first, _, _ = _trunk_beliefs(costs[:, ROOT_ROWS], pair_costs, trunk_cost, from_head)
    position, sigma = read_depths(first)
    left, forward = _facing(roots * (root[:, None] + position)[..., None], sigma, left_before)
    turn = (bones.pairs * left[:, 2:].astype(np.float32))[..., None, None]
    turned = (z[:, None, :, None] - z[:, None, None, :] - turn) / _TURN_SPREAD[:, None, None]
    pair_costs = pair_costs + np.minimum(turned * turned, _TURN_LIMIT)

    scale = (stature / ADULT_STATURE).astype(np.float32)
    upper_cost = (_length_costs(z, roots, z, middles, bones.upper, bones.upper_sigma)
                  + _direction_costs(z, roots, middles, left, forward, UPPER_DIRECTIONS, scale))
    lower_cost = (_length_costs(z, middles, z, ends, bones.lower, bones.lower_sigma)
                  + _direction_costs(z, middles, ends, left, forward, LOWER_DIRECTIONS, scale))
    from_ends = (lower_cost + costs[:, END_ROWS, None, :]).min(axis=3)
    middles_in = costs[:, MIDDLE_ROWS] + from_ends
    from_middles = (upper_cost + middles_in[:, :, None, :]).min(axis=3)
    root_beliefs, shoulders, from_hips = _trunk_beliefs(costs[:, ROOT_ROWS] + from_middles, pair_costs, trunk_cost,
                                                        from_head)
    middle_beliefs = middles_in + (upper_cost + (root_beliefs - from_middles)[..., None]).min(axis=2)
    end_beliefs = costs[:, END_ROWS] + (lower_cost + (middle_beliefs - from_ends)[..., None]).min(axis=2)
    head_beliefs = head_costs + (head_cost + (shoulders + from_hips)[..., None]).min(axis=1)
    return Beliefs(np.concatenate([root_beliefs, middle_beliefs, end_beliefs], axis=1), head_beliefs, left)


def read_depths(beliefs: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return depth from the trunk's [m] and its standard deviation [m] for (..., 45) min-marginals.

    The depth is the mean around the cheapest candidate; the deviation counts every candidate, so a second solution
    widens it.
    """
    twin = compiled.load()[0]
    if twin is not None:
        return twin.read_depths(beliefs, steps=STEPS, half=HALF, step=STEP, mode=_MODE)
    likelihood = np.exp(-0.5 * (beliefs - beliefs.min(axis=-1, keepdims=True)))
    likelihood /= likelihood.sum(axis=-1, keepdims=True)
    number = np.arange(STEPS)
    best = likelihood.argmax(axis=-1)
    mode = np.where(np.abs(number - best[..., None]) <= _MODE, likelihood, 0.0)
    mean = (mode @ number) / mode.sum(axis=-1)
    deviation = np.sqrt((likelihood * (number - mean[..., None]) ** 2).sum(axis=-1))
    return (mean - HALF) * STEP, deviation * STEP


def _length_costs(z_start: np.ndarray, start: np.ndarray, z_end: np.ndarray, end: np.ndarray, length: np.ndarray,
                  sigma: np.ndarray) -> np.ndarray:
    """Return the costs of bones between candidates of their ends, (P, B, candidates, candidates) float32.

    Args:
        z_start, z_end: (P, candidates) [m].
        start, end: (P, B, 3) rays.
        length, sigma: (P, B) [m].
    """
    z_start, z_end = z_start[:, None, :, None], z_end[:, None, None, :]
    squares = [(one * other).sum(axis=-1)[..., None, None] for one, other in ((start, start), (end, end), (start, end))]
    distance = squares[0] * z_start * z_start + squares[1] * z_end * z_end
    distance -= (2 * squares[2] * z_start) * z_end
    np.sqrt(np.maximum(distance, 0, out=distance), out=distance)
    distance -= length[..., None, None]
    distance /= sigma[..., None, None]
    distance *= distance
    return np.minimum(distance, _LENGTH_LIMIT, out=distance)


def _direction_costs(z: np.ndarray, start: np.ndarray, end: np.ndarray, left: np.ndarray, forward: np.ndarray,
                     directions: Tuple[np.ndarray, np.ndarray], scale: np.ndarray) -> np.ndarray:
    """Return the costs of where limbs point, (P, 4, 45, 45) float32.

    Args:
        z: (P, 45) [m].
        start, end: (P, 4, 3) rays.
        left, forward: (P, 3) axes of the people.
        directions: mean and standard deviation outwards and forwards, (4, 2) each [m].
        scale: (P,) of the lengths.
    """
    outwards = left[:, None] * SIDES[:, None]
    total = 0.0
    for i, axis in enumerate((outwards, np.broadcast_to(forward[:, None], outwards.shape))):
        mean, sigma = (values[:, i] * scale[:, None] for values in directions)
        to_end = ((end * axis).sum(axis=-1) / sigma).astype(np.float32)[..., None] * z[:, None]
        to_start = ((start * axis).sum(axis=-1) / sigma).astype(np.float32)[..., None] * z[:, None]
        off = (to_end - (mean / sigma).astype(np.float32)[..., None])[:, :, None, :] - to_start[..., None]
        off *= off
        total = total + off
    return np.minimum(total, _DIRECTION_LIMIT, out=total)


def _facing(roots: np.ndarray, sigma: np.ndarray, left_before: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return unit vectors to the left and forwards of people, (P, 3) each.

    Args:
        roots: (P, 4, 3) shoulders and hips [m].
        sigma: (P, 4) of their depths [m].
        left_before: (P, 3), NaN where unknown.
    """
    across = roots[:, 0::2] - roots[:, 1::2]
    weight = 1 / (sigma[:, 0::2] ** 2 + sigma[:, 1::2] ** 2 + _PAIR_ERROR ** 2)
    across = (across * weight[..., None]).sum(axis=1)
    across[:, 1] *= _LEVEL
    left = _unit(_unit(across) + np.where(np.isfinite(left_before), left_before, 0.0))
    down = _unit(roots[:, 2] + roots[:, 3] - roots[:, 0] - roots[:, 1])
    return left, _unit(np.cross(left, -down))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), _LEAST_LENGTH)


def _trunk_beliefs(roots_in: np.ndarray, pair_costs: np.ndarray, trunk_cost: np.ndarray, from_head: np.ndarray
                   ) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pass messages between shoulders, hips and head.

    Args:
        roots_in: (P, 4, 45) costs of shoulders and hips, with what comes from their limbs.
        pair_costs: (P, 2, 45, 45) of the left and the right one.
        trunk_cost: (P, 89, 89) between the middles of shoulders and hips.
        from_head: (P, 89) of the middle of the shoulders.

    Returns:
        min-marginals of shoulders and hips, (P, 4, 45); costs of the middle of the shoulders by the shoulders, and by
        the hips, (P, 89) each.
    """
    pairs = pair_costs + roots_in[:, 0::2, :, None] + roots_in[:, 1::2, None, :]
    shoulders, hips = np.moveaxis(_least_by_middle(pairs), 1, 0)
    from_hips = (trunk_cost + hips[:, None, :]).min(axis=2)
    from_shoulders = (trunk_cost + (shoulders + from_head)[..., None]).min(axis=1)
    outwards = np.stack([from_head + from_hips, from_shoulders], axis=1)
    pairs = pairs + _by_sum(outwards)
    beliefs = np.empty_like(roots_in)
    beliefs[:, 0::2], beliefs[:, 1::2] = pairs.min(axis=3), pairs.min(axis=2)
    return beliefs, shoulders, from_hips


def _least_by_middle(pairs: np.ndarray) -> np.ndarray:
    """Return the least of each anti-diagonal of (P, G, 45, 45) costs, (P, G, 89): the pairs with one middle."""
    skewed = np.full((*pairs.shape[:3], 2 * STEPS - 1), np.inf, pairs.dtype)
    first, second, row, column = skewed.strides
    np.lib.stride_tricks.as_strided(skewed, pairs.shape, (first, second, row + column, column))[...] = pairs
    return skewed.min(axis=2)


def _by_sum(values: np.ndarray) -> np.ndarray:
    """Return a view of (P, G, 89) values as (P, G, 45, 45): at [l, r] the value at l + r."""
    values = np.ascontiguousarray(values)
    first, second, step = values.strides
    return np.lib.stride_tricks.as_strided(values, (*values.shape[:2], STEPS, STEPS), (first, second, step, step),
                                           writeable=False)

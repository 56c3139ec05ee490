"""Toes and heels of the people in an image, by a network for landmarks of bodies."""
import math
from dataclasses import dataclass, replace
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.detect.tracking import person_sizes
from openpose_ros_pkg.landmarks.body_landmarks import BodyLandmarkNetwork, BodyLandmarks
from openpose_ros_pkg.params.constants import constant
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import BLAZEPOSE_33, BODY_25

# Toe and heel of each foot, and the joints of its leg, left first; the network does not know small toes.
_PARTS = [(f'{side}_big_toe', f'{side}_heel') for side in ('left', 'right')]
_LEGS = [(f'{side}_ankle', f'{side}_knee') for side in ('left', 'right')]
_RENDERED = 'rendered, dressed people in 14 scenes'


@dataclass(frozen=True)
class FeetConstants:
    """Which toes and heels count, and how often they are looked for."""

    ankle: float = constant(
        0.1, "Greatest distance of the network's ankle from that of the person, as a share of the size of the person "
              '(half the diagonal of the box of the joints): of feet with ankles that agree 95 % were right within '
              '60 mm, of others 20 %.', source=_RENDERED)
    knee: float = constant(0.2, 'The same of the knee.', source=_RENDERED)
    visibility: float = constant(0.6, 'Least visibility of a toe or heel.', source=_RENDERED)
    tip: float = constant(0.1, "The tip of the big toe is farther from the heel than the network's toe, by this share.",
                          source=_RENDERED)
    interval: float = constant(
        0.1, 'Time in which the network does not look at the feet of a followed person again.', unit='s')
    share: float = constant(0.34, 'Share of the followed people whose feet it looks at in an image, rounded up.')
    oldest: float = constant(0.2, 'Feet that it does not look at move with their ankles for this long.', unit='s')
    carried: float = constant(0.5, 'Factor on their scores.')


FEET = FeetConstants()


class SeenFeet(NamedTuple):
    """Toes and heels of a person when the network looked."""

    offsets: np.ndarray  # (2, 2, 3) x, y [px] of toe and heel from the network's ankle, score; left first; NaN, NaN, 0
    stamp: float  # [s]

    def on(self, pose: np.ndarray, factor: float = 1.0) -> np.ndarray:
        """Return the toes and heels (2, 2, 3) on the ankles of a pose with the joints of BODY_25, (25, 3)."""
        ankles = pose[[BODY_25.index[ankle] for ankle, _ in _LEGS], :2]
        feet = np.concatenate([self.offsets[..., :2] + ankles[:, None], factor * self.offsets[..., 2:]], axis=2)
        return np.where(np.isfinite(feet).all(axis=2, keepdims=True), feet, (np.nan, np.nan, 0))


class FeetLook(NamedTuple):
    """People after a look at their feet."""

    people: People2D  # P of them with the joints of BODY_25
    feet: List[Optional[SeenFeet]]  # of each; None: without the network
    looked: int  # how many the network saw


def look_at_feet(network: BodyLandmarkNetwork, bgr: np.ndarray, people: People2D, known: Sequence[Optional[SeenFeet]],
                 stamp: float, hurried: bool = False) -> FeetLook:
    """Return people with toes and heels.

    Args:
        bgr: (H, W, 3) uint8 BGR.
        people: in it, with the joints of BODY_25.
        known: of each of the P people, what was seen before; None: nothing.
        stamp: of the image [s]; 0 or less: unknown.
        hurried: there is time for new people alone.
    """
    new, followed = _due(known, stamp)
    due = new if hurried else [*new, *followed]
    found = dict(zip(due, network.observe(bgr, people.keypoints, BODY_25, due)))
    keypoints, sizes = people.keypoints.copy(), person_sizes(people.xy)
    feet: List[Optional[SeenFeet]] = []
    for i, pose in enumerate(keypoints):
        one = known[i]
        if i in found or one is None:
            one = SeenFeet(feet_of(found[i], pose, sizes[i]), stamp)
        feet.append(one)
        if stamp - one.stamp > FEET.oldest:
            continue
        places = one.on(pose, 1.0 if i in found else FEET.carried)
        inside = ((places[..., :2] >= 0) & (places[..., :2] <= np.subtract(bgr.shape[1::-1], 1))).all(axis=2)
        pose[[BODY_25.index[name] for name in np.array(_PARTS)[inside]]] = places[inside]
    return FeetLook(replace(people, keypoints=keypoints), feet, len(due))


def _due(known: Sequence[Optional[SeenFeet]], stamp: float, constants: FeetConstants = FEET
         ) -> Tuple[List[int], List[int]]:
    """Return the people whose feet are looked at: all new ones, and of followed ones those that wait longest."""
    ages = [np.inf if seen is None or stamp <= seen.stamp else stamp - seen.stamp for seen in known]
    most = math.ceil(constants.share * len(known))
    followed = sorted((i for i, age in enumerate(ages) if constants.interval <= age < np.inf), key=lambda i: -ages[i])
    return [i for i, age in enumerate(ages) if np.isinf(age)], followed[:most]


def feet_of(seen: Optional[BodyLandmarks], pose: np.ndarray, size: float, constants: FeetConstants = FEET
            ) -> np.ndarray:
    """Return toes and heels from the ankles, see `SeenFeet`, where the legs agree with a pose (25, 3).

    From its own ankle, as toe, heel and ankle of the network are too high alike: 15 to 20 mm on rendered people.
    """
    offsets = np.full((2, 2, 3), (np.nan, np.nan, 0))
    if seen is None:
        return offsets
    for foot, parts, leg in zip(offsets, _PARTS, _LEGS):
        ours = pose[[BODY_25.index[joint] for joint in leg]]
        rows, theirs = ([BLAZEPOSE_33.index[name] for name in names] for names in (parts, leg))
        apart = np.linalg.norm(seen.points[theirs] - ours[:, :2], axis=1) / size
        if (apart <= (constants.ankle, constants.knee)).all():
            toe, heel = seen.points[rows]
            places = np.stack([toe + constants.tip * (toe - heel), heel]) - seen.points[theirs[0]]
            scores = np.minimum(seen.visibility[rows], ours[0, 2])
            sure = seen.visibility[rows] >= constants.visibility
            foot[sure] = np.column_stack([places, scores])[sure]
    return offsets

"""How a network looks at hands or faces: where, how often, and which of its answers count."""
import time
from dataclasses import dataclass, replace
from typing import Callable, Dict, Hashable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.landmarks.records import HAND_POINTS, MESH_POINTS
from openpose_ros_pkg.landmarks.regions import Region, region_of_face, region_of_hand
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.models import FACE_LANDMARK, HAND_LANDMARK, Model
from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class LookConstants:
    """How often a network looks at a hand or a face, and which answers count."""

    sure: float = constant(0.8, 'Score from which on a first look needs no second one at the other region.')
    lost: float = constant(0.5, 'Score below which what is followed is looked for anew, by the body.')
    loss: float = constant(0.05, 'A look at the region of the points found counts unless the score falls by more.')
    hand_off: float = constant(0.8, "Greatest distance of a hand's wrist from the wrist of the body.", unit='forearms')
    face_off: float = constant(0.5, "Greatest distance of a face's nose from the nose of the body.", unit='widths')
    same: float = constant(0.3, 'Hands whose points are this near, by the median, are one hand.', unit='hand sizes')
    covered: float = constant(0.5, 'A hand that is lost where the middle of another one is this near is behind it.',
                              unit='hand sizes')
    first_passes: float = constant(2.2, 'Passes of the network that somebody new takes, on average.')
    follow_time: float = constant(0.5, 'A hand or a face that was seen no longer ago is looked for where it was.',
                                  unit='s')
    with_body: float = constant(
        0.75, "Share of the way of the body's wrist or nose by which the region of the last points moves along, as "
              'the body is less exact.')
    drift: float = constant(0.25, 'A second look follows where the region of the points found is shifted by more, in '
                                 'sides, turned by more [rad], or larger or smaller by more (logarithm).')
    retry_time: float = constant(0.1, 'Where nothing was found there is no other look for this long.', unit='s')
    carry_time: float = constant(
        0.5, 'What is behind another hand, or for which there is no time, is carried along with the wrist or nose for '
             'this long, its score falling to 0 until then.', unit='s')
    pace_share: float = constant(0.2, 'Share of the newest measurement in the time that a pass takes.')


LOOK = LookConstants()


class Kind(NamedTuple):
    """What a network sees: hands or faces.

    Attributes:
        model: of the network.
        points: number of points that it gives, and of coordinates of each.
        anchor: the point that is a joint of the body: the wrist, or the tip of the nose.
        off: greatest distance of the two, in sizes of the target.
        region: of the points, (N, 2) [px].
    """

    model: Model
    points: int
    anchor: int
    off: float
    region: Callable[[np.ndarray], Region]


HAND = Kind(HAND_LANDMARK, HAND_POINTS, 0, LOOK.hand_off, region_of_hand)
FACE = Kind(FACE_LANDMARK, MESH_POINTS, 4, LOOK.face_off, region_of_face)


@dataclass(frozen=True, eq=False)
class Target:
    """A hand or a face that a body has.

    Attributes:
        person: number of the person in the image.
        name: under which it is remembered: id of the person and which of its parts; None where the id is not known.
        anchor: (2,) the wrist or the nose of the body [px].
        size: length of the forearm, or width of the face [px].
        regions: where it is looked for, the likeliest first.
        left: whether it is a left hand.
    """

    person: int
    name: Optional[Hashable]
    anchor: np.ndarray
    size: float
    regions: Tuple[Region, ...]
    left: bool = False


@dataclass(frozen=True)
class Seen:
    """What a network gave for a hand or a face.

    Attributes:
        points: (N, 3) float64: x, y [px of the image]; z as the network gives it, on the same scale.
        score: how sure the network is that it sees one [0..1].
        right: how sure it is that it is a right hand [0..1]; NaN for faces.
        anchor: of the target then [px].
        stamp: [s].
    """

    points: np.ndarray
    score: float
    right: float
    anchor: np.ndarray
    stamp: float

    def carried(self, target: Target, stamp: float) -> Optional['Seen']:
        """Return what is left of it at a later time without a look; None: nothing."""
        left = 1 - (stamp - self.stamp) / LOOK.carry_time
        if left <= 0:
            return None
        points = self.points.copy()
        points[:, :2] += target.anchor - self.anchor
        return replace(self, points=points, score=self.score * left)


class Looker:
    """A network of hands or faces, and what it takes; not thread-safe."""

    def __init__(self, kind: Kind, network: Backend) -> None:
        self.kind = kind
        self._network = network
        self.seconds = 0.0  # that a pass takes

    def warm_up(self) -> None:
        """Let the network see blank crops: several are computed side by side, by one that is compiled for it."""
        blank = np.zeros((8, 8, 3), np.uint8)
        for count in (1, 2, 2):
            self._pass(blank, [Region(4, 4, 8)] * count)

    def cost(self, known: bool) -> float:
        """Return what a look will take [s], at what is followed or at something new."""
        return self.seconds * (1.0 if known else LOOK.first_passes)

    def look(self, bgr: np.ndarray, targets: Sequence[Target], known: Dict[int, Seen], stamp: float
             ) -> List[Optional[Seen]]:
        """Look at targets, all side by side; None where nothing is found.

        Args:
            bgr: (H, W, 3) uint8.
            known: what was seen of them before, by their numbers.
        """
        results: List[Optional[Seen]] = [None] * len(targets)

        def update(regions: Dict[int, Region], allowed_loss: float) -> None:
            numbers = list(regions)
            for i, (points, score, right) in zip(numbers, self._pass(bgr, [regions[i] for i in numbers])):
                target, before = targets[i], results[i]
                apart = np.linalg.norm(points[self.kind.anchor, :2] - target.anchor)
                if apart > self.kind.off * target.size:
                    continue
                if before is None or score > before.score - allowed_loss:
                    results[i] = Seen(points, score, right, target.anchor, stamp)

        first = {i: self.kind.region(seen.points[:, :2]).moved(LOOK.with_body * (targets[i].anchor - seen.anchor))
                 for i, seen in known.items()}
        update(first, 0.0)
        lost = [i for i, seen in enumerate(results) if seen is None or seen.score < LOOK.lost]
        results = [None if i in lost else seen for i, seen in enumerate(results)]
        for choice in (0, 1):
            update({i: targets[i].regions[choice] for i in lost if len(targets[i].regions) > choice
                    and _score(results[i]) < LOOK.sure}, 0.0)
        update({i: self.kind.region(seen.points[:, :2]) for i, seen in enumerate(results)
                if seen is not None and seen.score >= LOOK.lost
                and (i in lost or self._drifted(first[i], seen.points[:, :2]))}, LOOK.loss)
        return results

    def _drifted(self, region: Region, points: np.ndarray) -> bool:
        """Return whether points, (N, 2), lie otherwise in the region than those lie that it is made of."""
        now = self.kind.region(points)
        apart = np.hypot(now.x - region.x, now.y - region.y) / region.side
        turned = abs((now.angle - region.angle + np.pi) % (2 * np.pi) - np.pi)
        return bool(max(apart, abs(np.log(now.side / region.side)), turned) > LOOK.drift)

    def _pass(self, bgr: np.ndarray, regions: Sequence[Region]) -> List[Tuple[np.ndarray, float, float]]:
        """Return points in the image, score and share of right hands that the network sees in regions."""
        if not regions:
            return []
        side, _ = self.kind.model.input.fixed_size or (0, 0)
        begin = time.perf_counter()
        outputs = self._network.infer_many([region.crop(bgr, side)[np.newaxis] for region in regions])
        seconds = (time.perf_counter() - begin) / len(regions)
        self.seconds = seconds if self.seconds == 0 else (
            LOOK.pace_share * seconds + (1 - LOOK.pace_share) * self.seconds)
        return [self._decoded(output, region, side) for output, region in zip(outputs, regions)]

    def _decoded(self, output: Tuple[np.ndarray, ...], region: Region, side: int) -> Tuple[np.ndarray, float, float]:
        points = output[0].reshape(self.kind.points, 3).astype(np.float64)
        points[:, :2] = region.to_image(points[:, :2] - 0.5, side)
        points[:, 2] *= region.side / side
        score = float(output[1].reshape(()))
        if len(output) < 3:  # the graph of faces ends before the logistic function
            return points, float(1 / (1 + np.exp(-score))), float('nan')
        return points, score, float(output[2].reshape(()))


def _score(seen: Optional[Seen]) -> float:
    return seen.score if seen is not None else 0.0

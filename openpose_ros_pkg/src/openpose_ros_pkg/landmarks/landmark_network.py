"""A network for hands or faces: on which crops it runs, how often, and which of its results count."""
import time
from dataclasses import dataclass, replace
from typing import Callable, Dict, Hashable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.landmarks.records import HAND_POINTS, MESH_POINTS
from openpose_ros_pkg.landmarks.regions import Region, region_of_face, region_of_hand
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.networks.model_registry import FACE_LANDMARK, HAND_LANDMARK
from openpose_ros_pkg.networks.model_types import Model
from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class LandmarkConstants:
    """How often a network runs for a hand or a face, and which results count."""

    lost: float = constant(0.5, 'Score below which a hand or a face is searched in the next region; a followed one '
                                'anew, by the body.')
    least_hand: float = constant(
        20.0, 'Smaller hands, by the size of the body, are not looked at: of 10 to 14 px, 8 of 10 were not found.',
        unit='px')
    least_face: float = constant(
        24.0, 'Narrower faces, by the places of eyes, ears and nose, are not looked at.', unit='px')
    accepted: float = constant(0.5, 'Hands and faces of which the network is less sure are left out.')
    off: float = constant(0.6, "Greatest distance of a hand's wrist, or a face's nose, from that of the body.",
                          unit='forearms, or widths of the face')
    same: float = constant(0.4, 'Hands whose points are this near, by the median, are one hand; one that is lost where '
                                'the middle of another one is this near is behind it.', unit='hand sizes')
    follow_time: float = constant(
        0.5, 'A hand or a face that was found no longer ago is searched where it was. Behind another hand, or without '
             'a run for want of time, it moves with the wrist or nose; its score falls to 0 until then.', unit='s')
    with_body: float = constant(
        0.75, "Share of the motion of the body's wrist or nose that the region of the last points follows, as the body "
              'is less exact.')
    drift: float = constant(0.25, 'A second run follows where the region of the points found is shifted by more, in '
                                 'sides, turned by more [rad], or larger or smaller by more (logarithm).')
    half_presence: float = constant(
        0.3, 'Mean score of the points of a network for whole bodies that counts like 0.5 of the networks for hands '
             'and faces: from here on its points are shown.', source='mmpose 1.3.2, kpt_thr of its inferencers')
    retry_time: float = constant(0.1, 'After a run without a result there is no other one for this long.', unit='s')


LANDMARKS = LandmarkConstants()


class Kind(NamedTuple):
    """What a network finds: hands or faces."""

    model: Model  # of the network
    points: int  # number of points that it gives, and of coordinates of each
    anchor: int  # the point that is a joint of the body: the wrist, or the tip of the nose
    region: Callable[[np.ndarray], Region]  # of the points, (N, 2) [px]


HAND = Kind(HAND_LANDMARK, HAND_POINTS, 0, region_of_hand)
FACE = Kind(FACE_LANDMARK, MESH_POINTS, 4, region_of_face)


@dataclass(frozen=True, eq=False)
class Target:
    """A hand or a face that a body has."""

    person: int  # number of the person in the image
    # under which it is remembered: id of the person and which of its parts; None where the id is not known
    name: Optional[Hashable]
    anchor: np.ndarray  # (2,) the wrist or the nose of the body [px]
    size: float  # length of the forearm, or width of the face [px]
    regions: Tuple[Region, ...]  # where it is searched, the likeliest first
    left: bool = False  # whether it is a left hand


@dataclass(frozen=True)
class LandmarkObservation:
    """A hand or a face as a network found it."""

    points: np.ndarray  # (N, 3) float64: x, y [px of the image]; z as the network gives it, on the same scale
    score: float  # of the hand or face [0..1]
    right: float  # score of a right hand [0..1]; NaN for faces
    anchor: np.ndarray  # of the target then [px]
    stamp: float  # [s]
    scores: Optional[np.ndarray] = None  # (N,) of the points [0..1], 0 where missing; None: all have that of the whole

    def carried(self, target: Target, stamp: float, constants: LandmarkConstants) -> Optional['LandmarkObservation']:
        """Return the observation moved with the body to a later time; None: it is too old."""
        left = 1 - (stamp - self.stamp) / constants.follow_time
        if left <= 0:
            return None
        points = self.points.copy()
        points[:, :2] += target.anchor - self.anchor
        scores = None if self.scores is None else self.scores * left
        return replace(self, points=points, score=self.score * left, scores=scores)

    @property
    def keypoints(self) -> np.ndarray:
        """(N, 3) x, y [px of the image] and score of the points; NaN, NaN, 0 where missing."""
        scores = np.full(len(self.points), self.score) if self.scores is None else self.scores
        return np.column_stack([np.where(scores[:, np.newaxis] > 0, self.points[:, :2], np.nan), scores])


class LandmarkNetwork:
    """A network for hands or faces, and its measured time, `seconds` of a run; not thread-safe."""

    def __init__(self, kind: Kind, network: Backend, constants: LandmarkConstants = LANDMARKS) -> None:
        self.kind, self.seconds = kind, 0.0
        self._network, self._constants = network, constants

    def warm_up(self) -> None:
        """Run the network on blank crops: several are computed side by side, by one that is compiled for it."""
        blank = np.zeros((8, 8, 3), np.uint8)
        for count in (1, 2, 2):
            self._pass(blank, [Region(4, 4, 8)] * count)

    def cost(self, target: Target, known: bool) -> float:
        """Return the expected time [s] for a followed or a new hand or face."""
        return self.seconds * (1 if known else 1 + len(target.regions))

    def observe(self, bgr: np.ndarray, targets: Sequence[Target], known: Dict[int, LandmarkObservation], stamp: float
                ) -> List[Optional[LandmarkObservation]]:
        """Return the observations of targets, all computed side by side; None: not found; `known` are earlier ones."""
        constants = self._constants
        nothing: List[Optional[LandmarkObservation]] = [None] * len(targets)
        first = {i: self.kind.region(seen.points[:, :2]).moved(
            constants.with_body * (targets[i].anchor - seen.anchor)) for i, seen in known.items()}
        results = self._better(bgr, targets, nothing, first, stamp)
        lost = [i for i, seen in enumerate(results) if seen is None or seen.score < constants.lost]
        results = [None if i in lost else seen for i, seen in enumerate(results)]
        for choice in (0, 1):
            regions = {i: targets[i].regions[choice] for i in lost if len(targets[i].regions) > choice
                       and _score(results[i]) < constants.lost}
            results = self._better(bgr, targets, results, regions, stamp)
        again = {i: self.kind.region(seen.points[:, :2]) for i, seen in enumerate(results)
                 if seen is not None and seen.score >= constants.lost
                 and (i in lost or self._drifted(first[i], seen.points[:, :2]))}
        # points of a region that fits are better, with any score that counts
        return self._better(bgr, targets, results, again, stamp, constants.lost)

    def _better(self, bgr: np.ndarray, targets: Sequence[Target], before: Sequence[Optional[LandmarkObservation]],
                regions: Dict[int, Region], stamp: float, enough: float = 1.0
                ) -> List[Optional[LandmarkObservation]]:
        """Return the better ones of observations and of a run at regions, by the numbers of the targets.

        Args:
            enough: score from which on the run is the better one, whatever the score before.
        """
        results = list(before)
        for i, (points, score, right) in zip(regions, self._pass(bgr, list(regions.values()))):
            target, known = targets[i], before[i]
            apart = np.linalg.norm(points[self.kind.anchor, :2] - target.anchor)
            if apart <= self._constants.off * target.size and (known is None or score > min(known.score, enough)):
                results[i] = LandmarkObservation(points, score, right, target.anchor, stamp)
        return results

    def _drifted(self, region: Region, points: np.ndarray) -> bool:
        """Return whether the region of points, (N, 2), differs from the one where they were found."""
        now = self.kind.region(points)
        apart = np.hypot(now.x - region.x, now.y - region.y) / region.side
        turned = abs((now.angle - region.angle + np.pi) % (2 * np.pi) - np.pi)
        return bool(max(apart, abs(np.log(now.side / region.side)), turned) > self._constants.drift)

    def _pass(self, bgr: np.ndarray, regions: Sequence[Region]) -> List[Tuple[np.ndarray, float, float]]:
        """Return points in the image, score and score of a right hand for each region."""
        if not regions:
            return []
        side, _ = self.kind.model.input.fixed_size or (0, 0)
        begin = time.perf_counter()
        outputs = self._network.infer_many([region.crop(bgr, side)[np.newaxis] for region in regions])
        seconds = (time.perf_counter() - begin) / len(regions)
        self.seconds = seconds if self.seconds == 0 else (seconds + self.seconds) / 2
        return [self._decoded(output, region, side) for output, region in zip(outputs, regions)]

    def _decoded(self, output: Tuple[np.ndarray, ...], region: Region, side: int) -> Tuple[np.ndarray, float, float]:
        points = output[0].reshape(self.kind.points, 3).astype(np.float64)
        points[:, :2] = region.to_image(points[:, :2] - 0.5, side)
        points[:, 2] *= region.side / side
        score = float(output[1].reshape(()))
        if len(output) < 3:  # the graph of faces ends before the logistic function
            return points, float(1 / (1 + np.exp(-score))), float('nan')
        return points, score, float(output[2].reshape(()))


def _score(seen: Optional[LandmarkObservation]) -> float:
    return seen.score if seen is not None else 0.0

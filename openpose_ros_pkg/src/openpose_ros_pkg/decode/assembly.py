"""Greedy assembly of limbs into people."""
from typing import Dict, List, Tuple

import numpy as np

from openpose_ros_pkg.decode.limbs import LimbCandidates
from openpose_ros_pkg.decode.peaks import Peaks
from openpose_ros_pkg.skeletons import SkeletonModel


class _Person:
    """A person in the making: the peak of each joint, and number and sum of its limbs' scores."""

    def __init__(self) -> None:
        self.peaks: Dict[int, int] = {}
        self.limb_scores = 0.0
        self.limbs = 0

    def add_limb(self, score: float) -> None:
        """Count a limb, unless it is foreshortened and says nothing about the person."""
        self.limb_scores += score
        self.limbs += score > 0


def assemble(peaks: Peaks, limbs: LimbCandidates, skeleton: SkeletonModel, min_joints: int,
             min_score: float) -> Tuple[np.ndarray, np.ndarray]:
    """Match limbs greedily, the best first, and merge those that share a joint into people.

    A person's score is the mean of the scores of its joints and limbs.

    Args:
        min_joints: joints that a person needs.
        min_score: score that a person needs [0..1].

    Returns:
        keypoints: (P, K, 3) float32, NaN, NaN, 0 where missing; the surest person first.
        scores: (P,) float32 [0..1].
    """
    people = _merge(_match(limbs, peaks), peaks, skeleton)
    joint_scores = peaks.score.tolist()
    scored = []
    for person in people:
        total = person.limb_scores
        for peak in person.peaks.values():  # not sum(), which rounds otherwise since Python 3.12
            total += joint_scores[peak]
        score = min(total / (len(person.peaks) + person.limbs), 1.0)
        if len(person.peaks) >= min_joints and score >= min_score:
            scored.append((score, person))
    scored.sort(key=lambda pair: -pair[0])

    keypoints = np.full((len(scored), len(skeleton.joints), 3), np.nan, np.float32)
    keypoints[..., 2] = 0
    for row, (_, person) in zip(keypoints, scored):
        joints, chosen = list(person.peaks.keys()), list(person.peaks.values())
        row[joints, :2] = peaks.xy[chosen]
        row[joints, 2] = peaks.score[chosen]
    return keypoints, np.array([score for score, _ in scored], np.float32)


def _match(limbs: LimbCandidates, peaks: Peaks) -> List[Tuple[int, int, int, float]]:
    """Return (limb, start, end, score) of the limbs that win: each peak is used once per kind of limb."""
    # Peaks count as well as fields: else a speck of noise beside a limb's end takes it from the true joint.
    priority = limbs.score + 0.5 * (peaks.score[limbs.start] + peaks.score[limbs.end])
    # Limbs for which nearness alone speaks come last: they only add to people whom others have started.
    order = np.lexsort((-priority, limbs.limb, limbs.score <= 0))
    used = set()
    matched = []
    for limb, start, end, score in zip(limbs.limb[order].tolist(), limbs.start[order].tolist(),
                                       limbs.end[order].tolist(), limbs.score[order].tolist()):
        if (limb, start) not in used and (limb, end) not in used:
            used.update(((limb, start), (limb, end)))
            matched.append((limb, start, end, score))
    return matched


def _merge(matched: List[Tuple[int, int, int, float]], peaks: Peaks, skeleton: SkeletonModel) -> List[_Person]:
    """Merge limbs into people; each peak belongs to one person at most."""
    joint = peaks.joint.tolist()
    owner: Dict[int, _Person] = {}
    for limb, start, end, score in matched:
        first, second = owner.get(start), owner.get(end)
        if first is None and second is None:
            if not skeleton.limbs[limb].starts_person or score <= 0:
                continue
            person = _Person()
        elif first is None or second is None or first is second:
            person = first if first is not None else second
        elif first.peaks.keys() & second.peaks.keys():
            continue  # two people who touch: they stay apart
        else:
            person = first
            person.limb_scores += second.limb_scores
            person.limbs += second.limbs
            person.peaks.update(second.peaks)
            owner.update((peak, person) for peak in second.peaks.values())
        if any(person.peaks.get(joint[peak], peak) != peak for peak in (start, end)):
            continue  # the person has this joint elsewhere already
        for peak in (start, end):
            person.peaks[joint[peak]] = peak
            owner[peak] = person
        person.add_limb(score)
    return list({id(person): person for person in owner.values()}.values())

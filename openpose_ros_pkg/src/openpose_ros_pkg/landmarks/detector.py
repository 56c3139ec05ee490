"""Hands and faces of the people in images, followed from image to image."""
import logging
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, Hashable, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.detect.tracking import TRACKING, PerCamera
from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.landmarks.face_points import face_points
from openpose_ros_pkg.landmarks.landmark_network import (
    FACE,
    HAND,
    LANDMARKS,
    Kind,
    LandmarkConstants,
    LandmarkNetwork,
    LandmarkObservation,
    Target,
)
from openpose_ros_pkg.landmarks.records import Faces2D, Hands2D, LandmarkParams, Landmarks2D
from openpose_ros_pkg.landmarks.regions import HAND_REGION, face_regions, face_width, forearm_length, hand_regions
from openpose_ros_pkg.landmarks.whole_body import WholeBodyLandmarks
from openpose_ros_pkg.networks.backends import Backend, BackendParams, create_backend
from openpose_ros_pkg.networks.models import weights_path
from openpose_ros_pkg.people import FIRST_ID, People2D, no_points

_log = logging.getLogger(__name__)

# Loads the network of a kind.
LoadNetwork = Callable[[Kind], Backend]
Found = List[Tuple[Target, LandmarkObservation]]
Source = Any  # LandmarkNetwork or WholeBodyLandmarks


@dataclass(frozen=True)
class LandmarkMemory:
    """The hands and faces in the images of one size of a camera, by the names of targets; each frame replaces it."""

    observed: Mapping[Hashable, LandmarkObservation] = field(default_factory=dict)  # the newest
    tried: Mapping[Hashable, float] = field(default_factory=dict)  # when a network ran for each [s]

    def recent(self, stamp: float, constants: LandmarkConstants) -> 'LandmarkMemory':
        """Return what is not too old to be followed; nothing where stamps jump back."""
        def holds(then: float) -> bool:
            return -TRACKING.reset_backstep <= stamp - then <= constants.follow_time
        return LandmarkMemory({name: one for name, one in self.observed.items() if holds(one.stamp)},
                              {name: tried for name, tried in self.tried.items() if holds(tried)})

    def waits(self, target: Target, stamp: float, constants: LandmarkConstants) -> bool:
        """Return whether a run for a target had no result just now."""
        since = stamp - self.tried.get(target.name, -np.inf)
        return target.name not in self.observed and 0 < since < constants.retry_time

    def after(self, tasks: Sequence['_Task'], found: Mapping[Target, LandmarkObservation], behind: Sequence[Target],
              stamp: float) -> 'LandmarkMemory':
        """Return the memory after runs for tasks; targets behind another hand keep their last observation."""
        names = [task.target.name for task in tasks if task.target.name is not None]
        gone = {task.target.name for task in tasks if task.target not in found and task.target not in behind}
        seen = {target.name: one for target, one in found.items() if target.name is not None}
        return LandmarkMemory({**{name: one for name, one in self.observed.items() if name not in gone}, **seen},
                              {**self.tried, **dict.fromkeys(names, stamp)})


class _Task(NamedTuple):
    """One target, what finds it, and the last observation."""

    source: Source
    target: Target
    known: Optional[LandmarkObservation]

    def carried(self, stamp: float, constants: LandmarkConstants) -> Optional[LandmarkObservation]:
        return None if self.known is None else self.known.carried(self.target, stamp, constants)


class LandmarkDetector:
    """Find hands and faces of people whose bodies are known; one thread at a time uses it.

    A hand or a face is searched by the body. Then it is followed: in the next image it is searched where it was. Where
    a network for whole bodies has found the points of people, they are taken from these: no other network runs.

    Args:
        params: what is searched, and thresholds.
        load: loads the networks. One that is missing is a lasting fault; the other works on.
        whole_body: the people have points, so that no network is loaded.
    """

    def __init__(self, params: LandmarkParams, load: LoadNetwork, constants: LandmarkConstants = LANDMARKS,
                 whole_body: bool = False) -> None:
        self._params, self._load, self._constants, self._whole_body = params, load, constants, whole_body
        self._networks: Dict[Kind, LandmarkNetwork] = {}
        self._faults: Dict[Kind, str] = {}
        self._memories = PerCamera(LandmarkMemory)
        self.reconfigure(params)

    @property
    def faults(self) -> str:
        """What is missing or computed by something slower than the parameters ask for, and why; empty: nothing."""
        return '; '.join(list(self._faults.values()))

    @property
    def missing(self) -> bool:
        """Whether a network is missing that the parameters ask for; `faults` tells why."""
        return not self._whole_body and any(kind not in self._networks for kind in _kinds(self._params))

    def reconfigure(self, params: LandmarkParams) -> None:
        """Take other parameters from the next image on; a network that is wanted now is loaded."""
        for kind in () if self._whole_body else _kinds(params):
            if kind not in self._networks:
                self._add(kind)
        self._params = params

    def warm_up(self) -> None:
        """Run the networks on blank crops: the first image then takes no longer than the others."""
        for network in self._networks.values():
            network.warm_up()

    def detect(self, bgr: np.ndarray, people: People2D, hidden: Optional[np.ndarray], camera: Hashable, stamp: float,
               seconds: Optional[float] = None) -> Landmarks2D:
        """Return the hands and faces of the people in an image.

        Args:
            bgr: (H, W, 3) uint8 BGR; not modified.
            people: in the image, with their ids; people without an id are not followed.
            hidden: (P, K) bool: hidden joints, whose hands and faces are left out; None: unknown.
            camera: tells the cameras apart.
            stamp: of the image [s]; 0 or less: unknown, so nothing is followed.
            seconds: for the networks, longest wait first, one run in any case; others move with the body for a moment,
                then are left out. None: any time.
        """
        params, constants, bodies = self._params, self._constants, people.points
        if bodies is None and self._whole_body:  # no person was seen by it in this image
            bodies = no_points(len(people))
        # without a stamp there is no history; places in images of another size are other places
        key = (camera, bgr.shape[:2])
        memory = self._memories.of(key).recent(stamp, constants) if stamp > 0 else LandmarkMemory()
        sources: Dict[Kind, Source] = dict(self._networks) if bodies is None else {
            kind: WholeBodyLandmarks(kind, bodies, constants) for kind in _kinds(params)}
        tasks = [_Task(sources[kind], target, memory.observed.get(target.name))
                 for kind, target in _targets(people, hidden, params, constants) if kind in sources]
        if bodies is None:
            tasks = [task for task in tasks if not memory.waits(task.target, stamp, constants)]
            tasks.sort(key=lambda task: memory.tried.get(task.target.name, -np.inf))
            count = _affordable(tasks, seconds)
        else:  # first those of people seen in this image
            there = bodies[..., 2].any(axis=1)
            tasks.sort(key=lambda task: not there[task.target.person])
            count = sum(bool(there[task.target.person]) for task in tasks)
        found = {kind: _carried(tasks[count:], kind, stamp, constants) for kind in (HAND, FACE)}
        for kind, source in sources.items():
            chosen = [task for task in tasks[:count] if task.source is source]
            more, behind = _observed(source, bgr, chosen, stamp, constants)
            memory = memory.after(chosen, dict(more), behind, stamp)
            found[kind] += more + _carried([task for task in chosen if task.target in behind], kind, stamp,
                                           constants)
        if stamp > 0:
            self._memories.put(key, memory)
        return Landmarks2D(_hands(_accepted(found[HAND], constants.accepted, stamp), people),
                           _faces(_accepted(found[FACE], constants.accepted, stamp), people))

    def _add(self, kind: Kind) -> None:
        name = kind.model.name
        try:
            network = self._load(kind)
        except (ModelError, ParameterError) as error:
            part = 'hands' if kind is HAND else 'faces'
            self._faults[kind] = f'{name} is missing, so {part} are not found: {error}'
            _log.warning('%s', self._faults[kind])
            return
        self._faults.pop(kind, None)
        if network.fallback:
            self._faults[kind] = f'{network.description} computes {name}: {network.fallback}'
        self._networks[kind] = LandmarkNetwork(kind, network, self._constants)


def create_landmark_detector(params: LandmarkParams, backend: BackendParams, model_folder: str = '',
                             whole_body: bool = False) -> LandmarkDetector:
    """Return a detector that loads its networks from a model folder; an empty one is the default."""
    def load(kind: Kind) -> Backend:
        return create_backend(kind.model, weights_path(kind.model, model_folder), backend)

    return LandmarkDetector(params, load, whole_body=whole_body)


def _kinds(params: LandmarkParams) -> List[Kind]:
    return [kind for kind, wanted in ((HAND, params.hands), (FACE, params.face)) if wanted]


def _targets(people: People2D, hidden: Optional[np.ndarray], params: LandmarkParams,
             constants: LandmarkConstants) -> Iterator[Tuple[Kind, Target]]:
    """Yield the hands and faces that are large enough and not hidden."""
    index, there = people.skeleton.index, people.present
    for i in range(len(people)):
        joints = {name: people.xy[i, k].astype(np.float64) for name, k in index.items() if there[i, k]}
        shown = {name for name in joints if hidden is None or not hidden[i, index[name]]}
        number = int(people.ids[i])
        for side in ('left', 'right') if params.hands else ():
            wrist, length = f'{side}_wrist', forearm_length(joints, side)
            if wrist in shown and HAND_REGION.hand * length >= constants.least_hand:
                regions = hand_regions(joints[wrist], joints.get(f'{side}_elbow'), length)
                yield HAND, Target(i, (number, side) if number >= FIRST_ID else None, joints[wrist], length, regions,
                                   side == 'left')
        width = face_width(joints)
        if params.face and 'nose' in shown and width >= constants.least_face:
            yield FACE, Target(i, (number, 'face') if number >= FIRST_ID else None, joints['nose'], width,
                               face_regions(joints, width))


def _affordable(tasks: Sequence[_Task], seconds: Optional[float]) -> int:
    """Return for how many tasks, from the first on, there is time: one at least."""
    if seconds is None:
        return len(tasks)
    costs = np.cumsum([task.source.cost(task.target, task.known is not None) for task in tasks])
    return max(int((costs <= seconds).sum()), min(len(tasks), 1))


def _carried(tasks: Sequence[_Task], kind: Kind, stamp: float, constants: LandmarkConstants) -> Found:
    carried = [(task.target, task.carried(stamp, constants)) for task in tasks if task.source.kind is kind]
    return [(target, seen) for target, seen in carried if seen is not None]


def _observed(source: Source, bgr: np.ndarray, tasks: Sequence[_Task], stamp: float,
              constants: LandmarkConstants) -> Tuple[Found, List[Target]]:
    """Return what a source finds, and the hands that are behind another one."""
    known = {i: task.known for i, task in enumerate(tasks) if task.known is not None}
    results = source.observe(bgr, [task.target for task in tasks], known, stamp)
    found = [(task.target, seen) for task, seen in zip(tasks, results)
             if seen is not None and seen.score >= constants.lost]
    if source.kind is not HAND:
        return found, []
    behind = _doubles(found, constants.same)
    found = [one for one in found if one[0] not in behind]
    visible = {target for target, _ in found}
    return found, behind + [task.target for task in tasks if task.target not in visible
                            and _covered(task, found, stamp, constants)]


def _doubles(hands: Found, same: float) -> List[Target]:
    """Return the hands that lie on a likelier one: they may be behind it.

    Less likely are hands whose side the network denies, and those whose wrist is far from that of the body.
    """
    kept: Found = []
    doubles: Found = []
    for hand in sorted(hands, key=lambda one: -_likelihood(one)):
        (doubles if any(_coincide(hand[1], other[1], same) for other in kept) else kept).append(hand)
    return [target for target, _ in doubles]


def _covered(task: _Task, hands: Found, stamp: float, constants: LandmarkConstants) -> bool:
    """Return whether a followed hand is now at the place of another one."""
    carried = task.carried(stamp, constants)
    return carried is not None and any(
        np.linalg.norm(np.mean(carried.points - hand.points, axis=0)[:2]) < constants.same * _size(hand)
        for _, hand in hands)


def _size(hand: LandmarkObservation) -> float:
    return float(np.ptp(hand.points[:, :2], axis=0).max())


def _coincide(one: LandmarkObservation, other: LandmarkObservation, same: float) -> bool:
    size = max(_size(one), _size(other))
    return bool(np.median(np.linalg.norm(one.points[:, :2] - other.points[:, :2], axis=1)) < same * size)


def _likelihood(hand: Tuple[Target, LandmarkObservation]) -> float:
    target, seen = hand
    side = 1 - seen.right if target.left else seen.right
    return side - float(np.linalg.norm(seen.points[HAND.anchor, :2] - target.anchor)) / target.size


def _accepted(found: Found, threshold: float, stamp: float) -> Found:
    """Return what is sure enough, in the order of the people; what moves with the body was so when it was found."""
    sure = [one for one in found if one[1].score >= threshold or one[1].stamp < stamp]
    return sorted(sure, key=lambda one: (one[0].person, not one[0].left))


def _hands(found: Found, people: People2D) -> Hands2D:
    if not found:
        return Hands2D.empty()
    return Hands2D(np.array([seen.keypoints for _, seen in found]), np.array([seen.score for _, seen in found]),
                   people.ids[[target.person for target, _ in found]], np.array([target.left for target, _ in found]))


def _faces(found: Found, people: People2D) -> Faces2D:
    if not found:
        return Faces2D.empty()
    return Faces2D(np.array([face_points(seen.keypoints) for _, seen in found]),
                   np.array([seen.points for _, seen in found]), np.array([seen.score for _, seen in found]),
                   people.ids[[target.person for target, _ in found]])

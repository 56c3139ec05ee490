"""Hands and faces of the people in images, followed from image to image."""
import logging
import threading
from typing import Callable, Dict, Hashable, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.detect.tracking import TRACKING, PerCamera
from openpose_ros_pkg.errors import ModelError, ParameterError
from openpose_ros_pkg.landmarks.face_mesh import face_points
from openpose_ros_pkg.landmarks.looking import FACE, HAND, LOOK, Kind, Looker, Seen, Target
from openpose_ros_pkg.landmarks.params import LandmarkParams
from openpose_ros_pkg.landmarks.records import Faces2D, Hands2D, Landmarks2D
from openpose_ros_pkg.landmarks.regions import HAND_REGION, face_regions, face_width, forearm_length, hand_regions
from openpose_ros_pkg.networks.backends import Backend, BackendParams, create_backend
from openpose_ros_pkg.networks.models import weights_path
from openpose_ros_pkg.people import FIRST_ID, People2D

_log = logging.getLogger(__name__)

# Loads the network of a kind.
LoadNetwork = Callable[[Kind], Backend]
Found = List[Tuple[Target, Seen]]


class _Camera:
    """What was seen in the images of one size of a camera.

    Attributes:
        seen: what was seen, by the names of the targets.
        looked: when each was looked at [s].
    """

    def __init__(self) -> None:
        self.seen: Dict[Hashable, Seen] = {}
        self.looked: Dict[Hashable, float] = {}
        self._shape: Tuple[int, ...] = ()

    def begin(self, stamp: float, shape: Tuple[int, ...]) -> None:
        """Forget what is too old to be followed, and everything where stamps jump back or images have another size."""
        if shape != self._shape:
            self.seen, self.looked, self._shape = {}, {}, shape
        self.looked = {name: looked for name, looked in self.looked.items()
                       if -TRACKING.reset_backstep <= stamp - looked <= LOOK.follow_time}
        self.seen = {name: seen for name, seen in self.seen.items()
                     if -TRACKING.reset_backstep <= stamp - seen.stamp <= LOOK.follow_time}

    def waits(self, target: Target, stamp: float) -> bool:
        """Return whether a target was refused just now."""
        since = stamp - self.looked.get(target.name, -np.inf)
        return target.name not in self.seen and 0 < since < LOOK.retry_time


class _Task(NamedTuple):
    """One target, who looks at it, and what was seen of it before."""

    looker: Looker
    target: Target
    known: Optional[Seen]


class LandmarkDetector:
    """Find hands and faces of people whose bodies are known. Any thread may call it.

    A hand or a face is looked for by the body. Then it is followed: the next image is looked at where its points were.

    Args:
        params: what is looked for, and from which thresholds on.
        load: loads the networks. One that is missing is a lasting fault; the other works on.
    """

    def __init__(self, params: LandmarkParams, load: LoadNetwork) -> None:
        self._params, self._load = params, load
        self._lookers: Dict[Kind, Looker] = {}
        self._faults: Dict[Kind, str] = {}
        self._cameras = PerCamera(_Camera)
        self._lock = threading.Lock()  # the networks compute one image at a time
        self.reconfigure(params)

    @property
    def faults(self) -> str:
        """What is missing or computed by something slower than the parameters ask for, and why; empty: nothing."""
        return '; '.join(list(self._faults.values()))

    @property
    def missing(self) -> bool:
        """Whether a network is missing that the parameters ask for; `faults` tells why."""
        return any(kind not in self._lookers for kind in _kinds(self._params))

    def reconfigure(self, params: LandmarkParams) -> None:
        """Take other parameters from the next image on; a network that is wanted now is loaded."""
        with self._lock:
            for kind in _kinds(params):
                if kind not in self._lookers:
                    self._add(kind)
            self._params = params

    def warm_up(self) -> None:
        """Let the networks see blank crops: the first look then takes no longer than the others."""
        with self._lock:
            for looker in self._lookers.values():
                looker.warm_up()

    def detect(self, bgr: np.ndarray, people: People2D, hidden: Optional[np.ndarray], camera: Hashable, stamp: float,
               seconds: Optional[float] = None) -> Landmarks2D:
        """Return the hands and faces of the people in an image.

        Args:
            bgr: (H, W, 3) uint8 BGR; not modified.
            people: in the image, with their ids; people without an id are not followed.
            hidden: (P, K) bool: joints of which it is known that they are hidden: such a hand or face is left out;
                None: nothing is known.
            camera: whatever tells the cameras apart.
            stamp: of the image [s]; 0 or less: it is not known, so nothing is followed.
            seconds: that this may take; what was looked at longest ago comes first, one in any case. Others are carried
                along for a moment, then left out. None: any time.
        """
        # without a stamp there is no history; places in images of another size are other places
        memory = self._cameras.of((camera, bgr.shape[:2])) if stamp > 0 else _Camera()
        params = self._params
        with self._lock:
            memory.begin(stamp, bgr.shape)
            tasks = [_Task(self._lookers[kind], target, memory.seen.get(target.name))
                     for kind, target in _targets(people, hidden, params)
                     if kind in self._lookers and not memory.waits(target, stamp)]
            tasks.sort(key=lambda task: memory.looked.get(task.target.name, -np.inf))
            count = _affordable(tasks, seconds)
            found = {kind: _carried(tasks[count:], kind, stamp) for kind in (HAND, FACE)}
            for kind, looker in self._lookers.items():
                found[kind] += _look(looker, bgr, [task for task in tasks[:count] if task.looker is looker], memory,
                                     stamp)
        return Landmarks2D(_hands(_accepted(found[HAND], params.hand_threshold, stamp), people),
                           _faces(_accepted(found[FACE], params.face_threshold, stamp), people))

    def _add(self, kind: Kind) -> None:
        """Load a network, or note why it is missing."""
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
        self._lookers[kind] = Looker(kind, network)


def create_landmark_detector(params: LandmarkParams, backend: BackendParams, model_folder: str = ''
                             ) -> LandmarkDetector:
    """Load the networks of hands and faces that the parameters ask for.

    Args:
        backend: what computes them.
        model_folder: folder of the weights; empty for the default one.
    """
    def load(kind: Kind) -> Backend:
        return create_backend(kind.model, weights_path(kind.model, model_folder), backend)

    return LandmarkDetector(params, load)


def _kinds(params: LandmarkParams) -> List[Kind]:
    return [kind for kind, wanted in ((HAND, params.hands), (FACE, params.face)) if wanted]


def _targets(people: People2D, hidden: Optional[np.ndarray], params: LandmarkParams
             ) -> Iterator[Tuple[Kind, Target]]:
    """Yield the hands and faces that are large enough and not hidden."""
    index, there = people.skeleton.index, people.present
    for i in range(len(people)):
        joints = {name: people.xy[i, k].astype(np.float64) for name, k in index.items() if there[i, k]}
        shown = {name for name in joints if hidden is None or not hidden[i, index[name]]}
        number = int(people.ids[i])
        for side in ('left', 'right') if params.hands else ():
            wrist, length = f'{side}_wrist', forearm_length(joints, side)
            if wrist in shown and HAND_REGION.hand * length >= params.least_hand_size:
                regions = hand_regions(joints[wrist], joints.get(f'{side}_elbow'), length)
                yield HAND, Target(i, (number, side) if number >= FIRST_ID else None, joints[wrist], length, regions,
                                   side == 'left')
        width = face_width(joints)
        if params.face and 'nose' in shown and width >= params.least_face_size:
            yield FACE, Target(i, (number, 'face') if number >= FIRST_ID else None, joints['nose'], width,
                               face_regions(joints, width))


def _affordable(tasks: Sequence[_Task], seconds: Optional[float]) -> int:
    """Return how many tasks, from the first on, there is time for: one at least."""
    if seconds is None:
        return len(tasks)
    costs = np.cumsum([task.looker.cost(task.known is not None) for task in tasks])
    return max(int((costs <= seconds).sum()), min(len(tasks), 1))


def _carried(tasks: Sequence[_Task], kind: Kind, stamp: float) -> Found:
    """Return what is left of a kind that is not looked at."""
    carried = [(task.target, task.known.carried(task.target, stamp)) for task in tasks
               if task.known is not None and task.looker.kind is kind]
    return [(target, seen) for target, seen in carried if seen is not None]


def _look(looker: Looker, bgr: np.ndarray, tasks: Sequence[_Task], memory: _Camera, stamp: float) -> Found:
    """Look at targets, and remember what is seen; a hand behind another one is carried along."""
    known = {i: task.known for i, task in enumerate(tasks) if task.known is not None}
    results = looker.look(bgr, [task.target for task in tasks], known, stamp)
    found = [(task.target, seen) for task, seen in zip(tasks, results) if seen is not None and seen.score >= LOOK.lost]
    behind = _doubles(found) if looker.kind is HAND else []
    found = [one for one in found if one[0] not in behind]
    seen_now = dict(found)
    if looker.kind is HAND:
        behind += [task.target for task in tasks
                   if task.target not in seen_now and _covered(task, seen_now.values(), stamp)]
    for target in (task.target for task in tasks if task.target.name is not None):
        memory.looked[target.name] = stamp
        if target in seen_now:
            memory.seen[target.name] = seen_now[target]
        elif target not in behind:
            memory.seen.pop(target.name, None)
    return found + _carried([task for task in tasks if task.target in behind], looker.kind, stamp)


def _doubles(hands: Found) -> List[Target]:
    """Return whose hands lie on another hand, which is theirs less likely: they may be behind it.

    Less likely are hands whose side the network denies, and those whose wrist is far from that of the body.
    """
    kept: Found = []
    doubles: List[Target] = []
    for hand in sorted(hands, key=lambda one: -_likelihood(one)):
        if any(_coincide(hand[1], other[1]) for other in kept):
            doubles.append(hand[0])
        else:
            kept.append(hand)
    return doubles


def _covered(task: _Task, hands: Iterable[Seen], stamp: float) -> bool:
    """Return whether a hand that was followed is now where another one is seen."""
    carried = task.known.carried(task.target, stamp) if task.known is not None else None
    return carried is not None and any(
        np.linalg.norm(np.mean(carried.points - hand.points, axis=0)[:2]) < LOOK.covered * _size(hand)
        for hand in hands)


def _size(hand: Seen) -> float:
    """Return the longer side of the box round the points [px]."""
    return float(np.ptp(hand.points[:, :2], axis=0).max())


def _coincide(one: Seen, other: Seen) -> bool:
    size = max(_size(one), _size(other))
    return bool(np.median(np.linalg.norm(one.points[:, :2] - other.points[:, :2], axis=1)) < LOOK.same * size)


def _likelihood(hand: Tuple[Target, Seen]) -> float:
    target, seen = hand
    side = 1 - seen.right if target.left else seen.right
    return side - float(np.linalg.norm(seen.points[HAND.anchor, :2] - target.anchor)) / target.size


def _accepted(found: Found, threshold: float, stamp: float) -> Found:
    """Return what is sure enough, in the order of the people; what is carried along was so when it was seen."""
    sure = [one for one in found if one[1].score >= threshold or one[1].stamp < stamp]
    return sorted(sure, key=lambda one: (one[0].person, not one[0].left))


def _hands(found: Found, people: People2D) -> Hands2D:
    keypoints = [np.column_stack([seen.points[:, :2], np.full(len(seen.points), seen.score)]) for _, seen in found]
    return Hands2D(np.reshape(keypoints, (-1, HAND.points, 3)), np.array([seen.score for _, seen in found]),
                   np.array([people.ids[target.person] for target, _ in found]),
                   np.array([target.left for target, _ in found]))


def _faces(found: Found, people: People2D) -> Faces2D:
    mesh = np.reshape([seen.points for _, seen in found], (-1, FACE.points, 3))
    scores = np.array([seen.score for _, seen in found])
    keypoints = face_points(mesh)
    keypoints[..., 2] = scores[:, np.newaxis]
    return Faces2D(keypoints, mesh, scores, np.array([people.ids[target.person] for target, _ in found]))

"""Scenes with known joints on which variants run: images, points and truth are read once for all variants."""
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

import chain_runs
import virtual
from ablation_tools.kept import RememberedNetwork
from ablation_tools.parts import IN_DETECTION, SHARED
from ablation_tools.variants import Variant, in_shared, with_values
from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.detect.detection import ImageFrame, Looks
from openpose_ros_pkg.detect.detector import Detector
from openpose_ros_pkg.detect.following import NEVER_FOLLOWED, FollowingParams
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.networks.backends import Backend
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import ExpectedPeople, People2D
from scoring.people import STATISTICS, is_visible, score_people
from skeleton_extract_3d.chain import PeopleChain, Result
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.depth import DepthImage

# Figures of a scene, and their titles.
TITLES = {'persons_recall': 'found', 'persons_precision': 'real', 'visible_100': 'visible', 'hidden_150': 'hidden',
          'lies': 'lies', 'switches': 'switches', 'within_2_sigma': 'in 2 sigma', 'visible_median': 'median [mm]',
          'image_switches': 'switches in the image', 'lost': 'lost', 'ghosts': 'ghosts', 'kept': 'ids kept'}
# Bins of the errors of visible joints: 1 mm wide, the last one open.
_BINS = 300
# In the image, a person is the true one within this median distance, in half diagonals of the true joints.
_SAME_IN_IMAGE = 0.5
# Work of the networks for a frame where people are published before the search, see `chain_runs.Budget`.
BUDGET = 0.5


class RememberedNetworks(chain_runs.CountedNetworks):
    """Networks that compute each input once; as work, each input counts whenever it is given."""

    def __init__(self, settings: ChainSettings) -> None:
        super().__init__(settings.detector.backend, settings.detector.detector.model_folder)
        self.remembered: Dict[str, RememberedNetwork] = {}

    def counted(self, name: str, network: Backend) -> chain_runs.CountedNetwork:
        self.remembered[name] = RememberedNetwork(network)
        return super().counted(name, self.remembered[name])


@dataclass(frozen=True)
class Scene:
    """The frames of a sequence, with and without the floor, and the true joints."""

    folder: Path
    frames: List[Frame]
    on_floor: List[Frame]
    fps: float

    @classmethod
    def read(cls, folder: Path) -> 'Scene':
        sequence = chain_runs.open_sequence(folder)
        poses = chain_runs.camera_poses(folder, sequence)
        moves = not (poses == poses[0]).all()
        frames = [Frame('', chain_runs.BEGIN + one.time, one.bgr, DepthImage(one.depth, sequence.camera),
                        tracking_from_points=(pose[:3, :3], pose[:3, 3]) if moves else None)
                  for one, pose in zip(sequence, poses)]
        return cls(folder, frames, [replace(frame, floor=pose[2]) for frame, pose in zip(frames, poses)],
                   sequence.fps or 1.0)

    def score(self, found: Sequence[People3D]) -> Dict[str, List[float]]:
        """Return the sums of people in space: of shares, of a count, of the median the histogram of errors [mm]."""
        counts = score_people(self.folder, [(frame.stamp - chain_runs.BEGIN, people)
                                            for frame, people in zip(self.frames, found)])
        sums = {name: [float(part(counts)) for part in (STATISTICS[name].top, STATISTICS[name].bottom) if part]
                for name in TITLES if name in STATISTICS and name != 'visible_median'}
        joints = counts.rows['joints']
        errors = joints['error'][is_visible(joints) & np.isfinite(joints['error'])]
        bins = np.minimum(1e3 * errors, _BINS - 1).astype(int)
        return {**sums, 'visible_median': np.bincount(bins, minlength=_BINS).tolist()}

    @property
    def without_points(self) -> 'Scene':
        """The scene of a camera without depth."""
        return replace(self, frames=[replace(frame, points=None) for frame in self.frames])

    def score_results(self, found: Sequence['Found']) -> Dict[str, List[float]]:
        """Return the sums of people in the images, and in space where there are points."""
        in_space = [one.result.people_3d for one in found if one.result.people_3d is not None]
        sums = self.score(in_space) if in_space else {}
        return {**sums, **self._score_image([one.result.people_2d for one in found])}

    def _score_image(self, found: Sequence[People2D]) -> Dict[str, List[float]]:
        truth, order = chain_runs.read_truth(self.folder)
        return image_switches([[(person['id'], np.array(person['uv'])[order], np.array(person['vis'])[order])
                                for person in frame['people']] for frame in truth['frames']], found)


def image_switches(true: Sequence[Sequence[Tuple[int, np.ndarray, np.ndarray]]], found: Sequence[People2D]
                   ) -> Dict[str, List[float]]:
    """Return how often a person in the image gets another id; `true`: id, uv (K, 2) [px] and labels (K,) by frame."""
    last: Dict[int, int] = {}
    switches = 0
    for there, people in zip(true, found):
        costs = np.array([[chain_runs.apart_in_image(xy, uv, labels) for xy in people.xy] for _, uv, labels in there])
        for row, other in match(costs, costs < _SAME_IN_IMAGE) if costs.size else ():
            name = int(people.ids[other])
            switches += last.get(there[row][0], name) != name
            last[there[row][0]] = name
    return {'image_switches': [switches]}


class Found(NamedTuple):
    """What was found in an image: all detections, and the result."""

    detections: People2D
    result: Result


class _Kept(NetworkDetection):
    """Networks whose newest detections are kept."""

    detections: People2D

    def look(self, frame: ImageFrame, expected: ExpectedPeople, in_full: bool = True) -> Looks:
        looks = super().look(frame, expected, in_full)
        self.detections = looks.people
        return looks


class Runner:
    """Runs variants; its networks compute each input once per scene."""

    def __init__(self) -> None:
        self._networks: Optional[RememberedNetworks] = None

    def found(self, scene: Scene, variant: Variant, budget: float = 0.0) -> List[Found]:
        """Return what is found in each image of a scene; `budget`: work per frame, 0: each is searched in full."""
        settings = settings_of(variant)
        networks = self._networks = self._networks or RememberedNetworks(settings)
        work = chain_runs.Budget(budget, scene.fps, networks.done) if budget else None
        following = FollowingParams(following='always') if budget else NEVER_FOLLOWED
        found = []
        with in_shared(IN_DETECTION, variant.constants):
            detector = Detector(settings.detector, networks, following)
            detection = _Kept(detector, following, work and work.pace)
            chain = PeopleChain(detection, settings.estimator, tracking=settings.tracking)
            for frame in scene.frames:
                result = chain.update(frame) if work is None else work.result(chain, frame)
                found.append(Found(detection.detections, result))
        return found

    def forget(self) -> None:
        """Forget what the networks computed."""
        for network in self._networks.remembered.values() if self._networks else ():
            network.outputs.clear()


class _RememberedVirtual(virtual.VirtualNetworks):
    """Networks on a virtual clock that compute each input once."""

    remembered: Tuple[RememberedNetwork, ...] = ()

    def kept(self, network: Backend) -> Backend:
        self.remembered = (*self.remembered, RememberedNetwork(network))
        return self.remembered[-1]


class Lives:
    """Runs variants on sequences in virtual time, at 15 Hz, on a machine of slowness 4."""

    def __init__(self) -> None:
        self._chains = virtual.Chains(build(ChainSettings, {'threads': 1}), _RememberedVirtual)

    def sums(self, moments: Sequence[virtual.Moment], variant: Variant) -> Dict[str, List[float]]:
        """Return the sums of a sequence, see `virtual.Tally`."""
        with in_shared(SHARED['lives'], variant.constants):
            sums = virtual.counted(moments, virtual.play(self._chains.new(4.0, 1.0), self._chains.machine, moments))
        return {'lost': [sums['lost'], sums['plain']], 'ghosts': [sums['ghosts'], sums['found']],
                'switches': [sums['switches']], 'kept': [sums['kept'], sums['returned']]}

    def forget(self) -> None:
        """Forget what the networks computed."""
        for network in self._chains.networks.remembered:
            network.outputs.clear()


def settings_of(variant: Variant) -> ChainSettings:
    return build(ChainSettings, {'threads': 1, **variant.parameters})


def lifted(frames: Sequence[Frame], people: Sequence[People2D], variant: Variant) -> List[People3D]:
    """Return the people in space of frames whose detections are known."""
    estimator = PeopleEstimator(settings_of(variant).estimator, method=with_values(METHOD, variant.constants))
    return [estimator.update(replace(found, ids=np.full(len(found), -1)), frame).people
            for found, frame in zip(people, frames)]

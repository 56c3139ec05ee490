"""Scenes with known joints on which variants run: images, points and truth are read once for all variants."""
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np

import chain_runs
from ablation_tools.kept import RememberedNetwork
from ablation_tools.parts import IN_DETECTION
from ablation_tools.variants import Variant, in_shared, with_values
from openpose_ros_pkg.assignment import match
from openpose_ros_pkg.detect.detector import Detector, Networks
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.detect.recipes import Recipe
from openpose_ros_pkg.detect.schedule import SCHEDULE
from openpose_ros_pkg.networks.backends import Backend, BackendParams
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
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
          'image_switches': 'switches in the image'}
# Bins of the errors of visible joints: 1 mm wide, the last one open.
_BINS = 300
# In the image, a person is the true one within this median distance, in half diagonals of the true joints.
_SAME_IN_IMAGE = 0.5
# Work of the networks for a frame where people are followed, in units of `chain_runs.WORK`: half a full pass.
BUDGET = 0.5


class RememberedNetworks(Networks):
    """Networks that compute each input once."""

    def __init__(self, params: BackendParams) -> None:
        super().__init__(params)
        self.remembered: Dict[str, RememberedNetwork] = {}

    def load(self, recipe: Recipe) -> Tuple[Recipe, Dict[str, Backend]]:
        recipe, networks = super().load(recipe)
        return recipe, {name: self.remembered.setdefault(name, RememberedNetwork(network))
                        for name, network in networks.items()}


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

    def score_image(self, found: Sequence[People2D]) -> Dict[str, List[float]]:
        """Return the sums of people in the images."""
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


class Runner:
    """Runs variants; its networks compute each input once per scene."""

    def __init__(self) -> None:
        self._networks: Optional[RememberedNetworks] = None

    def found(self, scene: Scene, variant: Variant) -> List[People2D]:
        """Return the people in each image of a scene, each searched in full."""
        return [result.people_2d for _, result in self._results(scene, variant, None, following='never')]

    def followed(self, scene: Scene, variant: Variant) -> List[Tuple[People2D, People3D]]:
        """Return the people in each image of a scene and in space, where they are followed with `BUDGET`."""
        pace = {name: work * SCHEDULE.followed_share / scene.fps / BUDGET for name, work in chain_runs.WORK.items()}
        results = self._results(scene, variant, pace, following='always', target_rate=scene.fps)
        return [(result.people_2d, chain.lift(result).people_3d) for chain, result in results]

    def forget(self) -> None:
        """Forget what the networks computed."""
        for network in self._networks.remembered.values() if self._networks else ():
            network.outputs.clear()

    def _results(self, scene: Scene, variant: Variant, pace: Optional[Dict[str, float]], **parameters: Any
                 ) -> Iterator[Tuple[PeopleChain, Result]]:
        settings = settings_of(variant, **parameters)
        self._networks = self._networks or RememberedNetworks(settings.detector.backend)
        with in_shared(IN_DETECTION, variant.constants):
            detector = Detector(settings.detector, self._networks, settings.following)
            detection = NetworkDetection(detector, settings.tracking, settings.following, pace)
            chain = PeopleChain(detection, settings.estimator)
            for frame in scene.frames:
                prepared = chain.prepare(frame)
                with detection.lock:
                    computed = chain.compute(prepared)
                    chain.search(computed)
                yield chain, chain.finish(computed)


def settings_of(variant: Variant, **parameters: Any) -> ChainSettings:
    return build(ChainSettings, {'threads': 1, **parameters, **variant.parameters})


def lifted(frames: Sequence[Frame], people: Sequence[People2D], variant: Variant) -> List[People3D]:
    """Return the people in space of frames whose people in the image are known."""
    estimator = PeopleEstimator(settings_of(variant).estimator, method=with_values(METHOD, variant.constants))
    return [estimator.update(found, frame).people for found, frame in zip(people, frames)]

"""Scenes with known joints on which variants run: images, points and truth are read once for all variants."""
import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

import chain_runs
from ablations import variants
from ablations.effects import Sums, image_switches, sums_of
from ablations.variants import Variant
from openpose_ros_pkg.detect.detector import Detector, Networks
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.detect.recipes import Recipe
from openpose_ros_pkg.detect.schedule import SCHEDULE
from openpose_ros_pkg.networks.backends import Backend, BackendParams
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.constants import METHOD, MethodConstants
from skeleton_extract_3d.estimator import PeopleEstimator
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.depth import DepthImage

# Work of the networks for a frame where people are followed, in units of `chain_runs.WORK`: half a full pass.
BUDGET = 0.5


class RememberedNetwork:
    """A network that computes each input once."""

    def __init__(self, network: Backend, outputs: Dict[Any, Tuple[np.ndarray, ...]]) -> None:
        self._network, self._outputs = network, outputs
        self.name, self.description, self.fallback = network.name, network.description, network.fallback

    def infer(self, images: np.ndarray) -> Tuple[np.ndarray, ...]:
        return self.infer_many([images])[0]

    def infer_many(self, images: Sequence[np.ndarray]) -> List[Tuple[np.ndarray, ...]]:
        keys = [(self.name, self.description, image.shape, zlib.crc32(image.tobytes())) for image in images]
        new = {key: image for key, image in zip(keys, images) if key not in self._outputs}
        self._outputs.update(zip(new, self._network.infer_many(list(new.values())) if new else ()))
        return [self._outputs[key] for key in keys]


class RememberedNetworks(Networks):
    """Networks that compute each input once; `outputs` is emptied between scenes."""

    def __init__(self, params: BackendParams) -> None:
        super().__init__(params)
        self.outputs: Dict[str, Dict[Any, Tuple[np.ndarray, ...]]] = {}

    def load(self, recipe: Recipe) -> Tuple[Recipe, Dict[str, Backend]]:
        recipe, networks = super().load(recipe)
        return recipe, {name: RememberedNetwork(network, self.outputs.setdefault(name, {}))
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

    def score(self, found: Sequence[People3D]) -> Sums:
        """Return the sums of people in space."""
        return sums_of(self.folder, [(frame.stamp - chain_runs.BEGIN, people)
                                     for frame, people in zip(self.frames, found)])

    def score_image(self, found: Sequence[People2D]) -> Sums:
        """Return the sums of people in the images."""
        truth, order = chain_runs.read_truth(self.folder)
        return image_switches([[(person['id'], np.array(person['uv'])[order], np.array(person['vis'])[order])
                                for person in frame['people']] for frame in truth['frames']], found)


class Runner:
    """Runs variants; its networks compute each input once per scene."""

    def __init__(self) -> None:
        self._networks: Optional[RememberedNetworks] = None

    def found(self, scene: Scene, variant: Variant) -> List[People2D]:
        """Return the people in each image of a scene, each searched in full."""
        settings = settings_of(variant, following='never')
        with variants.in_detection(variant.constants):
            detector = Detector(settings.detector, self._loaded(settings))
            chain = PeopleChain(NetworkDetection(detector, settings.tracking, settings.following), settings.estimator)
            people = []
            for frame in scene.frames:
                prepared = chain.prepare(frame)
                with chain.detection.lock:
                    people.append(chain.finish(chain.compute(prepared)).people_2d)
        return people

    def followed(self, scene: Scene, variant: Variant) -> Tuple[List[People2D], List[People3D]]:
        """Return the people in each image of a scene and in space, where they are followed with `BUDGET`."""
        settings = settings_of(variant, following='always', target_rate=scene.fps)
        pace = {name: work * SCHEDULE.followed_share / scene.fps / BUDGET for name, work in chain_runs.WORK.items()}
        with variants.in_detection(variant.constants):
            detector = Detector(settings.detector, self._loaded(settings), settings.following)
            detection = NetworkDetection(detector, settings.tracking, settings.following, pace)
            chain = PeopleChain(detection, settings.estimator)
            people, lifted_people = [], []
            for frame in scene.frames:
                prepared = chain.prepare(frame)
                with chain.detection.lock:
                    result = chain.finish(chain.compute(prepared))
                people.append(result.people_2d)
                lifted_people.append(chain.lift(result).people_3d)
        return people, lifted_people

    def forget(self) -> None:
        """Forget what the networks computed."""
        for outputs in self._networks.outputs.values() if self._networks else ():
            outputs.clear()

    def _loaded(self, settings: ChainSettings) -> Networks:
        self._networks = self._networks or RememberedNetworks(settings.detector.backend)
        return self._networks


def settings_of(variant: Variant, **parameters: Any) -> ChainSettings:
    return build(ChainSettings, {'threads': 1, **parameters, **variant.parameters})


def lifted(frames: Sequence[Frame], people: Sequence[People2D], variant: Variant) -> List[People3D]:
    """Return the people in space of frames whose people in the image are known."""
    method: MethodConstants = variants.with_values(METHOD, variant.constants)
    estimator = PeopleEstimator(settings_of(variant).estimator, method=method)
    return [estimator.update(found, frame).people for found, frame in zip(people, frames)]

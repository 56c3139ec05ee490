"""The chain over RGB-D sequences with known joints, without ROS: counted networks, runs.

A sequence folder holds rgb/, depth/ (16-bit PNG [mm]), gt.json and either meta.json (K, width, height, fps) or
camera.yaml and sequence.yaml.
"""
import hashlib
import itertools
import json
import time
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

from ground_truth import true_frames
from openpose_ros_pkg.detect.detection import KnownPeople
from openpose_ros_pkg.detect.detector import Detector, Networks
from openpose_ros_pkg.detect.following import NEVER_FOLLOWED, FollowingParams
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.detect.schedule import SCHEDULE
from openpose_ros_pkg.landmarks.body_landmarks import create_body_landmarks
from openpose_ros_pkg.networks.backends import Backend, BackendParams
from openpose_ros_pkg.networks.model_types import Model
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.chain import PeopleChain, Result
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import People3D
from skeleton_extract_3d.points.depth import DepthImage, NoDepth
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence

# Work per pixel of the input, in units of one pass of mobilenet_thin over 656 x 368, as measured with OpenVINO.
WORK = {'mobilenet_thin': 1 / (656 * 368), 'movenet_multipose': 0.35 / (512 * 288), 'movenet_thunder': 0.14 / 256 ** 2,
        'picodet': 0.08 / 320 ** 2, 'tinypose': 0.17 / (192 * 256),
        'pose_landmark': 0.06 / 256 ** 2}
# Stamp of the first frame of a sequence [s]; one of 0 means that there is none.
BEGIN = 1.0

# Stamp [s] and people of each frame.
Frames = List[Tuple[float, People3D]]


open_sequence = RgbdSequence.read


def camera_poses(folder: Path) -> np.ndarray:
    """Return T_world_camera of each frame, (F, 4, 4); in the world, z is up and the floor is z = 0."""
    path, sequence = folder / 'meta.json', open_sequence(folder)
    meta = json.loads(path.read_text()) if path.is_file() else {'T_world_camera': sequence.T_world_camera}
    return np.array(meta.get('poses') or [meta['T_world_camera']] * len(sequence))


class CountedNetwork:
    """A network that has its passes counted, and may compute each input once; `outputs`: what it computed.

    Args:
        count: takes the images of each call.
    """

    def __init__(self, network: Backend, count: Callable[[Sequence[np.ndarray]], None], cached: bool) -> None:
        self._network, self._count, self._cached = network, count, cached
        self.name, self.description, self.fallback = network.name, network.description, network.fallback
        self.outputs: Dict[Any, Tuple[np.ndarray, ...]] = {}

    def infer(self, images: np.ndarray) -> Tuple[np.ndarray, ...]:
        return self.infer_many([images])[0]

    def infer_many(self, images: Sequence[np.ndarray]) -> List[Tuple[np.ndarray, ...]]:
        self._count(images)
        if not self._cached:
            return self._network.infer_many(images)
        keys = [(image.shape, hashlib.blake2b(image.tobytes(), digest_size=16).digest()) for image in images]
        new = {key: image for key, image in zip(keys, images) if key not in self.outputs}
        self.outputs.update(zip(new, self._network.infer_many(list(new.values())) if new else ()))
        return [self.outputs[key] for key in keys]


class CountedNetworks(Networks):
    """Networks that count their work; with `cached` each input is computed once, and counts whenever it is given."""

    def __init__(self, params: BackendParams, model_folder: str, cached: bool = False) -> None:
        super().__init__(params, model_folder)
        self._cached, self._done = cached, 0.0
        self._counted: Dict[str, CountedNetwork] = {}

    def _network(self, model: Model) -> Backend:
        if model.name not in self._counted:
            count = partial(self.count, model.name)
            self._counted[model.name] = CountedNetwork(super()._network(model), count, self._cached)
        return self._counted[model.name]

    def count(self, name: str, images: Sequence[np.ndarray]) -> None:
        """Count the work of a network."""
        self._done += WORK.get(name, np.nan) * sum(image.shape[1] * image.shape[2] for image in images)

    def done(self) -> float:
        """Return the work so far, in units of one pass of mobilenet_thin over 656 x 368 pixels."""
        return self._done

    def forget(self) -> None:
        """Forget what was computed."""
        for network in self._counted.values():
            network.outputs.clear()


class Budget:
    """Work that the networks may do per frame where people are published before the search.

    What is left is saved, up to that of two frames. Crops of expected people, and parts that are owed, are computed in
    any case.

    Args:
        work: per frame, in units of one pass of mobilenet_thin over 656 x 368 pixels.
        rate: of the images [Hz].
        done: returns the work of the networks so far.
    """

    def __init__(self, work: float, rate: float, done: Callable[[], float]) -> None:
        self._work, self._done, self._allowed = work, done, done()
        # one pass, on a machine that does this work in that share of the time [s]
        self._unit = SCHEDULE.followed_share / rate / work

    @property
    def pace(self) -> Dict[str, float]:
        """What the networks take on that machine [s] per pixel, by their names."""
        return {name: work * self._unit for name, work in WORK.items()}

    def result(self, chain: PeopleChain, frame: Frame) -> Result:
        """Return the result of a frame, after which as much of it is searched as there is work left."""
        self._allowed = min(self._allowed + self._work, self._done() + 2 * self._work)
        result = chain.look(frame)
        for part in chain.search():
            if not part.owed and self._done() + part.seconds / self._unit > self._allowed:
                break
        return result


@dataclass
class Run:
    """What was found in the frames of a sequence.

    Attributes:
        people: in each image.
        frames: stamp [s], and people in space.
        work: of the networks for each image.
        times: of each frame in 2D and in 3D [s]; the search after a frame is part of the first.
    """

    people: List[People2D] = field(default_factory=list)
    frames: Frames = field(default_factory=list)
    work: List[float] = field(default_factory=list)
    times: List[Tuple[float, float]] = field(default_factory=list)


class Finder:
    """Finds the people of sequences with the same networks, and counts their work.

    Args:
        budget: work of the networks per frame, see `Budget`; 0: each image is searched in full before its people count.
        networks: those of other finders; None: of its own.
        exact: give the true pixels in place of networks.
        monocular: give no depth.
    """

    def __init__(self, settings: ChainSettings, budget: float = 0.0, networks: Optional[CountedNetworks] = None,
                 exact: bool = False, monocular: bool = False) -> None:
        self._settings, self._work_per_frame = settings, budget
        self._following = FollowingParams(following='always') if budget > 0 else NEVER_FOLLOWED
        self._networks = networks or CountedNetworks(settings.detector.backend,
                                                     settings.detector.detector.model_folder)
        detector = settings.detector
        self._bodies = create_body_landmarks(detector.backend, detector.detector.model_folder) if monocular else None
        self._detector = None if exact else Detector(settings.detector, self._networks, self._following)

    def run(self, folder: Path, floors: Optional[np.ndarray] = None, limit: Optional[int] = None) -> Run:
        """Return what a chain that has seen nothing before finds in each image and in space.

        Args:
            floors: (F, 4) the floor in each frame; None: it is not known.
            limit: number of frames; None: all.
        """
        sequence, work = open_sequence(folder), self._networks.done
        budget = Budget(self._work_per_frame, sequence.fps or 1.0, work) if self._work_per_frame > 0 else None
        if self._detector is None:
            truth = true_frames(folder)
            detection: Any = KnownPeople(COCO_18, lambda frame: truth[frame.source].people_2d)
        else:
            detection = NetworkDetection(self._detector, self._following, None if budget is None else budget.pace)
        chain = PeopleChain(detection, self._settings.estimator, tracking=self._settings.tracking, bodies=self._bodies)
        run = Run()
        for number, each in enumerate(itertools.islice(sequence, limit)):
            done, began = work(), time.perf_counter()
            points = DepthImage(each.depth, sequence.camera) if self._bodies is None else NoDepth(sequence.camera)
            frame = Frame('', BEGIN + each.time, each.bgr, points,
                          floor=None if floors is None else floors[number], source=number)
            result = chain.update(frame) if budget is None else budget.result(chain, frame)
            estimating = sum(result.timing.values())
            run.people.append(result.people_2d)
            run.work.append(work() - done)
            run.times.append((time.perf_counter() - began - estimating, estimating))
            run.frames.append((each.time, result.people_3d))
        return run

#!/usr/bin/python3
"""Measure the 3D chain, without ROS, on RGB-D sequences with known joints.

Runs detector, 2D tracker and estimator over sequence folders and writes the joints as the CSV that
`rostopic echo -p` makes of the per-person 3D message. With --evaluate, the given script scores them. With --lag, the
frames are estimated a second time without smoothing, and the delay of both against the truth is told.
With --budget people are followed, and the networks may do that much work per frame, in units of one pass of
mobilenet_thin over 656 x 368 pixels. Work is counted by the pixels that networks see, so that the results do not depend
on this machine. With --set following=always alone, every search_period-th image is searched in full.
A sequence folder holds rgb/, depth/ (16-bit PNG [mm]), gt.json and either meta.json (K, width, height, fps) or
camera.yaml and sequence.yaml.

    benchmarks/accuracy_3d.py SEQUENCE [SEQUENCE ...] --evaluate evaluate.py --lag
    benchmarks/accuracy_3d.py SEQUENCE --exact-2d --out FOLDER
    benchmarks/accuracy_3d.py SEQUENCE --evaluate evaluate.py --budget 0.6

The method of the original:

    benchmarks/accuracy_3d.py SEQUENCE --evaluate evaluate.py --set lifting=mean3x3 --set tracking=false
"""
import csv
import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np
import pandas as pd
from scipy.optimize import linear_sum_assignment

from common import Parser, errors_end_the_program, new_path
from openpose_ros_pkg.detect.detection import IndependentDetection
from openpose_ros_pkg.detect.detector import Detector, Networks
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.detect.recipes import Recipe
from openpose_ros_pkg.detect.schedule import SCHEDULE
from openpose_ros_pkg.detect.tracking import TrackingParams
from openpose_ros_pkg.networks.backends import Backend, BackendParams
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_tools.alignment.people import pair_people
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.people import MEASURED, People3D
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence

# Label of joints that are seen, in gt.json.
VISIBLE = 2
# Who is nearer to somebody, by the median of the joints, is that person [m]; frames of a path that tells a lag.
SAME_PERSON, LAG_FRAMES = 0.3, 20
# In the image: greatest distance of somebody, in half diagonals; joints of somebody who counts; a joint is near [px].
SAME_IN_IMAGE, LEAST_VISIBLE, NEAR = 0.5, 4, 20
# Work per pixel of the input, as measured with OpenVINO on two cores.
WORK = {'mobilenet_thin': 1 / (656 * 368), 'movenet_multipose': 0.35 / (512 * 288), 'movenet_thunder': 0.14 / 256 ** 2}
# Stamp of the first frame of a sequence [s]; one of 0 means that there is none.
BEGIN = 1.0
PART_FIELDS = ('x', 'y', 'z', 'confidence', 'status', 'sigma')



def open_sequence(folder: Path) -> RgbdSequence:
    """Open a sequence with the camera of its camera.yaml or meta.json."""
    if (folder / 'camera.yaml').is_file():
        return RgbdSequence.read(folder)
    meta = json.loads((folder / 'meta.json').read_text())
    camera = CameraModel(meta['width'], meta['height'], meta['K'])
    return RgbdSequence(folder, camera, meta['fps'], meta.get('frame_id', ''))


def true_floors(folder: Path, sequence: RgbdSequence) -> np.ndarray:
    """Return the floor, z = 0 in the world, in each frame of the camera, (F, 4): see `Frame`."""
    path = folder / 'meta.json'
    meta = json.loads(path.read_text()) if path.is_file() else {'T_world_camera': sequence.T_world_camera}
    poses = meta.get('poses') or [meta['T_world_camera']] * len(sequence)
    return np.array(poses)[:, 2]  # the third row leads from the camera to z in the world


def exact_joints(folder: Path) -> List[List[Tuple[np.ndarray, np.ndarray]]]:
    """Return the true pixels (18, 2) and labels (18,) of the joints of everybody in each frame; 0: out of the image."""
    truth = json.loads((folder / 'gt.json').read_text())
    order = [truth['joints'].index(joint) for joint in COCO_18.joints]
    return [[(np.array(person['uv'], np.float64)[order], np.array(person['vis'])[order]) for person in frame['people']]
            for frame in truth['frames']]


def exact_people(folder: Path) -> List[People2D]:
    """Return the people of each frame by the true pixels: every joint within the image, hidden or not."""
    found = []
    for frame in exact_joints(folder):
        keypoints = np.full((len(frame), len(COCO_18.joints), 3), (np.nan, np.nan, 0), np.float32)
        for row, (uv, labels) in zip(keypoints, frame):
            row[labels > 0, :2], row[labels > 0, 2] = uv[labels > 0], 1
        found.append(People2D(COCO_18, keypoints, np.ones(len(keypoints)), np.full(len(keypoints), -1)))
    return found


def known_people(people: Sequence[People2D], tracking: TrackingParams) -> IndependentDetection:
    """Return a detection that knows the people of each frame; `source` of a frame is its number."""
    return IndependentDetection(COCO_18, lambda frame: lambda: people[frame.source], tracking)


class CountedNetwork:
    """A network that counts its work, in units of one pass of mobilenet_thin over 656 x 368 pixels."""

    def __init__(self, network: Backend, work: float) -> None:
        self._network, self._work, self.done = network, work, 0.0
        self.name, self.description, self.fallback = network.name, network.description, network.fallback

    def infer(self, images: np.ndarray) -> Tuple[np.ndarray, ...]:
        """See `Backend`."""
        return self.infer_many([images])[0]

    def infer_many(self, images: Sequence[np.ndarray]) -> List[Tuple[np.ndarray, ...]]:
        """See `Backend`."""
        self.done += self._work * sum(image.shape[1] * image.shape[2] for image in images)
        return self._network.infer_many(images)


class CountedNetworks(Networks):
    """Networks that count their work."""

    def __init__(self, params: BackendParams, model_folder: str) -> None:
        super().__init__(params, model_folder)
        self._counted: Dict[str, CountedNetwork] = {}

    def load(self, recipe: Recipe) -> Tuple[Recipe, Dict[str, Backend]]:
        """See `Networks`."""
        recipe, networks = super().load(recipe)
        for name, network in networks.items():
            self._counted.setdefault(name, CountedNetwork(network, WORK.get(name, np.nan)))
        return recipe, {name: self._counted[name] for name in networks}

    @property
    def done(self) -> float:
        """Work of all networks so far."""
        return sum(network.done for network in self._counted.values())


class Finder:
    """Finds the people of sequences, and counts the work of the networks.

    Args:
        budget: work that they may do per frame; 0: what the settings say.
        rate: of the images [Hz].
    """

    def __init__(self, settings: ChainSettings, budget: float, rate: float) -> None:
        self._settings, self._following, detector = settings, settings.following, settings.detector
        self._pace = None
        if budget > 0:
            self._following = replace(self._following, following='always')
            detector = replace(detector, detector=replace(detector.detector, target_rate=rate))
            self._pace = {name: work * SCHEDULE.followed_share / rate / budget for name, work in WORK.items()}
        self.networks = CountedNetworks(detector.backend, detector.detector.model_folder)
        self._detector = Detector(detector, self.networks, self._following)

    def stream(self) -> NetworkDetection:
        """Return a detector that has seen nothing yet."""
        return NetworkDetection(self._detector, self._settings.tracking, self._following, self._pace)


@dataclass
class Run:
    """What became of the frames of sequences.

    Attributes:
        people: in each image.
        frames: stamp [s], and people in space.
        work: of the networks for each image.
        detecting, estimating: what each frame took [ms].
        warnings: number of frames that each warning of the points is about.
    """

    people: List[People2D] = field(default_factory=list)
    frames: List[Tuple[float, People3D]] = field(default_factory=list)
    work: List[float] = field(default_factory=list)
    detecting: List[float] = field(default_factory=list)
    estimating: List[float] = field(default_factory=list)
    warnings: Counter = field(default_factory=Counter)


def run_chain(sequence: RgbdSequence, chain: PeopleChain, finder: Optional[Finder] = None,
              floors: Optional[np.ndarray] = None) -> Run:
    """Find the people in each image and in space.

    Args:
        finder: whose work is counted.
        floors: (F, 4) the floor in each frame; None: it is not known.
    """
    run = Run()
    for i, frame in enumerate(sequence):
        done, began = finder.networks.done if finder else 0.0, time.perf_counter()
        prepared = chain.prepare(Frame('', BEGIN + frame.time, frame.bgr, DepthImage(frame.depth, sequence.camera),
                                       floor=None if floors is None else floors[i], source=i))
        with chain.detection.lock:
            computed = chain.compute(prepared)
        result = chain.finish(computed)
        found = time.perf_counter()
        run.people.append(result.people_2d)
        run.work.append(finder.networks.done - done if finder else 0.0)
        began_space = time.perf_counter()
        result = chain.lift(result)
        run.estimating.append(1e3 * (time.perf_counter() - began_space))
        run.detecting.append(1e3 * (found - began))
        run.frames.append((frame.time, result.people_3d))
        run.warnings.update(doubt.event for doubt in result.doubts)
    return run


def report_2d(folders: Sequence[Path], runs: Sequence[Run]) -> str:
    """Return who was found in the images, how exactly, and what it took, as text."""
    count = found = joints = near = 0
    for folder, run in zip(folders, runs):
        for true, people in zip(exact_joints(folder), run.people):
            apart = np.array([[_apart(xy, uv, labels) for xy in people.xy] for uv, labels in true])
            pairs = linear_sum_assignment(apart) if apart.size else ((), ())
            match = {row: column for row, column in zip(*pairs) if apart[row, column] < SAME_IN_IMAGE}
            for row, (uv, labels) in enumerate(true):
                visible = labels == VISIBLE
                if visible.sum() >= LEAST_VISIBLE:
                    count, joints, found = count + 1, joints + visible.sum(), found + (row in match)
                    there = people.xy[match[row]] if row in match else np.full_like(uv, np.nan)
                    near += (np.linalg.norm(there - uv, axis=1)[visible] < NEAR).sum()
    text = f'in the image: {found / count:.3f} of the people, {near / joints:.3f} of the visible joints within 20 px\n'
    work = pd.DataFrame([(len(people), done) for run in runs for people, done in zip(run.people, run.work)])
    by_people = ', '.join(f'{number}: {mean:.2f}' for number, mean in work.groupby(0)[1].mean().items())
    return f'{text}work per frame: {work[1].mean():.2f}, at most {work[1].max():.2f}; by people {by_people}\n'


def report_warnings(folders: Sequence[Path], runs: Sequence[Run]) -> str:
    """Return in how many frames the points of a sequence were doubted, as text."""
    lines = [f'{folder}: {event} in {number} of {len(run.frames)} frames\n'
             for folder, run in zip(folders, runs) for event, number in run.warnings.items()]
    return ''.join(lines) or 'no warning of points\n'


def _apart(xy: np.ndarray, uv: np.ndarray, labels: np.ndarray) -> float:
    """Return the median distance of the joints in the image, as a share of half the diagonal of their true box."""
    distances = np.linalg.norm(xy - uv, axis=1)[labels > 0]
    if not np.isfinite(distances).any():
        return 1e3
    return float(np.nanmedian(distances) / max(np.linalg.norm(np.ptp(uv[labels > 0], axis=0)) / 2, 1.0))


def measured_paths(folder: Path, frames: List[Tuple[float, People3D]]) -> List[Tuple[np.ndarray, np.ndarray]]:
    """Return, for each visible joint, where it was measured and where it truly was in frames in a row, (F, 3) [m]."""
    truth = json.loads((folder / 'gt.json').read_text())
    order = [truth['joints'].index(joint) for joint in COCO_18.joints]
    rows: List[Tuple[float, ...]] = []
    for number, ((_, found), frame) in enumerate(zip(frames, truth['frames'])):
        people = [(person['id'], np.array(person['xyz'])[order], np.array(person['vis'])[order] == VISIBLE)
                  for person in frame['people']]
        for row, other in pair_people(found.xyz, np.array([xyz for _, xyz, _ in people]), SAME_PERSON):
            person, xyz, visible = people[other]
            rows += [(person, joint, number, *found.xyz[row, joint], *xyz[joint])
                     for joint in np.flatnonzero(visible & (found.status[row] == MEASURED))]
    paths = []
    for _, path in pd.DataFrame(rows).groupby([0, 1]):
        for _, run in path.groupby((path[2].diff() > 1).cumsum()):
            if len(run) >= LAG_FRAMES:
                paths.append((run[[3, 4, 5]].to_numpy(), run[[6, 7, 8]].to_numpy()))
    return paths


def lag(paths: List[Tuple[np.ndarray, np.ndarray]]) -> float:
    """Return by how many frames the measured paths come after the true ones: the delay with the least squared error.

    The mean difference of each path does not count.
    """
    delays = np.arange(-2, 3.001, 0.05)
    errors = np.zeros(len(delays))
    for measured, true in paths:
        number = np.arange(len(true))
        inner = number[3:-3]
        for i, delay in enumerate(delays):
            then = np.stack([np.interp(inner - delay, number, axis) for axis in true.T], axis=1)
            off = measured[inner] - then
            errors[i] += ((off - off.mean(axis=0)) ** 2).sum()
    return float(delays[errors.argmin()])


def write_csv(path: Path, frames: List[Tuple[float, People3D]]) -> None:
    """Write one row per person and frame, with the columns of the per-person 3D message."""
    with path.open('x', newline='') as handle:
        writer = csv.writer(handle)
        writer.writerow(['%time', 'field.header.stamp', 'field.num_people_detected', 'field.person_ID',
                         *(f'field.{joint}.{part}' for joint in COCO_18.joints for part in PART_FIELDS)])
        for seconds, people in frames:
            stamp = round(seconds * 1e9)
            values = np.concatenate([people.xyz, people.confidence[..., None], people.status[..., None],
                                     people.sigma[..., None]], axis=2)
            for person, row in zip(people.ids.tolist(), values):
                writer.writerow([stamp, stamp, len(people), person, *row.ravel().tolist()])


def main() -> None:
    """Run the benchmark from the command line."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders')
    parser.add_argument('--exact-2d', action='store_true', help='take the true pixels instead of the detector')
    parser.add_settings('of the chain')
    parser.add_argument('--budget', type=float, default=0.0, help='follow people with this work per frame')
    parser.add_argument('--floor', action='store_true', help='the true floor is known, as with use_floor')
    parser.add_argument('--lag', action='store_true', help='tell the delay of the smoothed joints')
    parser.add_argument('--out', type=new_path, help='folder for the CSV files (default: a temporary one)')
    parser.add_argument('--evaluate', type=Path, help='script that scores pairs of sequence folder and CSV')
    arguments = parser.parse_args()
    with errors_end_the_program():
        settings = build(ChainSettings, parser.settings(arguments.set))
        raw = replace(settings.estimator, smoothing=replace(settings.estimator.smoothing, smoothing=False))
        finder = None
        with tempfile.TemporaryDirectory() as temporary:
            out = arguments.out or Path(temporary)
            out.mkdir(parents=True, exist_ok=True)
            items, runs, paths, raw_paths = [], [], [], []
            for folder in arguments.sequences:
                sequence = open_sequence(folder)
                if finder is None and not arguments.exact_2d:
                    finder = Finder(settings, arguments.budget, sequence.fps or 1.0)
                detection = finder.stream() if finder else known_people(exact_people(folder), settings.tracking)
                chain = PeopleChain(detection, settings.estimator)
                floors = true_floors(folder, sequence) if arguments.floor else None
                run = run_chain(sequence, chain, finder, floors)
                runs.append(run)
                path = out / f'{folder.resolve().parent.name}_{folder.resolve().name}.csv'
                write_csv(path, run.frames)
                items += [str(folder), str(path)]
                if arguments.lag:
                    paths += measured_paths(folder, run.frames)
                    again = run_chain(sequence, PeopleChain(known_people(run.people, settings.tracking), raw))
                    raw_paths += measured_paths(folder, again.frames)
            detecting, estimating = ([each for run in runs for each in getattr(run, name)]
                                     for name in ('detecting', 'estimating'))
            sys.stdout.write(f'median ms per frame: 2D {np.median(detecting):.1f}, 3D {np.median(estimating):.2f}\n')
            sys.stdout.write(report_warnings(arguments.sequences, runs))
            if finder is not None:
                sys.stdout.write(report_2d(arguments.sequences, runs))
            if arguments.lag:
                sys.stdout.write(f'lag in frames: smoothed {lag(paths):.2f}, single frames {lag(raw_paths):.2f}\n')
            sys.stdout.flush()
            if arguments.evaluate:
                raise SystemExit(subprocess.call([sys.executable, str(arguments.evaluate), *items]))


if __name__ == '__main__':
    main()

#!/usr/bin/python3
"""Measure hands and faces in images and in space, without ROS, on RGB-D sequences with known hands.

Runs detector and estimator over sequence folders, as the nodes do, and the networks of hands and faces on the bodies.
Tells how many hands and faces were found, and what they took, as a share of one pass of mobilenet_thin over 656 x 368
pixels: the passes that were made times the least time of one of many, in turns with passes of mobilenet_thin. The
points of the hands become the CSV that the given script scores; it takes one sequence. Where a sequence has a gt.json
with faces, the directions of the heads are compared with those of their true points; where with hands, the share of
points within 2 sigma is told.
With --pictures, images with the points of hands and faces are written into a folder.

    benchmarks/hands.py SEQUENCE --evaluate evaluate_hands.py
    benchmarks/hands.py SEQUENCE [SEQUENCE ...] --pictures FOLDER --set precision=auto
"""
import csv
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from accuracy_3d import BEGIN, ChainSettings, open_sequence
from common import Parser, errors_end_the_program, new_path
from openpose_ros_pkg.detect.detector import create_detector
from openpose_ros_pkg.detect.network_detection import NetworkDetection
from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.landmarks.landmark_network import FACE, HAND, Kind
from openpose_ros_pkg.landmarks.params import LandmarkParams
from openpose_ros_pkg.landmarks.records import HAND_POINTS, Landmarks2D
from openpose_ros_pkg.networks.backends import Backend, BackendParams, create_backend
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN
from openpose_ros_pkg.networks.model_types import Model
from openpose_ros_pkg.networks.models import weights_path
from openpose_ros_pkg.params.parameters import build
from openpose_ros_pkg.skeletons import FACE_70, HAND_21
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.landmarks import Landmarks3D
from skeleton_extract_3d.people import INFERRED, MEASURED
from skeleton_extract_3d.points.depth import DepthImage

ROUNDS = 30
# Heads and hands whose points are this near, by the median, are the same [m].
SAME_HEAD = 0.15
# Input of the network whose time is the unit: height, width.
UNIT = (368, 656)


class CountedNetwork:
    """A network that counts its passes."""

    def __init__(self, network: Backend) -> None:
        self._network, self.passes = network, 0
        self.name, self.description, self.fallback = network.name, network.description, network.fallback

    def infer(self, images: np.ndarray) -> Tuple[np.ndarray, ...]:
        """See `Backend`."""
        return self.infer_many([images])[0]

    def infer_many(self, images: Sequence[np.ndarray]) -> List[Tuple[np.ndarray, ...]]:
        """See `Backend`."""
        self.passes += len(images)
        return self._network.infer_many(images)


class Landmarks:
    """Networks of hands and faces that count their passes."""

    def __init__(self, backend: BackendParams, model_folder: str) -> None:
        self._backend, self._model_folder = backend, model_folder
        self.networks: Dict[str, CountedNetwork] = {}

    def load(self, kind: Kind) -> Backend:
        """Return a network, loaded once."""
        name = kind.model.name
        if name not in self.networks:
            self.networks[name] = CountedNetwork(self.create(kind.model))
        return self.networks[name]

    def create(self, model: Model) -> Backend:
        """Load a network."""
        return create_backend(model, weights_path(model, self._model_folder), self._backend)


class Found(NamedTuple):
    """Hands and faces of a frame, and its stamp [s]."""

    stamp: float
    in_image: Landmarks2D
    in_space: Landmarks3D


def find(folder: Path, settings: ChainSettings, landmarks: Landmarks, pictures: Optional[Path]) -> List[Found]:
    """Return hands and faces of each frame of a sequence; write pictures where a folder is given."""
    sequence = open_sequence(folder)
    stream = NetworkDetection(create_detector(settings.detector, settings.following), settings.tracking,
                            settings.following)
    chain = PeopleChain(stream, settings.estimator,
                        LandmarkDetector(LandmarkParams(hands=True, face=True), landmarks.load))
    found = []
    for i, frame in enumerate(sequence):
        result = chain.update(Frame('', BEGIN + frame.time, frame.bgr, DepthImage(frame.depth, sequence.camera)))
        found.append(Found(frame.time, *result.landmarks))
        if pictures:
            path = pictures / f'{folder.resolve().parent.name}_{folder.resolve().name}_{i:04d}.jpg'
            cv2.imwrite(str(path), drawn(frame.bgr, result.landmarks.in_image))
    return found


def drawn(bgr: np.ndarray, found: Landmarks2D) -> np.ndarray:
    """Return an image, twice as large, with the points of hands and faces."""
    image = cv2.resize(bgr, None, fx=2, fy=2)
    for skeleton, parts in ((HAND_21, found.hands.keypoints), (FACE_70, found.faces.keypoints)):
        for points in parts:
            pixels = np.rint(2 * points[:, :2] + 0.5).astype(int).tolist()
            for start, end in skeleton.drawn_limbs:
                colour = skeleton.colours[int(end)][::-1]
                cv2.line(image, tuple(pixels[int(start)]), tuple(pixels[int(end)]), colour, 1, cv2.LINE_AA)
    for points, left, score in zip(found.hands.keypoints, found.hands.left, found.hands.scores):
        place = tuple(np.rint(2 * points[0, :2]).astype(int).tolist())
        cv2.putText(image, f"{'L' if left else 'R'} {score:.2f}", place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, (255,) * 3)
    return image


def write_csv(path: Path, frames: Sequence[Found]) -> None:
    """Write one row per hand in space."""
    with path.open('w', newline='') as handle:
        writer = csv.writer(handle)
        writer.writerow(['stamp', 'side', *(f'{axis}{k}' for k in range(HAND_POINTS) for axis in 'uvxyz')])
        for stamp, found, lifted in frames:
            for pixels, xyz in pairs_of_hands(found, lifted):
                row = np.concatenate([found.hands.keypoints[pixels, :, :2], lifted.hands.points.xyz[xyz]], axis=1)
                side = 'left' if lifted.hands.left[xyz] else 'right'
                writer.writerow([round(stamp * 1e9), side, *row.ravel().tolist()])


def pairs_of_hands(found: Landmarks2D, lifted: Landmarks3D) -> Iterator[Tuple[int, int]]:
    """Yield the rows of the same hands in the image and in space."""
    names = list(zip(found.hands.people.tolist(), found.hands.left.tolist()))
    for row, name in enumerate(zip(lifted.hands.people.tolist(), lifted.hands.left.tolist())):
        yield names.index(name), row


def compared(folder: Path, frames: Sequence[Found]) -> str:
    """Return how far heads look elsewhere than their true points say, and whether sigma is honest, as text."""
    if not (folder / 'gt.json').is_file():
        return ''
    truth = json.loads((folder / 'gt.json').read_text())
    if 'face_points' not in truth:
        return ''
    angles, errors = [], []
    for (_, _, lifted), frame in zip(frames, truth['frames']):
        for person in frame['people']:
            xyz = np.array(person['face']['xyz'])
            for points, turn in zip(lifted.faces.points.xyz, lifted.faces.orientations):
                if np.linalg.norm(np.nanmedian(points, axis=0) - xyz.mean(axis=0)) < SAME_HEAD:
                    angles.append(angle(Rotation.from_quat(turn).apply([1.0, 0.0, 0.0]), true_direction(xyz, truth)))
            for hand in person['hands']:
                left = hand['side'] == 'left'
                for row in np.flatnonzero(lifted.hands.left == left):
                    points = lifted.hands.points
                    distance = np.linalg.norm(points.xyz[row] - hand['xyz'], axis=1)
                    if np.nanmedian(distance) < SAME_HEAD:
                        errors += list(zip(points.status[row].tolist(), (distance / points.sigma[row]).tolist()))
    text = f'heads look {np.median(angles):.1f} deg elsewhere (median of {len(angles)})\n' if angles else ''
    for status, name in ((MEASURED, 'measured'), (INFERRED, 'inferred')):
        ratios = [ratio for each, ratio in errors if each == status]
        if ratios:
            text += f'{name} points of hands within 2 sigma: {np.mean(np.array(ratios) <= 2):.3f} of {len(ratios)}\n'
    return text


def true_direction(xyz: np.ndarray, truth: Dict[str, List[str]]) -> np.ndarray:
    """Return the direction out of a face, (3,): square to the line of the eyes and that from the mouth to the eyes."""
    point = dict(zip(truth['face_points'], xyz))
    left = point['left_eye_outer'] - point['right_eye_outer']
    eyes = sum(point[f'{side}_eye_{corner}'] for side in ('left', 'right') for corner in ('inner', 'outer')) / 4
    return np.cross(left, eyes - (point['mouth_left'] + point['mouth_right']) / 2)


def angle(first: np.ndarray, second: np.ndarray) -> float:
    """Return the angle between two vectors (3,) [deg]."""
    return float(np.degrees(np.arccos(first @ second / np.linalg.norm(first) / np.linalg.norm(second))))


def least_seconds(networks: Dict[Model, Backend]) -> Dict[str, float]:
    """Return the least time of a pass of each network [s], by name, in rounds in which all take their turn."""
    images = {model: np.full((1, *(model.input.fixed_size or UNIT), 3), 90, np.uint8) for model in networks}
    seconds: Dict[str, List[float]] = {model.name: [] for model in networks}
    for _ in range(ROUNDS):
        for model, network in networks.items():
            began = time.perf_counter()
            network.infer(images[model])
            seconds[model.name].append(time.perf_counter() - began)
    return {name: min(each) for name, each in seconds.items()}


def report(frames: Sequence[Found], landmarks: Landmarks) -> str:
    """Return what was found, and what it took, as text."""
    hands, faces = (sum(len(getattr(found.in_image, part)) for found in frames) for part in ('hands', 'faces'))
    thin = landmarks.create(MOBILENET_THIN)
    pace = least_seconds({MOBILENET_THIN: thin, **{kind.model: landmarks.load(kind) for kind in (HAND, FACE)}})
    unit = pace.pop(MOBILENET_THIN.name)
    shares = {name: seconds / unit for name, seconds in pace.items()}
    return (f'{len(frames)} frames, {hands} hands, {faces} faces; one pass of mobilenet_thin: {1e3 * unit:.1f} ms\n'
            + ''.join(f'{name}: {share:.3f} of it\n' for name, share in shares.items()))


def main() -> None:
    """Run the benchmark from the command line."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders')
    parser.add_settings('of the chain')
    parser.add_argument('--pictures', type=new_path, help='folder for images with the points')
    parser.add_argument('--evaluate', type=Path, help='script that scores a sequence folder and a CSV')
    arguments = parser.parse_args()
    with errors_end_the_program(), tempfile.TemporaryDirectory() as temporary:
        settings = build(ChainSettings, parser.settings(arguments.set))
        backend = settings.detector.backend
        landmarks = Landmarks(backend, settings.detector.detector.model_folder)
        if arguments.pictures:
            arguments.pictures.mkdir(parents=True, exist_ok=True)
        frames = []
        for folder in arguments.sequences:
            found = find(folder, settings, landmarks, arguments.pictures)
            sys.stdout.write(compared(folder, found))
            frames += found
        passes = {name: network.passes for name, network in landmarks.networks.items()}
        sys.stdout.write(report(frames, landmarks) + f'passes: {passes}\n')
        sys.stdout.flush()
        if arguments.evaluate:
            path = Path(temporary) / 'hands.csv'
            write_csv(path, frames)
            raise SystemExit(subprocess.call([sys.executable, str(arguments.evaluate), str(arguments.sequences[0]),
                                              str(path)]))


if __name__ == '__main__':
    main()

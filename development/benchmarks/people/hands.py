#!/usr/bin/python3
"""Measure hands and faces in images and in space, without ROS, on RGB-D sequences with known hands (see chain_runs.py).

Prints how many hands and faces were found, and the least time of a pass of each network, as a share of one pass of
mobilenet_thin over 656 x 368. Hands, and the directions of faces, are scored against those of gt.json
(scoring/hands.py).

    ./run bench people hands SEQUENCE
"""
import sys
from pathlib import Path
from typing import Dict, List, Tuple

import numpy as np
from scipy.spatial.transform import Rotation

from chain_runs import BEGIN, CountedNetwork, open_sequence
from common import Parser, elapsed
from openpose_ros_pkg.command_line import add_settings, run_command, setting_values
from openpose_ros_pkg.detect.network_detection import create_detection
from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.landmarks.landmark_network import FACE, HAND
from openpose_ros_pkg.landmarks.params import LandmarkParams
from openpose_ros_pkg.networks.backends import Backend, create_backend
from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN
from openpose_ros_pkg.networks.model_types import Model
from openpose_ros_pkg.networks.models import weights_path
from openpose_ros_pkg.params.parameters import build
from scoring.figures import figures
from scoring.hands import STATISTICS, Face, Hand, score_hands
from scoring.tables import lines_of
from skeleton_extract_3d.chain import PeopleChain
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.landmarks import Landmarks
from skeleton_extract_3d.points.depth import DepthImage

ROUNDS = 30
# Input of the network whose time is the unit: height, width.
UNIT = (368, 656)

Found = List[Tuple[float, Landmarks]]


def find(folder: Path, settings: ChainSettings, networks: Dict[Model, CountedNetwork]) -> Found:
    """Return stamp [s], and hands and faces of each frame of a sequence."""
    sequence = open_sequence(folder)
    landmarks = LandmarkDetector(LandmarkParams(hands=True, face=True), lambda kind: networks[kind.model])
    chain = PeopleChain(create_detection(settings.detector), settings.estimator, landmarks)
    return [(frame.time, chain.update(Frame('', BEGIN + frame.time, frame.bgr, DepthImage(
        frame.depth, sequence.camera))).landmarks) for frame in sequence]


def scored(frames: Found) -> List[Tuple[float, List[Hand], List[Face]]]:
    """Return the hands and faces in space of each frame, as they are scored."""
    result = []
    for stamp, (found, lifted) in frames:
        in_image, in_space = (list(zip(each.people.tolist(), each.left.tolist()))
                              for each in (found.hands, lifted.hands))
        points, faces = lifted.hands.points, lifted.faces
        result.append((stamp, [Hand(name[1], found.hands.keypoints[in_image.index(name), :, :2], points.xyz[row],
                                    points.status[row], points.sigma[row]) for row, name in enumerate(in_space)],
                       [Face(xyz, Rotation.from_quat(turn).apply([1.0, 0.0, 0.0]), sigma) for xyz, turn, sigma in zip(
                           faces.points.xyz, faces.orientations, faces.orientation_sigma.tolist())]))
    return result


def least_milliseconds(networks: Dict[Model, Backend]) -> Dict[str, float]:
    """Return the least time of a pass of each network [ms], by name, in rounds in which all take their turn."""
    images = {model: np.full((1, *(model.input.fixed_size or UNIT), 3), 90, np.uint8) for model in networks}
    rounds = [{model.name: elapsed(lambda model=model: networks[model].infer(images[model]))[0] for model in networks}
              for _ in range(ROUNDS)]
    return {name: min(each[name] for each in rounds) for name in rounds[0]}


def report(frames: Found, networks: Dict[Model, CountedNetwork], unit: Backend) -> str:
    """Return what was found, and its time, as text."""
    hands, faces = (sum(len(getattr(found.in_image, part)) for _, found in frames) for part in ('hands', 'faces'))
    passes = {model.name: network.passes for model, network in networks.items()}
    pace = least_milliseconds({MOBILENET_THIN: unit, **networks})
    whole = pace.pop(MOBILENET_THIN.name)
    return (f'{len(frames)} frames, {hands} hands, {faces} faces; one pass of mobilenet_thin: {whole:.1f} ms\n'
            + ''.join(f'{name}: {each / whole:.3f} of it\n' for name, each in pace.items()) + f'passes: {passes}\n')


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders')
    add_settings(parser, 'of the chain')
    arguments = parser.parse_args()
    settings = build(ChainSettings, setting_values(parser, arguments.settings))
    frames: Found = []
    counts = []
    unit, *both = (create_backend(model, weights_path(model, settings.detector.detector.model_folder),
                                  settings.detector.backend) for model in (MOBILENET_THIN, HAND.model, FACE.model))
    networks = {kind.model: CountedNetwork(network) for kind, network in zip((HAND, FACE), both)}
    for folder in arguments.sequences:
        found = find(folder, settings, networks)
        counts.append(score_hands(folder, scored(found)))
        frames += found
    sys.stdout.write(report(frames, networks, unit))
    print(*lines_of(figures(counts, STATISTICS)), sep='\n')
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

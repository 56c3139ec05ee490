#!/usr/bin/python3
"""Ablation of hands and faces: each constant at half and at twice its value; what moves by how much.

Sequences with known hands (see chain_runs.py). Bodies are found once, and what a network gives for a crop is kept.
Figures: hands found (median of the points within half a hand), points of hands within a tenth and a fifth of a hand,
hands where no true one is, faces found and the error of their points in widths of the face, runs of the networks per
frame; without a limit of time, with two runs per frame for three hands and faces (`short`), every third frame (`slow`).

    ./run bench ablation hands SEQUENCE...
"""
import itertools
import sys
from functools import partial
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np

from ablation_tools.changes import Counts, Sums, counts_of
from ablation_tools.command import add_options, run
from ablation_tools.kept import RememberedNetwork, found_in
from ablation_tools.variants import Values, constant_paths, in_shared
from chain_runs import BEGIN, CountedNetwork, open_sequence, read_truth
from common import Parser
from openpose_ros_pkg.command_line import run_command
from openpose_ros_pkg.landmarks import landmark_network, regions
from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.landmarks.landmark_network import FACE, HAND
from openpose_ros_pkg.landmarks.params import LandmarkParams
from openpose_ros_pkg.networks.backends import BackendParams, create_backend
from openpose_ros_pkg.networks.models import weights_path

# Shared instances of constants.
SHARED = {'landmark': landmark_network.LANDMARKS, 'hand': regions.HAND_REGION, 'face': regions.FACE_REGION}
# Frames of a unit of the bootstrap, least visible joints of a true hand or face, time of a run [s].
BLOCK, LEAST_VISIBLE, RUN = 6, 8, 0.01
# Points of the faces that are found by those of gt.json: the 68 of iBUG.
FACE_POINTS = {'right_eye_outer': 36, 'right_eye_inner': 39, 'left_eye_inner': 42, 'left_eye_outer': 45, 'nose_tip': 30,
               'mouth_right': 48, 'mouth_left': 54}
# By word: every so many-th frame, and the time of the networks.
LIMITS = (('', 1, None), ('short ', 1, 2 * RUN), ('slow ', 3, None))


def score(sequences: Sequence[Tuple[Dict[str, Any], List[Any]]], networks: Dict[Any, CountedNetwork],
          values: Values) -> Counts:
    """Return the counts of all sequences, in blocks of frames; `values`: of the constants that are varied, by path."""
    units: List[Sums] = []
    with in_shared(SHARED, values):
        for (truth, frames), (word, step, seconds) in itertools.product(sequences, LIMITS):
            detector = LandmarkDetector(LandmarkParams(hands=True, face=True), lambda kind: networks[kind.model])
            for number in range(0, len(frames), step):
                if number % BLOCK == 0:
                    units.append(Sums())
                stamp, bgr, people = frames[number]
                runs = sum(network.passes for network in networks.values())
                for one in detector._networks.values():
                    one.seconds = RUN
                found = detector.detect(bgr, people, None, '', BEGIN + stamp, seconds)
                _count(units[-1], word, truth, number, found)
                units[-1].add(f'{word}runs', sum(network.passes for network in networks.values()) - runs, 1)
    return counts_of(units)


def _count(sums: Sums, word: str, truth: Dict[str, Any], number: int, found: Any) -> None:
    person = truth['frames'][number]['people'][0]
    matched = 0
    for hand in person['hands']:
        uv, visible = np.array(hand['uv']), np.array(hand['vis']) == 2
        size = np.ptp(uv, axis=0).max()
        rows = np.flatnonzero(found.hands.left == (hand['side'] == 'left'))
        errors = np.linalg.norm(found.hands.keypoints[rows][..., :2] - uv, axis=2) / size
        right = len(rows) > 0 and bool(np.median(errors[0]) < 0.5)
        matched += right
        if visible.sum() < LEAST_VISIBLE:
            continue
        sums.add(f'{word}hands', right, 1)
        for name, limit in (('0.1', 0.1), ('0.2', 0.2)):
            sums.add(f'{word}points {name}', (errors[0][visible] < limit).sum() if right else 0, visible.sum())
    sums.add(f'{word}false hands', len(found.hands) - matched, 1)
    face = dict(zip(truth['face_points'], zip(person['face']['uv'], person['face']['vis'])))
    names = [name for name in FACE_POINTS if name in face]
    if sum(face[name][1] == 2 for name in names) >= len(names) - 2:
        true = np.array([face[name][0] for name in names])
        width = np.ptp(true[:, 0]) + 1e-6
        errors = [np.linalg.norm(one[[FACE_POINTS[name] for name in names], :2] - true, axis=1).mean() / width
                  for one in found.faces.keypoints]
        sums.add(f'{word}faces', bool(errors and errors[0] < 0.5), 1)
        if errors and errors[0] < 0.5:
            sums.add(f'{word}face error', errors[0], 1)


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders with known hands')
    add_options(parser)
    arguments = parser.parse_args()
    networks = {kind.model: CountedNetwork(RememberedNetwork(create_backend(
        kind.model, weights_path(kind.model, ''), BackendParams()))) for kind in (HAND, FACE)}
    sequences = [(read_truth(folder)[0], [(frame.time, frame.bgr, people) for frame, people in zip(
        open_sequence(folder), found_in(folder, arguments.cache)[1])]) for folder in arguments.sequences]
    run(constant_paths(SHARED), dict, {'hands': partial(score, sequences, networks)}, {}, arguments)
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

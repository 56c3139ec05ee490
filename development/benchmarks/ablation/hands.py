#!/usr/bin/python3
"""Ablation of hands and faces: each constant at half and at twice its value; what moves by how much.

Sequences with known hands (see chain_runs.py). Bodies are found once, and what a network gives for a crop is remembered.
Figures: hands found (median of the points within half a hand), points of hands within a tenth and a fifth of a hand,
hands where no true one is, faces found and the error of their points in widths of the face, runs of the networks per
frame; without a limit of time, with two runs per frame for three hands and faces (`short`), and every third frame alone (`slow`).

    ./run bench ablation hands SEQUENCE...
"""
import hashlib
import json
import pickle
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np

from ablation_table import FACTORS, NEAR_FACTORS, Counts, changes, names_of, print_base, scaled, table, value_of
from chain_runs import BEGIN, Finder, open_sequence
from common import Parser
from openpose_ros_pkg.command_line import run_command
from openpose_ros_pkg.landmarks import landmark_network, regions
from openpose_ros_pkg.landmarks.detector import LandmarkDetector
from openpose_ros_pkg.landmarks.landmark_network import FACE, HAND
from openpose_ros_pkg.landmarks.params import LandmarkParams
from openpose_ros_pkg.networks.backends import BackendParams, create_backend
from openpose_ros_pkg.networks.models import weights_path
from openpose_ros_pkg.params.parameters import build
from skeleton_extract_3d.chain_settings import ChainSettings

GROUPS = {'landmark': landmark_network.LANDMARKS, 'hand': regions.HAND_REGION, 'face': regions.FACE_REGION}
# Frames of a unit of the bootstrap, least visible joints of a true hand or face, time of a run [s].
BLOCK, LEAST_VISIBLE, RUN = 6, 8, 0.01
# Points of the faces that are found by those of gt.json: the 68 of iBUG.
FACE_POINTS = {'right_eye_outer': 36, 'right_eye_inner': 39, 'left_eye_inner': 42, 'left_eye_outer': 45, 'nose_tip': 30,
               'mouth_right': 48, 'mouth_left': 54}


class Remembered:
    """A network that computes each crop once."""

    def __init__(self, network: Any, known: Dict[bytes, Any]) -> None:
        self._network, self._known, self.runs = network, known, 0
        self.name, self.description, self.fallback = network.name, network.description, network.fallback

    def infer_many(self, images: Sequence[np.ndarray]) -> List[Any]:
        self.runs += len(images)
        keys = [hashlib.sha1(image.tobytes()).digest() for image in images]  # noqa: S324  no secret
        for key, image in zip(keys, images):
            if key not in self._known:
                self._known[key] = self._network.infer_many([image])[0]
        return [self._known[key] for key in keys]


def people_of(folder: Path, cache: Path) -> List[Any]:
    """Return images, people and hidden joints of a sequence."""
    path, source = cache / f'{folder.resolve().parent.name}_{folder.name}_bodies.pickle', open_sequence(folder)
    if not path.is_file():
        run = Finder(build(ChainSettings, {})).run(source)
        cache.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps(run.people))
    people = pickle.loads(path.read_bytes())  # noqa: S301  a file of this program
    return [(frame.time, frame.bgr, one) for frame, one in zip(source, people)]


def counts_of(sequences: Sequence[Tuple[Dict[str, Any], List[Any]]], networks: Dict[Any, Remembered]) -> Counts:
    """Return the counts of all sequences, in blocks of frames."""
    blocks: List[Dict[str, np.ndarray]] = []
    for truth, frames in sequences:
        for word, step, seconds in (('', 1, None), ('short ', 1, 2 * RUN), ('slow ', 3, None)):
            detector = LandmarkDetector(LandmarkParams(hands=True, face=True), lambda kind: networks[kind.model])
            for number in range(0, len(frames), step):
                if number % BLOCK == 0:
                    blocks.append({})
                stamp, bgr, people = frames[number]
                before = [network.runs for network in networks.values()]
                for one in detector._networks.values():
                    one.seconds = RUN
                found = detector.detect(bgr, people, None, '', BEGIN + stamp, seconds)
                runs = sum(network.runs for network in networks.values()) - sum(before)
                _count(blocks[-1], word, truth, number, found)
                _add(blocks[-1], f'{word}runs', runs, 1)
    return {name: np.array([block.get(name, np.zeros(2)) for block in blocks])
            for name in sorted({name for block in blocks for name in block})}


def _add(block: Dict[str, np.ndarray], name: str, numerator: float, denominator: float) -> None:
    block[name] = block.get(name, np.zeros(2)) + (numerator, denominator)


def _count(block: Dict[str, np.ndarray], word: str, truth: Dict[str, Any], number: int, found: Any) -> None:
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
        _add(block, f'{word}hands', right, 1)
        for name, limit in (('0.1', 0.1), ('0.2', 0.2)):
            _add(block, f'{word}points {name}', (errors[0][visible] < limit).sum() if right else 0, visible.sum())
    _add(block, f'{word}false hands', len(found.hands) - matched, 1)
    face = dict(zip(truth['face_points'], zip(person['face']['uv'], person['face']['vis'])))
    names = [name for name in FACE_POINTS if name in face]
    if sum(face[name][1] == 2 for name in names) >= len(names) - 2:
        true = np.array([face[name][0] for name in names])
        width = np.ptp(true[:, 0]) + 1e-6
        errors = [np.linalg.norm(one[[FACE_POINTS[name] for name in names], :2] - true, axis=1).mean() / width
                  for one in found.faces.keypoints]
        _add(block, f'{word}faces', bool(errors and errors[0] < 0.5), 1)
        if errors and errors[0] < 0.5:
            _add(block, f'{word}face error', errors[0], 1)


def main() -> int:
    """Run the benchmark from the command line; return the exit status."""
    parser = Parser(__doc__)
    parser.add_argument('sequences', nargs='+', type=Path, help='sequence folders with known hands')
    parser.add_argument('--only', default='', help='constants whose dotted names begin like this')
    parser.add_argument('--before', type=Path, help='counts to compare with; the file is written if it is not there')
    parser.add_argument('--near', action='store_true', help='factors 0.8 and 1.25: which constants are fragile')
    parser.add_argument('--cache', type=Path, default=Path('logs/ablation'), help='folder for what networks give')
    arguments = parser.parse_args()
    arguments.cache.mkdir(parents=True, exist_ok=True)
    memory = arguments.cache / 'landmark_networks.pickle'
    known = pickle.loads(memory.read_bytes()) if memory.is_file() else {kind.model.name: {} for kind in (HAND, FACE)}  # noqa: S301
    networks = {kind.model: Remembered(create_backend(kind.model, weights_path(kind.model, ''), BackendParams()),
                                       known[kind.model.name]) for kind in (HAND, FACE)}
    sequences = [(json.loads((folder / 'gt.json').read_text()), people_of(folder, arguments.cache))
                 for folder in arguments.sequences]
    base = counts_of(sequences, networks)
    print_base({'hands': base}, arguments.before)
    factors, found = NEAR_FACTORS if arguments.near else FACTORS, {}
    everything = {f'{group}.{name}': record for group, record in GROUPS.items() for name in names_of(record)}
    for path, record in everything.items():
        if not path.startswith(arguments.only):
            continue
        name = path.partition('.')[2]
        value = value_of(record, name)
        for how, factor in factors.items():
            object.__setattr__(record, name, scaled(value, factor))
            found[path, how] = changes(base, counts_of(sequences, networks))
            object.__setattr__(record, name, value)
            print(path, how, {k: tuple(round(float(x), 3) for x in v[:3]) for k, v in found[path, how].items() if v.is_clear},
                  file=sys.stderr, flush=True)
        memory.write_bytes(pickle.dumps(known))
    print(table(GROUPS, found, [*factors]))
    return 0


if __name__ == '__main__':
    sys.exit(run_command('bench', main))

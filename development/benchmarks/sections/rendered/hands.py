"""Hands and faces."""
import importlib
import json
from pathlib import Path

from chain_runs import CountedNetwork
from openpose_ros_pkg.landmarks.landmark_network import FACE, HAND
from openpose_ros_pkg.networks.backends import create_backend
from openpose_ros_pkg.networks.models import weights_path
from openpose_ros_pkg.params.parameters import build
from results import Options, Section, Table, scenes_with
from scoring.counts import blocks_of
from scoring.figures import few_scenes
from scoring.hands import STATISTICS, score_hands
from skeleton_extract_3d.chain_settings import ChainSettings

# Length of the parts of a scene that intervals are drawn from [s].
BLOCK = 0.5


def measure(options: Options) -> Section:
    """Run the chain with hands on scenes with true hand points: rendered ones, or of --data hands=FOLDER."""
    program = importlib.import_module('people.hands')
    settings = build(ChainSettings, {'mode': 'balanced', **options.settings})
    networks = {kind.model: CountedNetwork(create_backend(kind.model, weights_path(
        kind.model, settings.detector.detector.model_folder), settings.detector.backend)) for kind in (HAND, FACE)}
    folders = scenes_with(options, 'hands', has_hands)
    counts, blocks = [], []
    for folder in folders:
        found = program.scored(program.find(folder, settings, networks))
        counts.append(score_hands(folder, found))
        blocks += [score_hands(folder, found, block) for block in blocks_of(folder, BLOCK)]
    named = few_scenes(counts, blocks, STATISTICS)
    return Section(f'{len(counts)} scenes, mode balanced. Shares count all points of true hands, those that are not '
                   'given as wrong. Intervals: bootstrap over scenes, of less than five over halves of a second.',
                   named,
                   [Table('', [['', 'figure'], *([figure.text, figure] for figure in named.values())])])


def has_hands(folder: Path) -> bool:
    """Return whether the truth of a scene has hands."""
    return 'hand_joints' in json.loads((folder / 'gt.json').read_text())

"""Postures, gestures and pointing."""
import importlib
import json
from pathlib import Path

from chain_runs import Finder
from openpose_ros_pkg.params.parameters import build
from results import Options, Section, Table, scenes_with
from scoring.figures import figures
from scoring.signals import LABELS, MARGIN, STATISTICS, score_signals
from skeleton_extract_3d.chain_settings import ChainSettings


def measure(options: Options) -> Section:
    """Run the chain and the signals on scenes with labels: among the rendered ones, or of --data signals=FOLDER."""
    program = importlib.import_module('people.signals')
    folders = scenes_with(options, 'signals', labelled)
    finder = Finder(build(ChainSettings, {'mode': 'balanced', **options.settings}))
    counts = []
    for folder in folders[:1] if options.quick else folders:
        sequence = program.read_sequence(folder, finder, 1)
        counts.append(score_signals(folder, program.labelled(sequence.found, sequence.read(sequence.found))))
        print(f'{len(counts)} of {len(folders)} scenes', flush=True)
    named = figures(counts, STATISTICS)
    labels = [['label', 'F1', 'frames'], *([name, named[f'f1_{name}'], int(sum(
        each.sums[f'right_{name}'] + each.sums[f'missed_{name}'] for each in counts))] for name in LABELS)]
    pointing = [['', 'figure'], *([named[name].text, named[name]] for name in (
        'f1', 'arm', 'point_given', 'point_10', 'point_15', 'point_20', 'point_median'))]
    return Section(f'{len(counts)} scenes, mode balanced; a label counts in each frame, without those within '
                   f'{MARGIN:g} s of its beginning or end. Pointing: angle between the ray and the true target; frames '
                   'without a ray count as wrong.', named, [Table('Labels', labels), Table('Gestures', pointing)])


def labelled(folder: Path) -> bool:
    """Return whether the truth of a scene has labels."""
    return 'targets' in json.loads((folder / 'gt.json').read_text())

"""Postures, gestures and pointing."""
import importlib
import json
from dataclasses import replace
from pathlib import Path

from results import NeedsDataError, Options, Section, Table, scenes_with
from results.counting import count, people_of
from scoring.counts import Counts, blocks_of
from scoring.figures import Ratio, few_scenes, figures
from scoring.signals import LABELS, MARGIN, STATISTICS, score_signals

POINTING = ('f1', 'arm', 'point_given', 'point_10', 'point_15', 'point_20', 'point_median',
            *(name for name in STATISTICS if name.startswith(('eye_', 'shoulder_'))))
FALSE = {'false_per_minute': Ratio('gestures per minute of a scene that the true joints do not make',
                                   lambda counts: 60 * counts.sums['false'], lambda counts: counts.sums['seconds'],
                                   digits=2)}


def measure(options: Options) -> Section:
    """Run the signals on what mode balanced finds in scenes with labels, and in those without.

    Scenes with labels are among the rendered ones, or in --data signals=FOLDER.
    """
    program = importlib.import_module('people.signals')
    plain = [false_gestures(program, folder, counts) for folder, counts in zip(
        options.scenes, count(options, {'mode': 'balanced'})) if not has_labels(folder)]
    named = figures(plain, FALSE)
    tables = [Table('Gestures that are not made', [['', 'figure'], *([each.text, each] for each in named.values())])]
    counts, blocks = [], []
    try:
        folders = scenes_with(options, 'signals', has_labels)
        for folder, each in zip(folders, count(replace(options, scenes=folders, quick=False), {'mode': 'balanced'})):
            sequence = read(program, folder, each)
            labels = program.labelled(sequence.found, sequence.read(sequence.found))
            counts.append(score_signals(folder, labels))
            blocks += [score_signals(folder, labels, part=block) for block in blocks_of(folder)]
    except NeedsDataError:
        print('signals: scenes with labels are missing: --data signals=FOLDER')
    labelled = few_scenes(counts, blocks, STATISTICS) if counts else {}
    if counts:
        tables = [Table('Labels', [['label', 'F1', 'frames'], *([name, labelled[f'f1_{name}'], int(sum(
            each.sums[f'right_{name}'] + each.sums[f'missed_{name}'] for each in counts))] for name in LABELS)]),
                  Table('Gestures', [['', 'figure'], *([labelled[name].text, labelled[name]] for name in POINTING)]),
                  *tables]
    return Section(f'{len(counts)} scenes with labels, {len(plain)} without, mode balanced; a label counts in each '
                   f'frame, without those within {MARGIN:g} s of its beginning or end. Pointing: angle between the ray '
                   'and the true target; frames without a ray count as wrong. In scenes without labels, gestures are '
                   'compared with those of the true joints, within half a second. Intervals of labels: bootstrap over '
                   'scenes, of less than five over their seconds.', {**named, **labelled}, tables)


def has_labels(folder: Path) -> bool:
    """Return whether the truth of a scene has labels."""
    return 'targets' in json.loads((folder / 'gt.json').read_text())


def read(program: object, folder: Path, counts: Counts) -> object:
    """Return a scene with the people that were found there."""
    truth = json.loads((folder / 'gt.json').read_text())['frames'][:int(counts.sums['frames'])]
    return program.read_sequence(folder, people_of(counts, [frame['t'] for frame in truth]))


def false_gestures(program: object, folder: Path, counts: Counts) -> Counts:
    """Return the seconds of a scene, and the gestures that its true joints do not make."""
    sequence = read(program, folder, counts)
    found = program.gestures(sequence, sequence.read(sequence.found))
    seconds = sequence.found[-1][0] - sequence.found[0][0]
    return Counts(counts.scene, counts.tags, {'false': sum(not also for *_, also in found), 'seconds': seconds}, {})

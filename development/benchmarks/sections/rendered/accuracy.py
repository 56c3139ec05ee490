"""Accuracy in 3D, on rendered scenes."""
from typing import Any, Dict

from results import Options, Section, Table
from results.counting import count
from scoring.counts import by_tag, by_value
from scoring.figures import figures_of, named, rows_of
from scoring.people import FEET_STATISTICS, FEET_TABLE, SHORT_TABLE, STATISTICS, UPRIGHT

# What each row runs: parameters of the chain, true pixels, one of so many scenes.
ROWS: Dict[str, Dict[str, Any]] = {
    'balanced': {'settings': {'mode': 'balanced'}},
    "the original's method, mobilenet_thin": {
        'settings': {'pose_model': 'mobilenet_thin', 'lifting': 'mean3x3', 'tracking': False}, 'every': 2},
    'true pixels, balanced': {'settings': {'mode': 'balanced'}, 'exact': True}}
# Columns of the table by kind of scene.
KINDS = {name: SHORT_TABLE[name] for name in ('persons_recall', 'visible_100', 'hidden_150', 'lies')}
SHORT = {'balanced': '', "the original's method, mobilenet_thin": 'original', 'true pixels, balanced': 'exact'}


def measure(options: Options) -> Section:
    """Measure the chain, the method of the original, and the chain with true pixels."""
    counts = {title: count(options, **row) for title, row in ROWS.items()}
    whole, methods = counts['balanced'], figures_of(counts, STATISTICS)
    found = named({SHORT[title]: each for title, each in methods.items()})
    kinds = figures_of(by_tag(whole, 'kind'), STATISTICS)
    tables = [Table('All scenes', rows_of(methods, SHORT_TABLE, 'method')),
              *([Table('By kind of scene, balanced', rows_of(kinds, KINDS, 'kind'))] if len(kinds) > 1 else [])]
    upright = [each for each in whole if each.tags['kind'] in UPRIGHT and len(each.rows['feet'])]
    if upright:
        feet = figures_of({'all': upright, **by_value(upright, 'feet', 'joint', {
            'big toes': [0, 3], 'small toes': [1, 4], 'heels': [2, 5]})}, FEET_STATISTICS)
        found.update(feet['all'])
        tables.append(Table('Visible toes and heels of people who stand and walk, balanced',
                            rows_of(feet, FEET_TABLE, '')))
    frames = int(sum(each.sums['frames'] for each in whole))
    return Section(f'{len(whole)} scenes with {frames} frames. Errors are distances from the true joint in the body. '
                   'Shares count all joints of their kind, those that are not given as wrong. Lies: hidden joints that '
                   'are called MEASURED and are wrong by more than 150 mm.', found, tables)

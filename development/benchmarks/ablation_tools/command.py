"""The command line of the ablations of signals, fusion and hands: figures as they are, and a row for each constant."""
import argparse
import json
import sys
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence

import numpy as np

from ablation_tools.changes import Change, Changes, Counts, changes, verdict
from ablation_tools.variants import FACTORS, NEAR_FACTORS, WITHOUT, Paths, Values, text_of, variants
from common import markdown

Suites = Mapping[str, Callable[[Any], Counts]]
"""By name: what counts for constants."""


def least(figure: str) -> float:
    """Return the change of a figure below which there is none: of shares and seconds, and of millimetres."""
    return 0.5 if figure.endswith('mm') else 0.005


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that these ablations have."""
    parser.add_argument('--only', default='', help='constants whose dotted names begin like this')
    parser.add_argument('--suites', nargs='*', default=(), help='these alone')
    parser.add_argument('--before', type=Path, help='counts to compare with; the file is written if it is not there')
    parser.add_argument('--near', action='store_true', help='factors 0.8 and 1.25: which constants are fragile')
    parser.add_argument('--cache', type=Path, default=Path('logs/ablation'), help='folder for what the chain finds')


def run(paths: Paths, changed: Callable[[Values], Any], suites: Suites, of_group: Mapping[str, Sequence[str]],
        arguments: argparse.Namespace) -> None:
    """Print the figures of constants, and the table of their ablation.

    Args:
        paths: of the constants.
        changed: gives the suites their constants, by values that differ from the present ones.
        of_group: suites that the constants of a group can change, all where it is not named.
    """
    suites = {name: score for name, score in suites.items() if not arguments.suites or name in arguments.suites}
    base = {suite: score(changed({})) for suite, score in suites.items()}
    print_base(base, arguments.before)
    paths = [(name, value) for name, value in paths if name.startswith(arguments.only)]
    factors = NEAR_FACTORS if arguments.near else FACTORS
    found: Dict[str, Changes] = {}
    for variant in variants(paths, factors, without=not arguments.near):
        group = next(iter(variant.constants)).partition('.')[0]
        constants = changed(variant.constants)
        found[variant.name] = {
            figure: change for suite in of_group.get(group, suites) if suite in suites
            for figure, change in changes(base[suite], suites[suite](constants), least).items()}
        print(variant.name, _moved(found[variant.name]), file=sys.stderr, flush=True)
    hows = [*factors] if arguments.near else [*factors, WITHOUT]
    rows = [(name, text_of(value), [found.get(f'{name} {how}', {}) for how in hows]) for name, (value, _) in paths]
    print(markdown([('constant', 'value', *hows, 'verdict'),
                    *((name, text, *map(_moved, row), verdict(row)) for name, text, row in rows)]))


def print_base(base: Mapping[str, Counts], path: Optional[Path]) -> None:
    """Print the figures of all suites, and how they differ from those in a file; without one it is written."""
    if path and not path.is_file():
        path.write_text(json.dumps({suite: {figure: values.tolist() for figure, values in counts.items()}
                                    for suite, counts in base.items()}))
    before = json.loads(path.read_text()) if path else {}
    rows: List[Sequence[str]] = [('figure', 'value', 'units', 'change', '')]
    for suite, counts in base.items():
        known = {figure: np.array(before.get(suite, {}).get(figure, counts[figure])) for figure in counts}
        for figure, change in changes(known, counts, least).items():
            top, bottom = counts[figure].T
            rows.append((figure, f'{top.sum() / max(bottom.sum(), 1e-12):.4f}', str(np.count_nonzero(bottom)),
                         _text(change) if change.value else '', 'beyond noise' if change.is_clear else ''))
    print(markdown(rows))


def _text(change: Change) -> str:
    return f'{change.value:+.3f} [{change.low:+.3f}, {change.high:+.3f}]'


def _moved(found: Changes) -> str:
    """Return the figures that change beyond noise, for the table."""
    return '; '.join(f'{figure} {_text(change)}' for figure, change in found.items() if change.is_clear) or '-'

"""The time report as text: tables in Markdown, rows of CSV, a summary for JSON. Durations in it are milliseconds."""
from dataclasses import astuple
from typing import Dict, Iterator, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_tools.delays.stage_delays import ROLES, Chain, Spread, steps

CSV_COLUMNS = ('namespace', 'stage', 'topic', 'stamp_ns', 'arrival_ns', 'delay_ms')
_SPREAD_COLUMNS = ('median', 'mean', '95 %', 'max', 'min')


def summary(chain: Chain) -> Dict[str, object]:
    """Return all figures of a chain as JSON has them; durations in ms, None where not known."""
    delays = chain.delays
    return {
        'namespace': chain.namespace, 'live': chain.is_live, 'counted_from': chain.counted_from,
        'frames': len(chain.frames), 'notes': list(chain.notes),
        'stages': [{'stage': stage.role, 'topic': stage.topic, 'messages': stage.messages,
                    'frames': int(chain.reached[:, number].sum()),
                    'share': _or_none(chain.shares[number]), 'rate_hz': _or_none(stage.rate),
                    'delay_ms': _milliseconds(Spread.of(delays[:, number]))}
                   for number, stage in enumerate(chain.stages)],
        'steps': [{'from': step.before, 'to': step.after, 'step_ms': _milliseconds(Spread.of(step.seconds))}
                  for step in steps(chain)]}


def markdown(chain: Chain) -> str:
    """Return the report of a chain: notes and tables."""
    since = {'stamp': 'from the stamp of the camera', 'arrival': 'from the first camera message of the frame'}
    what = f'Delays [ms] {since[chain.counted_from]} to the recorder' if chain.is_live else 'Stages, without delays'
    parts = [f'## {chain.namespace}', *[f'Note: {note}' for note in chain.notes],
             f'{len(chain.frames)} frames. {what}:']
    delays = chain.delays
    parts.append(_table(
        ('stage', 'topic', 'messages', 'frames', 'share', 'Hz', *_SPREAD_COLUMNS),
        [(ROLES[stage.role], stage.topic, str(stage.messages), str(int(chain.reached[:, number].sum())),
          f'{100 * chain.shares[number]:.1f} %', _number(stage.rate), *_cells(Spread.of(delays[:, number])))
         for number, stage in enumerate(chain.stages)], texts=2))
    found = steps(chain)
    if found:
        parts += ['Steps between the stages [ms], of the frames that have both:',
                  _table(('from', 'to', 'frames', *_SPREAD_COLUMNS),
                         [(step.before_name, ROLES[step.after], str(spread.count), *_cells(spread))
                          for step in found for spread in [Spread.of(step.seconds)]], texts=2)]
        if any((step.seconds < 0).any() for step in found):
            parts.append('A step is negative where the recorder got the later stage first: each topic comes to it by a '
                         'connection of its own.')
    return '\n\n'.join(parts) + '\n'


def csv_rows(chain: Chain) -> Iterator[Tuple[str, ...]]:
    """Yield a row of CSV_COLUMNS for each stage that a frame reached; no delay where that is not known."""
    delays = chain.delays
    for number, stage in enumerate(chain.stages):
        for frame in np.flatnonzero(chain.reached[:, number]).tolist():
            delay = 1000 * delays[frame, number]
            yield (chain.namespace, stage.role, stage.topic, str(chain.stamps[frame, number]),
                   str(chain.arrivals[frame, number]), f'{delay:.6f}' if np.isfinite(delay) else '')


def _cells(spread: Spread) -> Tuple[str, ...]:
    return tuple(_number(1000 * value) for value in astuple(spread)[1:])


def _number(value: float) -> str:
    return f'{value:.1f}' if np.isfinite(value) else '-'


def _milliseconds(spread: Spread) -> Dict[str, Optional[float]]:
    return {'count': spread.count, **{name: _or_none(1000 * value) for name, value in zip(
        ('median', 'mean', 'p95', 'max', 'min'), astuple(spread)[1:])}}


def _or_none(value: float) -> Optional[float]:
    return round(value, 6) if np.isfinite(value) else None


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], texts: int) -> str:
    """Return a table in Markdown with aligned columns.

    Args:
        texts: number of columns with texts, which come first; the others have numbers.
    """
    widths = [max(len(row[column]) for row in [head, *rows]) for column in range(len(head))]

    def line(cells: Sequence[str]) -> str:
        return '| ' + ' | '.join(cell.ljust(width) if column < texts else cell.rjust(width)
                                 for column, (cell, width) in enumerate(zip(cells, widths))) + ' |'

    rule = '|' + '|'.join('-' * (width + 2) if column < texts else '-' * (width + 1) + ':'
                          for column, width in enumerate(widths)) + '|'
    return '\n'.join([line(head), rule, *map(line, rows)])

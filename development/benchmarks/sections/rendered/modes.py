"""Accuracy against time, by mode and network."""
from typing import Any, Dict

from development.results import read_results
from results import Options, Section, Table
from results.counting import count
from results.plots import trade_off
from scoring.figures import figures_of, named, rows_of
from scoring.people import SHORT_TABLE, STATISTICS

# Parameters of the chain and, for slow ones, one of so many scenes; by the name of their figures.
ROWS: Dict[str, Dict[str, Any]] = {
    'fast': {'settings': {'mode': 'fast'}, 'every': 2},
    'balanced': {'settings': {'mode': 'balanced'}, 'every': 2},
    'accurate': {'settings': {'mode': 'accurate'}, 'every': 10},
    'mobilenet_thin': {'settings': {'pose_model': 'mobilenet_thin'}, 'every': 4},
    'movenet_multipose': {'settings': {'pose_model': 'movenet_multipose'}, 'every': 4},
    'followed_12': {'settings': {'mode': 'balanced'}, 'budget': 1.2, 'every': 4},
    'followed_06': {'settings': {'mode': 'balanced'}, 'budget': 0.6, 'every': 4},
    'followed_03': {'settings': {'mode': 'balanced'}, 'budget': 0.3, 'every': 4}}
TITLES = {'mobilenet_thin': 'mobilenet_thin alone', 'movenet_multipose': 'movenet_multipose alone',
          **{f'followed_{name}': f'followed, {work} passes'
             for name, work in (('12', 1.2), ('06', 0.6), ('03', 0.3))}}


def measure(options: Options) -> Section:
    """Count all modes on a part of the scenes; times are those of the section on speed, where it was measured."""
    found = figures_of({name: count(options, **row) for name, row in ROWS.items()}, STATISTICS)
    times = read_results().get('speed', {}).get('figures', {})
    points = {TITLES.get(name, name): (times[f'{name}_ms']['value'], found[name]['visible_100'])
              for name in ROWS if f'{name}_ms' in times}
    pictures = [trade_off('modes', 'Share of the visible joints within 100 mm against the time of a frame', points, {
        'x': 'ms per frame', 'y': 'visible joints within 100 mm'})] if points else ()
    table = rows_of({TITLES.get(name, name): each for name, each in found.items()}, SHORT_TABLE, 'mode')
    return Section('Slow modes are measured on a part of the scenes, evenly from the list, so compare rows by their '
                   'intervals. Followed: people are tracked on crops, with that many passes of '
                   'mobilenet_thin over 656 x 368 per frame (`target_rate` does so live).', named(found),
                   [Table('', table)], pictures)

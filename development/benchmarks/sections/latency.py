"""Latency of the running nodes, by number of people."""
import argparse
from pathlib import Path
from typing import Any, List

import numpy as np

import live
from common import on_a_master
from results import Options, Section, Table
from results.plots import curves
from scoring.figures import Figure

RATES, PEOPLE, SECONDS = (15.0, 30.0), (1, 2, 5, 8), 15.0
COLUMNS = ('camera [Hz]', 'people', 'T [ms]', 'results [Hz]', 'latency median / 95 % [ms]', 'in T',
           'people published, mean', 'start [s]')


def measure(options: Options) -> Section:
    """Measure `./run bench live` with depth images, mode balanced, people followed."""
    rows: List[List[object]] = [[*COLUMNS]]
    named = {}
    for row, latencies, found in on_a_master(watch, options.quick):
        row = {**row, 'people published, mean': f'{found.mean():.1f}'}
        rows.append([row[column] for column in COLUMNS])
        name = f"at_{row['camera [Hz]']:.0f}_with_{row['people']}"
        for key, value, unit in (('median', 1e3 * np.median(latencies), 'ms'),
                                 ('late', 1e3 * np.percentile(latencies, 95), 'ms'),
                                 ('rate', row['results [Hz]'], 'Hz')):
            named[f'{name}_{key}'] = Figure(float(value), n=len(latencies), unit=unit, digits=int(unit == 'Hz'))
    people, rates = (sorted({row[column] for row in rows[1:]}) for column in (1, 0))
    lines = {f'{rate:.0f} Hz, {title}': (people, [named[f'at_{rate:.0f}_with_{count}_{key}'].value
                                                 for count in people])
             for rate in rates for key, title in (('median', 'median'), ('late', '95 %'))}
    picture = curves('latency', 'Latency by number of people, cameras of 15 and 30 Hz', lines,
                     {'x': 'people', 'y': 'latency [ms]'})
    return Section('The launched chain, mode balanced, with depth images of 960 x 540 from a camera driver, '
                   '`target_rate` that of the camera: people are followed. Latency: from the stamp of the camera to '
                   f'the arrival of the 3D message in a subscriber, {SECONDS:.0f} s a row. The people are those of the '
                   'demo, cut out and pasted, and turn back at once, where tracks are lost: more are published.', named,
                   [Table('', rows)], [picture])


def watch(session: Any, folder: Path, quick: bool) -> List[Any]:
    """Return what `live.measure_all` does."""
    rates, people, seconds = (RATES[:1], PEOPLE[:1], 5.0) if quick else (RATES, PEOPLE, SECONDS)
    return live.measure_all(session, folder, argparse.Namespace(
        rates=rates, people=people, seconds=seconds, launch=[]))

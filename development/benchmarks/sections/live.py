"""Accuracy of the running nodes."""
import argparse
import importlib
from pathlib import Path
from typing import Any, Sequence

import numpy as np

from results import Options, Section, Table
from results.separate import on_a_master
from scoring.figures import Figure, figures
from scoring.people import SHORT_TABLE, STATISTICS
from scoring.tables import rows_of

# Frames per second that scenes are played at; 5 Hz: what a machine three times as fast does at 15 Hz.
RATES = (15.0, 5.0)
EVERY = 4


def measure(options: Options) -> Section:
    """Play scenes into the launched chain, as `./run bench accuracy live` does, and score the results."""
    folders = [*options.scenes[:1]] if options.quick else [*options.scenes[::EVERY]]
    played = {f'{rate:g} Hz': on_a_master(play, folders, rate) for rate in RATES}
    counts = {title: each for title, (each, _) in played.items()}
    named, late = {}, [['played at', 'frames', 'answered', 'latency median [ms]', '95 % [ms]']]
    for title, (each, latencies) in played.items():
        name = f"at_{title.split(' ')[0]}"
        named.update({f'{name}_{key}': figure for key, figure in figures(each, STATISTICS).items()})
        middle, most = 1e3 * np.percentile(latencies, (50, 95))
        named[f'{name}_latency'] = Figure(float(middle), n=len(latencies), unit='ms', digits=0)
        late.append([title, int(sum(one.sums['frames'] for one in each)), len(latencies), f'{middle:.0f}',
                     f'{most:.0f}'])
    return Section('Scenes are played into the launched chain as a camera does, once each; `mode` balanced, depth '
                   'images, people are followed. A frame without a result counts as one in which no person was found.',
                   named, [Table('', rows_of(counts, STATISTICS, SHORT_TABLE, 'played at')), Table('Latency', late)])


def play(session: Any, folder: Path, folders: Sequence[Path], rate: float) -> Any:
    """Return the counts of each scene and the latencies of all frames [s]."""
    program = importlib.import_module('accuracy.live')
    arguments = argparse.Namespace(sequences=folders, rate=rate, points='depth_image', out=None,
                                   launch=[f'target_rate:={rate}'])
    counts, latencies = program.play_all(session, folder, arguments)
    return counts, [late for each in latencies for late in each]

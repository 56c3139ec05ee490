"""Time of a frame, without ROS."""
import importlib
from typing import Any, Dict, List

import numpy as np

import chain_runs
from openpose_ros_pkg.params.parameters import build
from results import Options, Section, Table
from results.machine import Unit
from scoring.figures import Figure
from sections.rendered.modes import ROWS, TITLES
from skeleton_extract_3d.chain_settings import ChainSettings
from skeleton_extract_3d.settings import EstimatorSettings

# Frames of each mode, from several scenes in turn; those of an accurate one; first frames that do not count.
FRAMES, FEW, WARM_UP, SCENES = 40, 10, 3, 4
PEOPLE, ROUNDS = (1, 2, 5, 10, 20), 100


def measure(options: Options) -> Section:
    """Time the modes on some frames of scenes, and people in space on synthetic ones, with T before each."""
    unit, named = Unit(), {}
    rows: List[List[object]] = [['mode', 'T [ms]', '2D [ms]', '3D [ms]', 'frame [ms]', '95 % [ms]', 'frame in T']]
    for name, row in ROWS.items():
        before = unit.milliseconds()
        times = 1e3 * np.array(timed(options, row, FEW if name == 'accurate' or options.quick else FRAMES))
        whole = times.sum(axis=1)
        middle, most = np.percentile(whole, (50, 95))
        rows.append([TITLES.get(name, name), f'{before:.0f}', *(f'{each:.1f}' for each in np.median(times, axis=0)),
                     f'{middle:.0f}', f'{most:.0f}', f'{middle / before:.2f}'])
        named[f'{name}_ms'] = Figure(float(middle), n=len(whole), unit='ms', digits=0, text='median of a frame')
        named[f'{name}_t'] = Figure(float(middle / before), n=len(whole), digits=2, text='median of a frame in T')
    people, cost = of_people(5 if options.quick else ROUNDS)
    named['person_ms'] = Figure(cost, unit='ms', digits=2, text='of one person more in space')
    return Section(f'Scenes of the section on accuracy, first frames of {SCENES} of them, on all cores; median and 95 '
                   '% of the frames. 2D: networks, decoding, votes; 3D: lifting and tracking.', named,
                   [Table('Modes', rows), Table('People in space (3D) by their number, synthetic', people)])


def timed(options: Options, row: Dict[str, Any], frames: int) -> List[Any]:
    """Return the times of frames in 2D and 3D [s]."""
    times: List[Any] = []
    finder = None
    for folder in options.scenes[:SCENES]:
        sequence = chain_runs.open_sequence(folder)
        finder = finder or chain_runs.Finder(build(ChainSettings, {**row['settings'], **options.settings}),
                                             row.get('budget', 0.0), sequence.fps or 1.0)
        times += finder.run(sequence, limit=WARM_UP + frames // SCENES).times[WARM_UP:]
    return times


def of_people(rounds: int) -> Any:
    """Return the table of the time of people in space by their number, and the cost of one more [ms]."""
    frames = importlib.import_module('speed.3d').measure([*PEOPLE], rounds, build(EstimatorSettings, {}))
    medians, late = frames.groupby('people').median(), frames.groupby('people').whole.quantile(0.95)
    rows = [['people', 'in view', 'median [ms]', '95 % [ms]'],
            *([number, f"{medians['in view'][number]:.0f}", f'{medians.whole[number]:.2f}', f'{late[number]:.2f}']
              for number in PEOPLE)]
    return rows, float(np.polyfit(medians['in view'], medians.whole, 1)[0])

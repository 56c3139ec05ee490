"""Stated errors: sigma against the errors."""
from dataclasses import replace
from typing import Dict, List, Sequence

import numpy as np
from scipy.stats import chi2

from openpose_ros_pkg.skeletons import COCO_18
from results import Options, Section, Table
from results.counting import count
from results.plots import curves
from scoring.counts import Counts, by_bin, by_tag, by_value
from scoring.figures import Quantile, figures
from scoring.people import within_sigmas
from scoring.tables import rows_of
from sections.rendered.errors import DISTANCES, JOINTS
from skeleton_extract_3d.people import INFERRED, MEASURED
from skeleton_extract_3d.track.calibration import change, kinds_of, mean_score

# Multiples of sigma of the curve; bins of stated sigma [m]; joints that a bin needs.
MULTIPLES = np.arange(0.25, 3.01, 0.25)
BINS = (0.0, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 1.0)
LEAST = 300
STATISTICS = {'within_1_sigma': within_sigmas(1), 'within_2_sigma': within_sigmas(2),
              'stated': Quantile('median sigma', lambda each: each.rows['joints']['sigma'][
                  np.isfinite(each.rows['joints']['sigma'])], 0.5, 'mm', 1, 1e3)}
COLUMNS = {'stated': 'sigma, median [mm]', 'within_1_sigma': 'within 1 sigma', 'within_2_sigma': 'within 2 sigma'}


def expected(multiple: float) -> float:
    """Return the share of errors within that many sigma if they are normal and alike in all directions."""
    return float(chi2.cdf(3 * multiple ** 2, 3))


def measure(options: Options) -> Section:
    """Count how many errors of mode balanced are within multiples of sigma, in all and by what is known of a joint."""
    counts = count(options, {'mode': 'balanced'})
    statistics = {f'within_{multiple:g}_sigma'.replace('.', '_'): within_sigmas(multiple) for multiple in MULTIPLES}
    groups, lines = by_status(counts), {}
    for text, each in (('', groups), (', before calibration', by_status([uncalibrated(one) for one in counts]))):
        shares = {name: figures(part, statistics) for name, part in each.items()}
        lines.update({f'{name} joints{text}': (MULTIPLES, [figure.value for figure in part.values()], [*part.values()])
                      for name, part in shares.items() if None not in [figure.value for figure in part.values()]})
    picture = curves('sigma', 'Share of joints whose error is within a multiple of sigma, with 95 % intervals', {
        **lines, 'expected of normal errors': (MULTIPLES, [expected(each) for each in MULTIPLES], None)},
        {'x': 'multiple of sigma', 'y': 'share of errors'})
    bins = {'all': counts, **groups, **{f'{1e3 * low:g}-{1e3 * high:g} mm': each for (low, high), each in zip(
        zip(BINS, BINS[1:]), by_bin(counts, 'joints', 'sigma', BINS).values())}}
    for name, each in groups.items():
        bins.update({f'{joint}, {name}': one for joint, one in by_value(each, 'joints', 'joint', JOINTS).items()})
    bins.update({f'{name} m away': each for name, each in by_bin(counts, 'joints', 'distance', DISTANCES).items()})
    bins.update({f'scene: {name}': each for name, each in by_tag(counts, 'kind').items()})
    bins = {name: each for name, each in bins.items() if within_sigmas(2).size(each) >= LEAST}
    named = {f'{name.lower()}_{key}': figure for name in ('all', *groups) if name in bins
             for key, figure in figures(bins[name], STATISTICS).items()}
    return Section('Of 100 errors, 95 are to be within 2 sigma; sigma is fitted to other scenes (`./run bench '
                   f'calibration`). Of normal errors, alike in all directions, {expected(1):.2f} would be within 1 '
                   'sigma: those of people are more often small and more often great. All joints with a position in '
                   'the scenes of the section on accuracy, mode balanced.', named,
                   [Table('', rows_of(bins, STATISTICS, COLUMNS, 'joints'))], [picture])


def by_status(counts: Sequence[Counts]) -> Dict[str, List[Counts]]:
    """Return the counts with the joints of each status."""
    return by_value(counts, 'joints', 'status', {'MEASURED': [MEASURED], 'INFERRED': [INFERRED]})


def uncalibrated(counts: Counts) -> Counts:
    """Return counts with sigma as it is before its calibration, by bisection: calibrated sigma grows with it."""
    rows = counts.rows['joints'].reshape(-1, len(COCO_18.joints))
    evidence, inferred = (rows['score'], mean_score(rows['score']), rows['distance']), rows['status'] == INFERRED
    kinds, low, high = kinds_of(COCO_18.joints), rows['sigma'] / 10, rows['sigma'] * 10
    for _ in range(30):
        middle = np.sqrt(low * high)
        over = middle * np.exp(change((middle, *evidence), inferred, kinds)) > rows['sigma']
        low, high = np.where(over, low, middle), np.where(over, middle, high)
    joints = counts.rows['joints'].copy()
    joints['sigma'] = low.ravel()
    return replace(counts, rows={**counts.rows, 'joints': joints})

"""Stated errors: sigma against the errors."""
from dataclasses import replace
from typing import Dict, List, Sequence

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from results import Options, Section, Table
from results.counting import count
from results.plots import by_group
from scoring.counts import Counts, by_bin, by_tag, by_value
from scoring.figures import Quantile, figures_of, named, rows_of
from scoring.people import within_sigmas
from sections.rendered.errors import DISTANCES, JOINTS
from skeleton_extract_3d.people import INFERRED, MEASURED
from skeleton_extract_3d.track.calibration import change, kinds_of, share_measured

# Bins of stated sigma [m]; joints that a bin needs.
BINS = (0.0, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 1.0)
LEAST = 300
STATISTICS = {'stated': Quantile('median sigma', lambda each: each.rows['joints']['sigma'][
                  np.isfinite(each.rows['joints']['sigma'])], 0.5, 'mm', 1, 1e3),
              'within_1_sigma': within_sigmas(1), 'within_2_sigma': within_sigmas(2)}
COLUMNS = {'stated': 'sigma, median [mm]', 'within_1_sigma': 'within 1 sigma', 'within_2_sigma': 'within 2 sigma'}


def measure(options: Options) -> Section:
    """Count how many errors of mode balanced are within sigma and twice that, by what is known of a joint."""
    counts = count(options, {'mode': 'balanced'})
    bins, before = bins_of(counts), bins_of([uncalibrated(each) for each in counts])
    found, bare = figures_of(bins, STATISTICS), figures_of(before, STATISTICS)
    picture = by_group('sigma', 'Errors within sigma and twice sigma, before and after its calibration', {
        f'share within {number} sigma': {title: (groups, f'within_{number}_sigma') for title, groups in (
            ('calibrated', found), ('before', bare))} for number in (1, 2)})
    whole = {name.lower(): each for name, each in found.items() if name in ('all', 'MEASURED', 'INFERRED')}
    shown = {name: each for name, each in found.items() if name.lower() in whole or 'mm' in name}
    return Section('Sigma is calibrated on other scenes: of 100 joints 95 are to be within 2 sigma; within 1 are more '
                   'than the 42 of normal errors. Scenes of the section on accuracy, mode balanced.', named(whole),
                   [Table('', rows_of(shown, COLUMNS, 'joints'))], [picture])


def bins_of(counts: Sequence[Counts]) -> Dict[str, List[Counts]]:
    """Return the scenes with joints of each status, kind, sigma, distance and kind of scene, where these are many."""
    groups = by_value(counts, 'joints', 'status', {'MEASURED': [MEASURED], 'INFERRED': [INFERRED]})
    bins = {'all': [*counts], **groups}
    bins.update({f'{1e3 * low:g}-{1e3 * high:g} mm': each for low, high, each in zip(
        BINS, BINS[1:], by_bin(counts, 'joints', 'sigma', BINS).values())})
    for name, each in groups.items():
        bins.update({f'{joint}, {name}': one for joint, one in by_value(each, 'joints', 'joint', JOINTS).items()})
    bins.update({f'{name} m away': each for name, each in by_bin(counts, 'joints', 'distance', DISTANCES).items()})
    bins.update({f'scene: {name}': each for name, each in by_tag(counts, 'kind').items()})
    return {name: each for name, each in bins.items() if within_sigmas(2).size(each) >= LEAST}


def uncalibrated(counts: Counts) -> Counts:
    """Return counts with sigma before its calibration, by bisection, as calibrated sigma grows with it.

    It takes the true distance in place of the estimated one.
    """
    rows = counts.rows['joints'].reshape(-1, len(COCO_18.joints))
    evidence, inferred = (share_measured(rows['status']), rows['distance']), rows['status'] == INFERRED
    kinds, low, high = kinds_of(COCO_18.joints), rows['sigma'] / 10, rows['sigma'] * 10
    for _ in range(30):
        middle = np.sqrt(low * high)
        over = middle * np.exp(change((middle, *evidence), inferred, kinds)) > rows['sigma']
        low, high = np.where(over, low, middle), np.where(over, middle, high)
    joints = counts.rows['joints'].copy()
    joints['sigma'] = low.ravel()
    return replace(counts, rows={**counts.rows, 'joints': joints})

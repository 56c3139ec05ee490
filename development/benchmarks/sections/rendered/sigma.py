"""Stated errors: sigma against the errors."""
import numpy as np
from scipy.stats import chi2

from results import Options, Section, Table
from results.counting import count
from results.plots import curves
from scoring.counts import by_bin, by_value
from scoring.figures import Quantile, figures
from scoring.people import within_sigmas
from scoring.tables import rows_of
from skeleton_extract_3d.people import INFERRED, MEASURED

# Multiples of sigma of the curve; bins of stated sigma [m].
MULTIPLES = np.arange(0.25, 3.01, 0.25)
BINS = (0.0, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 1.0)
# Share of the errors within 1 sigma, the root mean square of the distance, if the three axes are normal and alike.
WITHIN_1 = float(chi2.cdf(3, 3))


def expected(multiple: float) -> float:
    """Return the share of errors within that many sigma if they are normal and alike in all directions."""
    return float(chi2.cdf(3 * multiple ** 2, 3))


def measure(options: Options) -> Section:
    """Count how many errors of mode balanced are within multiples of sigma, and how large they are for each sigma."""
    counts = count(options, {'mode': 'balanced'})
    groups = by_value(counts, 'joints', 'status', {'MEASURED': [MEASURED], 'INFERRED': [INFERRED]})
    statistics = {f'within_{multiple:g}_sigma'.replace('.', '_'): within_sigmas(multiple) for multiple in MULTIPLES}
    shares = {name: figures(each, statistics) for name, each in groups.items()}
    lines = {f'{name} joints': (MULTIPLES, [figure.value for figure in each.values()], [*each.values()])
             for name, each in shares.items() if None not in [figure.value for figure in each.values()]}
    picture = curves('sigma', 'Share of joints whose error is within a multiple of sigma, with 95 % intervals', {
        **lines, 'expected of normal errors': (MULTIPLES, [expected(each) for each in MULTIPLES], None)},
        {'x': 'multiple of sigma', 'y': 'share of errors'})
    size = {'error': Quantile('error of 61 %', lambda each: each.rows['joints']['error'][
        np.isfinite(each.rows['joints']['error'])], WITHIN_1, 'mm', 1, 1e3),
            'stated': Quantile('median sigma', lambda each: each.rows['joints']['sigma'][
                np.isfinite(each.rows['joints']['sigma'])], 0.5, 'mm', 1, 1e3),
            'within_2_sigma': within_sigmas(2)}
    columns = {'stated': 'sigma, median [mm]', 'error': '61 % of the errors are within [mm]',
               'within_2_sigma': 'within 2 sigma'}
    bins = {f'{1e3 * low:g}-{1e3 * high:g} mm': each for (low, high), each in zip(
        zip(BINS, BINS[1:]), by_bin(counts, 'joints', 'sigma', BINS).values())}
    named = {f'{name.lower()}_{key}': shares[name][key]
             for name in groups for key in ('within_1_sigma', 'within_2_sigma')}
    return Section('Sigma is the root mean square of the distance between the given and the true position. Of normal '
                   f'errors, alike in all directions, {expected(1):.2f} are within 1 sigma, {expected(2):.3f} within '
                   '2 sigma. All joints with a position in the scenes of the section on accuracy, mode balanced.',
                   named,
                   [Table('By the stated sigma', rows_of(bins, size, columns, 'sigma'))], [picture])

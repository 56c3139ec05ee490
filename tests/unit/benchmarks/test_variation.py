"""Ablations: variants of nested constants, changes of figures beyond noise, and what they say."""
from dataclasses import dataclass

import numpy as np
import pytest

from ablations.variation import ALWAYS, FACTORS, WITHOUT, Sums, changes, counts_of, names_of, variants, verdict
from openpose_ros_pkg.params.constants import constant


@dataclass(frozen=True)
class Part:
    ramp: tuple = constant((1.0, 2.0), 'A condition.', unit='m')
    count: int = constant(3, 'A number.')
    share: float = constant(0.7, 'A share.')


@dataclass(frozen=True)
class Whole:
    part: Part = Part()


def test_variants_change_one_constant_each():
    found = {(one.name, one.how): one.constants.part for one in variants(Whole(), list(names_of(Whole())), FACTORS)}
    assert len(found) == 7
    assert found['part.ramp', 'twice'].ramp == (2.0, 4.0) and found['part.ramp', WITHOUT].ramp == ALWAYS
    assert found['part.count', 'half'].count == 2 and found['part.share', 'twice'].share == 1.0
    assert all((one.ramp != (1.0, 2.0)) + (one.count != 3) + (one.share != 0.7) == 1 for one in found.values())


def units(rates, figure='found'):
    """Return the counts of units of which each has this share of 50."""
    sums = [Sums() for _ in rates]
    for one, rate in zip(sums, rates):
        one.add(figure, 50 * rate, 50)
    return counts_of(sums)


@pytest.mark.parametrize('after, is_clear', [(np.full(20, 0.5), False), (np.full(20, 0.4), True),
                                             (np.r_[np.full(10, 0.4), np.full(10, 0.6)], False)])
def test_a_change_is_clear_where_units_agree(after, is_clear):
    change = changes(units(np.full(20, 0.5)), units(after))['found']
    assert change.value == pytest.approx(after.mean() - 0.5) and change.is_clear == is_clear
    assert change.low <= change.value <= change.high


def test_verdicts():
    base, less, more = (units(np.full(20, rate)) for rate in (0.5, 0.4, 0.6))
    same, worse, better = (changes(base, other) for other in (base, less, more))
    assert verdict([same, same]) == 'idle here'
    assert verdict([worse, same]) == verdict([worse, better]) == 'earns its place'
    assert verdict([worse, worse]) == 'fragile'
    missed = changes(units(np.full(20, 0.1), 'missed'), units(np.full(20, 0.2), 'missed'))
    assert verdict([missed, missed]) == 'fragile'

"""The boundary of the compiled modules: arrays of wrong shapes, types, indices or numbers are refused or computed,
never read beyond their end.
"""
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fuzzing import NUMBERS, survives
from skeleton_extract_3d.constants import METHOD

# What pybind11 raises for arguments of another type, and the modules for other shapes and indices.
REFUSALS = (TypeError, ValueError, IndexError)
P, J, S, BONES = 2, 18, 25, 8
STEPS = METHOD.costs.steps
COMPILED = METHOD.compiled


def filled(*shape, value=0.5, dtype=np.float64):
    return np.full(shape, value, dtype)


SAMPLES, SCORES, FLAGS = filled(P, J, S, value=2.0), filled(P, J), np.ones((P, J), bool)
FOREIGN = np.zeros((P, J, S), bool)
STATE = [filled(P, J, 3), filled(P, J, 3), *(filled(P, J, 3, 3) for _ in range(3))]
SIZES = [filled(P, value=1.7), filled(P), filled(P, BONES), filled(P, BONES)]
# Function and arguments as the method calls it.
CALLS = {
    'root_evidence': (COMPILED.root_evidence, [SAMPLES, SCORES, FOREIGN]),
    'depth_costs': (COMPILED.depth_costs, [SAMPLES, SCORES, filled(P), SCORES, SCORES, SCORES, FLAGS, FOREIGN]),
    'others_depths': (COMPILED.others_depths, [filled(P, J, 2), SCORES, 500.0]),
    'covered_by_self': (COMPILED.covered_by_self, [filled(P, J, 2), filled(P), 500.0]),
    'measure': (COMPILED.measure, [[filled(P, J, 3), SCORES, FLAGS, SAMPLES], SCORES, SCORES, FOREIGN,
                                   filled(P, BONES)]),
    'estimate_head_pose': (COMPILED.estimate_head_pose, [filled(P, J, 3), SCORES, filled(P), filled(P), filled(P)]),
    'infer_depths': (COMPILED.infer_depths, [filled(P, 13, STEPS), filled(P, 13, 3), filled(P, value=2.0),
                                             filled(P, 12), filled(P, 12), filled(P, value=1.7), filled(P, 3)]),
    'read_depths': (COMPILED.read_depths, [filled(P, 13, STEPS)]),
    'with_frame': (COMPILED.with_frame, [SIZES, filled(P, J, 3), FLAGS]),
    'satisfy_lengths': (COMPILED.satisfy_lengths, [filled(P, J, 3), filled(P, J, 3, 3), filled(P, BONES),
                                                   filled(P, BONES), FLAGS]),
    'correct': (COMPILED.correct, [STATE, filled(P, J, 3), filled(P, J, 3, 3), FLAGS]),
}
KINDS = ('number', 'all', 'shorter', 'longer', 'axis', 'flat', 'empty', 'type', 'reversed', 'text', 'junk')
TYPES = ('f2', '>f8', 'i8', 'u1', 'c16', 'O', 'U3', 'datetime64[s]')
CHANGES = st.lists(st.tuples(st.integers(0, 9), st.sampled_from(KINDS), st.integers(0, 2 ** 20), NUMBERS), max_size=3)


def changed(value, kind, place, number):
    """Return an argument spoiled in one way."""
    if isinstance(value, list):
        return [changed(part, kind, place, number) if i == place % len(value) else part for i, part in enumerate(value)]
    if not isinstance(value, np.ndarray) or kind == 'junk':
        return number if place % 3 else None
    if kind in ('number', 'all'):
        value = value.copy()
        with suppress(OverflowError, ValueError, IndexError):  # where the type can not hold this number
            value.flat[slice(None) if kind == 'all' else place % max(value.size, 1)] = number
        return value
    axis = place % value.ndim
    return {'shorter': lambda: value.take(range(value.shape[axis] - 1), axis), 'axis': lambda: value[None],
            'longer': lambda: np.repeat(value, 2, axis), 'flat': value.ravel, 'empty': lambda: value[:0],
            'reversed': lambda: value[::-1], 'text': lambda: np.full(value.shape, 'x'),
            'type': lambda: converted(value, TYPES[place % len(TYPES)])}[kind]()


def converted(value, dtype):
    try:
        return value.astype(dtype)
    except (TypeError, ValueError, RuntimeError):  # the last one: a time as too short a text
        return np.zeros(value.shape, dtype)


@pytest.mark.filterwarnings('ignore')
@pytest.mark.parametrize('name', list(CALLS))
@given(changes=CHANGES)
@example(changes=[(0, 'number', 0, 99), (2, 'junk', 1, -1)])
def test_function(name, changes):
    function, arguments = CALLS[name]
    spoilt = list(arguments)
    for argument, *change in changes:
        spoilt[argument % len(spoilt)] = changed(spoilt[argument % len(spoilt)], *change)
    survives(function, *spoilt, size=100000, errors=REFUSALS)

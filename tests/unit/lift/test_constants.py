"""Constants of the method: the compiled steps take those that they are built with, and refuse broken ones."""
from dataclasses import replace

import numpy as np
import pytest
import skeleton_extract_3d_lifting

from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.constants import CostConstants


def test_the_compiled_steps_use_the_constants_that_they_are_given():
    other = skeleton_extract_3d_lifting.Method(replace(METHOD, costs=CostConstants(steps=31, step=0.02)))
    beliefs = ((np.arange(31) - 15.0 - 4.0) ** 2).astype(np.float32)
    depth, _ = other.read_depths(beliefs)
    assert depth == pytest.approx(4 * 0.02, abs=1e-6)
    with pytest.raises(ValueError, match='must have size 31'):
        other.read_depths(np.zeros(45, np.float32))


@pytest.mark.parametrize('change, text', [
    ({'inference': {'turn_spread': np.ones(3)}}, 'turn_spread must have 2 values, got 3')])
def test_constants_of_the_wrong_shape_are_refused(change, text):
    broken = replace(METHOD, **{step: replace(getattr(METHOD, step), **values) for step, values in change.items()})
    with pytest.raises(ValueError, match=text):
        skeleton_extract_3d_lifting.Method(broken)


@pytest.mark.parametrize('name, arguments, text', [
    ('root_evidence', (np.zeros((2, 18, 24)), np.zeros((2, 18)), None), r'samples must have shape \(2, 18, 25\), got'),
    ('covered_by_self', (np.zeros((2, 17, 2)), np.zeros(2), 500.0), r'uv must have shape \(2, 18, 2\), got'),
    ('fit_pinhole', (np.zeros((3, 5)), np.zeros((2, 4), int)), r'pixels must have shape \(2, 5\), got \(2, 4\)')])
def test_arrays_of_the_wrong_shape_are_refused(name, arguments, text):
    method = skeleton_extract_3d_lifting.Method(METHOD)
    with pytest.raises(ValueError, match=text):
        getattr(method, name)(*arguments)

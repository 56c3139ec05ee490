"""Constants of the method: the compiled steps take those that they are built with."""
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

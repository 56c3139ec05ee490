"""Things in the hands of rendered people."""
from types import SimpleNamespace

import numpy as np
import pytest

from development.benchmark_data.people.held import PALM, THINGS, WRISTS, Holder
from development.benchmark_data.people.rig import Posed

NO_RIG = SimpleNamespace()


def posed(left, right):
    joints = np.zeros((18, 3))
    joints[WRISTS] = left, right
    return Posed(joints, np.zeros((6, 3)), {}, np.zeros((0, 4, 4)))


@pytest.mark.parametrize('name', THINGS)
def test_a_thing_goes_along_with_the_hands(name):
    """A person faces the camera, along -y: the left hand is at the right of the picture."""
    holder = Holder(NO_RIG, None, name, [(0, (0.3, 0.3, 0.7))])
    here = holder.vertices(posed((0.3, 2.0, 1.2), (-0.3, 2.0, 1.2)), 0.0)
    there = holder.vertices(posed((0.3, 3.0, 1.3), (-0.3, 3.0, 1.3)), 0.0)
    np.testing.assert_allclose(there - here, np.broadcast_to([0, 1, 0.1], here.shape), atol=1e-9)
    assert holder.mesh.faces.max() == len(here) - 1 and here.shape == holder.mesh.rest.shape
    assert here[:, 1].min() < 2.0 - PALM and abs(here[:, 0].mean()) < 0.03, 'before the hands, between them'


def test_a_sheet_hangs_from_the_hands():
    holder = Holder(NO_RIG, None, 'towel', [(0, (0.4, 0.3, 0.7))])
    (width, height), corners = THINGS['towel'].sheet, holder.vertices(posed((0.43, 2.0, 1.5), (-0.43, 2.0, 1.5)), 0.7)
    assert np.ptp(corners[:, 0]) == pytest.approx(width) and np.ptp(corners[:, 2]) == pytest.approx(height, abs=0.06)
    assert abs(corners[corners[:, 2] > 1.52, 0]).min() > 0.35, 'highest at the hands'

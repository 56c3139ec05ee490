"""A person comes back in sight: joints that the frame does not place come along with those that it does."""
import numpy as np
import pytest

from estimating import tracks_of
from skeleton_extract_3d.body.body import HEAD
from skeleton_extract_3d.track.correction import come_along

STEP = np.array([0.8, 0.0, -0.3])
HEAD_SEEN = np.isin(np.arange(18), HEAD)[None]


def tracks():
    """One person, last seen at 1 s."""
    xyz = np.random.default_rng(0).uniform(-0.5, 0.5, (1, 18, 3)) + np.array([0, 0, 3])
    return tracks_of(xyz, 1.0)


@pytest.mark.parametrize(('unseen', 'seen', 'moves'), [
    (0.5, HEAD_SEEN, True), (0.07, HEAD_SEEN, False), (0.5, np.zeros((1, 18), bool), False)],
    ids=['back in sight', 'seen all the time', 'no joint is placed'])
def test_whose_body_comes_along(unseen, seen, moves):
    before = tracks()
    position = before.joints.position + np.where(seen[..., None], STEP, 0)
    after = come_along(before.joints._replace(position=position), before, seen, 1.0 + unseen)
    expected = before.joints.position + (STEP if moves else np.where(seen[..., None], STEP, 0))
    np.testing.assert_allclose(after.position, expected, atol=1e-12)


def test_in_another_frame_people_and_their_directions_turn():
    quarter, before = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]), tracks()
    after = before.transformed(quarter, np.array([0, 0, 1.0]))
    np.testing.assert_allclose(after.joints.position, before.joints.position @ quarter.T + [0, 0, 1])
    np.testing.assert_allclose([after.left[0], after.down[0]], [[0, 0, -1], [0, 1, 0]])

"""Hidden feet and a known floor: standing people have them on it, no foot is below, and measured joints stay."""
import numpy as np
import pytest

from estimating import tracks_of
from skeleton_extract_3d.body.body import ENDS, HIPS, JOINTS, MIDDLES
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.track.completion import Completion, stand
from skeleton_extract_3d.track.tracks import Tracks

KNEES, ANKLES = MIDDLES[2:], ENDS[2:]
# A camera 1.3 m above the floor that looks 10 degrees down.
UP = np.array([0, -np.cos(np.radians(10)), -np.sin(np.radians(10))])
FLOOR = np.array([*UP, 1.3])
ON_FLOOR = METHOD.track.standing.ankle_height
NONE = np.zeros(18, bool)


def heights(xyz):
    return xyz @ UP + FLOOR[3]


def person(hips=0.92, knees=0.5, ankles=ON_FLOOR):
    """Joints 3 m ahead whose legs have these heights above the floor [m]; the others are 1.3 m above it."""
    height = np.full(len(JOINTS), 1.3)
    height[HIPS], height[KNEES], height[ANKLES] = hips, knees, ankles
    ahead = 3 * np.array([0, -UP[2], UP[1]]) * np.sign(UP[1])
    return ahead + np.linspace(-0.3, 0.3, len(JOINTS))[:, None] * [1, 0, 0] + (height - 1.3)[:, None] * UP


def completion(xyz, trusted):
    placed = np.ones((1, 18), bool)
    tracks = tracks_of(xyz[None], stature=METHOD.body.adult_stature)
    return Completion(tracks, np.broadcast_to(trusted, (1, 18)), placed, np.full((1, 18), 0.1))


def after(xyz, trusted=NONE, measured=NONE):
    return stand(completion(xyz, trusted), np.broadcast_to(measured, (1, 18)), FLOOR).tracks.joints.position[0]


def test_no_people():
    none = Completion(Tracks.none(), *[np.zeros((0, 18), bool)] * 2, np.zeros((0, 18)))
    assert len(stand(none, np.zeros((0, 18), bool), FLOOR).tracks) == 0


@pytest.mark.parametrize('ankles', [-0.05, 0.05, 0.25])
def test_ankles_without_a_keypoint_of_standing_people_are_on_the_floor(ankles):
    xyz = person(ankles=ankles)
    moved = after(xyz)
    np.testing.assert_allclose(heights(moved[ANKLES]), ON_FLOOR, atol=1e-9)
    np.testing.assert_allclose(heights(moved[KNEES]), 0.5 + (ON_FLOOR - ankles) / 2, atol=1e-9)
    others = np.setdiff1d(np.arange(18), np.concatenate([KNEES, ANKLES]))
    np.testing.assert_array_equal(moved[others], xyz[others])


def test_feet_of_sitting_people_stay_unless_below_the_floor():
    xyz = person(hips=0.5, knees=0.45, ankles=0.3)
    np.testing.assert_array_equal(after(xyz), xyz)
    np.testing.assert_allclose(heights(after(person(hips=0.5, knees=0.45, ankles=0))[ANKLES]), ON_FLOOR, atol=1e-9)


def test_a_hidden_ankle_with_a_keypoint_stays_at_its_pixel():
    trusted = np.isin(np.arange(18), ANKLES)
    xyz = person(ankles=0.02)
    moved = after(xyz, trusted)
    np.testing.assert_allclose(heights(moved[ANKLES]), ON_FLOOR, atol=1e-9)
    np.testing.assert_allclose(moved[ANKLES, :2] / moved[ANKLES, 2:], xyz[ANKLES, :2] / xyz[ANKLES, 2:])
    raised = person(ankles=0.2)  # a step
    np.testing.assert_array_equal(after(raised, trusted), raised)


def test_measured_ankles_stay():
    ankles = np.isin(np.arange(18), ANKLES)
    xyz = person(ankles=-0.05)
    np.testing.assert_array_equal(after(xyz, ankles, ankles), xyz)

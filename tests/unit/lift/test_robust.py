"""Depths of all joints at once: joints without a cost of their own are where the bones put them."""
import numpy as np
import pytest

from skeleton_extract_3d.body.body import BONES, ENDS, JOINTS, MIDDLES, ROOTS
from skeleton_extract_3d.constants import METHOD
from skeleton_extract_3d.lift.robust import bones_of
from synthetic_scene import Person, Pose, joints_of, pointing, standing, walking

DELTAS = METHOD.costs.deltas
ROOT_ROWS, MIDDLE_ROWS, END_ROWS = slice(0, 4), slice(4, 8), slice(8, 12)
# The joints in the order of the arrays; after them comes the middle of the ears.
NAMES = [JOINTS[joint] for joint in (*ROOTS, *MIDDLES, *ENDS)]
ROOT = 2.6


def truth(pose=None, yaw=0.0, x=0.0):
    """Return where the joints (12, 3) and the middle of the ears (3,) of a person are [m]."""
    joints = joints_of(Person(1, x, ROOT, pose or standing(), yaw=yaw), 1.2)
    return (np.array([joints[name] for name in NAMES]),
            (joints['left_ear'] + joints['right_ear']) / 2)


def lengths_of(xyz, head):
    """Return the true lengths of the bones, (1, 8) [m]."""
    shoulders, hips = xyz[0:2].mean(axis=0), xyz[2:4].mean(axis=0)
    upper, lower = (np.linalg.norm(xyz[start] - xyz[end], axis=1)
                    for start, end in ((ROOT_ROWS, MIDDLE_ROWS), (MIDDLE_ROWS, END_ROWS)))
    by_name = {'shoulders': np.linalg.norm(xyz[0] - xyz[1]), 'hips': np.linalg.norm(xyz[2] - xyz[3]),
               'trunk': np.linalg.norm(shoulders - hips), 'head': np.linalg.norm(shoulders - head),
               'upper_arm': upper[0], 'thigh': upper[2], 'forearm': lower[0], 'shin': lower[2]}
    return np.array([[by_name[name] for name in BONES]])


def inferred(xyz, head, hidden=(), left=(np.nan,) * 3, unknown=()):
    """Return the beliefs of a person whose joints, but the hidden ones, are visible at their depth."""
    z = np.concatenate([xyz[:, 2], head[2:]])
    costs = ((DELTAS - (z - ROOT)[:, None]) / 0.03) ** 2
    costs = np.minimum(costs, 60).astype(np.float32)
    costs[[NAMES.index(name) for name in hidden]] = 0
    missing = np.isin(NAMES, unknown)[None]
    costs[:12][missing[0]] = 0
    bones = bones_of(lengths_of(xyz, head), np.full((1, 8), 0.03))
    return METHOD.compiled.infer_depths(costs[None], rays_of(xyz, head), np.array([ROOT]), *bones,
                                        np.array([1.75]), np.array([left], float))


def rays_of(xyz, head):
    places = np.append(xyz, head[None], axis=0)
    return (places / places[:, 2:])[None]


# --- reading --------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize('depth', [-0.5, -0.013, 0.0, 0.31])
@pytest.mark.parametrize('sigma', [0.03, 0.08])
def test_of_a_parabola_its_lowest_point_and_width_are_read(depth, sigma):
    found, deviation = METHOD.compiled.read_depths(((DELTAS - depth) / sigma) ** 2)
    # the mean is over seven candidates around the cheapest one, which may be half a step off the middle
    assert found == pytest.approx(depth, abs=0.012)
    assert deviation == pytest.approx(sigma, rel=0.1)


def test_of_two_solutions_the_cheaper_one_is_read_and_the_other_one_widens_it():
    near, far = ((DELTAS - depth) / 0.03 for depth in (-0.3, 0.3))
    found, deviation = METHOD.compiled.read_depths(np.minimum(near ** 2 + 1, far ** 2))
    assert found == pytest.approx(0.3, abs=0.01)
    # the likelihoods are 1 and exp(-1/2): the other one is 0.6 m away with a probability of 0.38
    assert deviation == pytest.approx(np.sqrt(0.03 ** 2 + 0.378 * 0.6 ** 2), rel=0.05)


# --- inference ------------------------------------------------------------------------------------------------------

POSES = [(standing(), 0.0), (standing(40), 0.6), (walking(1.2), -0.8), (walking(4.0), np.pi)]


@pytest.mark.parametrize('pose, yaw', POSES)
def test_all_joints_agree_on_the_cost_of_the_best_pose(pose, yaw):
    # a min-marginal is the cost of the best of all poses through a candidate, so the least one is the same everywhere
    costs, _ = inferred(*truth(pose, yaw), hidden=('left_elbow', 'right_ankle', 'right_hip'))
    least = costs[0].min(axis=1)
    np.testing.assert_allclose(least, least[0], atol=1e-3)
    assert (least > -1e-3).all()


@pytest.mark.parametrize('pose, yaw', POSES)
@pytest.mark.parametrize('hidden', ['left_elbow', 'right_knee', 'right_wrist', 'left_ankle', 'left_shoulder',
                                    'right_hip'])
def test_a_hidden_joint_is_where_its_bones_are_as_long_as_they_are(pose, yaw, hidden):
    xyz, head = truth(pose, yaw)
    depth, sigma = METHOD.compiled.read_depths(inferred(xyz, head, [hidden])[0][0, :12])
    row = NAMES.index(hidden)
    # a bone across the view hardly tells depth: 2 cm of length are 12 cm of depth for 0.4 m
    assert abs(ROOT + depth[row] - xyz[row, 2]) < max(0.12, 2 * sigma[row])
    assert np.linalg.norm(xyz[row] / xyz[row, 2] * (ROOT + depth[row]) - xyz[row]) < 0.15
    others = np.arange(12) != row
    np.testing.assert_allclose(ROOT + depth[others], xyz[others, 2], atol=0.025)


def reaching(forwards):
    """Return a pose with the left forearm forwards by an angle [deg], the rest hanging."""
    rest = standing(5)
    fore = np.stack([rest.forearms[0], pointing(forwards, 0, 1)])
    return Pose(rest.upper_arms, fore, rest.thighs, rest.shins)


@pytest.mark.parametrize('yaw', [0.0, 0.5])
def test_of_two_solutions_for_a_wrist_the_one_in_front_is_taken(yaw):
    xyz, head = truth(reaching(60), yaw)
    row, elbow = NAMES.index('left_wrist'), NAMES.index('left_elbow')
    depth, _ = METHOD.compiled.read_depths(inferred(xyz, head, ['left_wrist'])[0][0, :12])
    assert xyz[elbow, 2] - xyz[row, 2] > 0.15
    assert ROOT + depth[row] == pytest.approx(xyz[row, 2], abs=0.06)


def test_what_was_before_decides_where_nothing_else_does():
    # from the side, either side may be the nearer one
    xyz, head = truth(standing(), np.radians(75))
    hidden = [name for name in NAMES if name.split('_')[1] in ('shoulder', 'hip', 'elbow', 'wrist')]
    across = xyz[0] - xyz[1]
    before = across / np.linalg.norm(across)
    for left in (before, before * [1, 1, -1]):
        found = inferred(xyz, head, hidden, 4 * left)[1][0]
        assert np.sign(found[2]) == np.sign(left[2])

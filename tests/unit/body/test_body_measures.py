"""How large people are: learnt from what was measured of them, an adult's proportions before."""
import numpy as np
import pytest

from skeleton_extract_3d.body.body import BODY, BONES, JOINTS
from skeleton_extract_3d.body.measures import Sizes, expected_lengths, learn
from synthetic_scene import Person, joints_of, standing

ALL = np.ones((1, 18), bool)
# The bones of the scene's people, who are 1.75 m tall.
TRUE = {'shoulders': 0.37, 'hips': 0.19, 'trunk': 0.51, 'upper_arm': 0.29, 'forearm': 0.25, 'thigh': 0.42,
        'shin': 0.42}


def person(scale=1.0):
    """Return the joints of a person, (1, 18, 3) [m]."""
    joints = joints_of(Person(1, 0.0, 2.6, standing(), scale=scale), 1.2)
    return np.array([[joints[name] for name in JOINTS]])


def one_person(stature=BODY.adult_stature):
    return Sizes.assumed(np.array([stature]))


def watched(xyz, frames=40, measured=ALL, scores=None, noise=0.0):
    """Return the sizes of a person who was measured in a number of frames."""
    one, rng = one_person(), np.random.default_rng(0)
    scores = np.ones((1, 18)) if scores is None else scores
    for _ in range(frames):
        one = learn(one, xyz + rng.normal(0, noise, xyz.shape), measured, scores)
    return one


def lengths(one):
    return dict(zip(BONES, expected_lengths(one)[0]))


# Winter, Biomechanics and Motor Control of Human Movement, fig. 4.1, as shares of the stature
@pytest.mark.parametrize('bone, share', [('forearm', 0.146), ('thigh', 0.245), ('shin', 0.246)])
def test_limbs_are_as_long_as_in_the_literature(bone, share):
    assert BODY.bone_lengths[BONES.index(bone)] == pytest.approx(share * BODY.adult_stature, rel=0.06)


@pytest.mark.parametrize('scale', [0.6, 1.0, 1.1])
def test_a_person_who_is_watched_is_known(scale):
    one = watched(person(scale))
    # proportions of the model and of the scene's people differ by up to 12 %, their median by less
    assert one.stature[0] == pytest.approx(1.75 * scale, rel=0.05)
    for bone, length in TRUE.items():
        # an adult's proportions count like 8 of 38 frames
        assert lengths(one)[bone] == pytest.approx(length * scale, rel=0.04), bone


@pytest.mark.parametrize('why', ['hidden', 'low score'])
def test_only_joints_that_were_measured_surely_count(why):
    xyz, poor = person(), np.isin(JOINTS, ('left_knee', 'right_knee'))[None]
    xyz[0, poor[0]] += 0.07
    measured, scores = (ALL & ~poor, None) if why == 'hidden' else (ALL, np.where(poor, 0.3, 1.0))
    one = watched(xyz, measured=measured, scores=scores)
    for bone in ('thigh', 'shin'):
        assert one.bone_weights[0, BONES.index(bone)] == 0
    assert lengths(one)['upper_arm'] == pytest.approx(TRUE['upper_arm'], rel=0.04)

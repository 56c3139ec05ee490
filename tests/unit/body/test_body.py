"""The model of the body: both sides alike, in agreement with itself and with what was measured on people."""
import pytest

from skeleton_extract_3d.body import body
from skeleton_extract_3d.body.body import BODY


# Winter, Biomechanics and Motor Control of Human Movement, fig. 4.1, as shares of the stature
@pytest.mark.parametrize('bone, share', [('forearm', 0.146), ('thigh', 0.245), ('shin', 0.246)])
def test_limbs_are_as_long_as_in_the_literature(bone, share):
    length = BODY.bone_lengths[body.BONES.index(bone)]
    assert length == pytest.approx(share * BODY.adult_stature, rel=0.06)

"""The two people types refuse what is inconsistent, so that nothing downstream has to check again."""
import numpy as np
import pytest

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

K = len(COCO_18.joints)


def keypoints(people=1):
    values = np.full((people, K, 3), np.nan)
    values[..., 2] = 0
    values[:, 0] = (10.5, 20.25, 0.9)
    return values


def people_3d(**changes):
    values = {'xyz': np.full((1, K, 3), np.nan), 'confidence': np.zeros((1, K)), 'status': np.zeros((1, K)),
              'sigma': np.full((1, K), np.nan), 'ids': np.zeros(1)}
    values.update(changes)
    return People3D(COCO_18, **values)


def test_nobody():
    people = People2D.empty(COCO_18)
    assert len(people) == 0
    assert people.xy.shape == (0, K, 2)
    assert people.present.shape == (0, K)
    assert len(People3D(COCO_18, np.zeros((0, K, 3)), np.zeros((0, K)), np.zeros((0, K)), np.zeros((0, K)),
                        np.zeros(0))) == 0


def test_people_hold_float32_and_int64():
    people = People2D(COCO_18, keypoints(), [0.5], [7])
    assert people.keypoints.dtype == np.float32
    assert people.ids.dtype == np.int64
    np.testing.assert_array_equal(people.xy[0, 0], [10.5, 20.25])
    np.testing.assert_array_equal(np.flatnonzero(people.present[0]), [0])
    assert people.confidence[0, 1] == 0


@pytest.mark.parametrize('values, scores, ids', [
    (np.zeros((K, 3)), [0.5], [0]),
    (np.zeros((1, K - 1, 3)), [0.5], [0]),
    (keypoints(), [], [0]),
    (keypoints(), [0.5], [0, 1]),
], ids=['no person axis', 'a joint too few', 'no score', 'an id too many'])
def test_wrong_shapes_are_refused_with_both_shapes(values, scores, ids):
    with pytest.raises(ValueError, match=r'expected .* got'):
        People2D(COCO_18, values, scores, ids)


@pytest.mark.parametrize('joint', [(np.nan, 20, 0.5), (10, 20, 0), (np.nan, np.nan, 0.5), (10, np.inf, 0.5)], ids=str)
def test_half_missing_joints_are_refused(joint):
    values = keypoints()
    values[0, 3] = joint
    with pytest.raises(ValueError, match='NaN x, y and score 0'):
        People2D(COCO_18, values, [0.5], [0])


@pytest.mark.parametrize('status', [MEASURED, INFERRED])
def test_a_position_in_space_needs_a_status_and_a_status_a_position(status):
    somewhere = np.full((1, K, 3), np.nan)
    somewhere[0, 2] = (0.1, 0.2, 3.0)
    stated = np.full((1, K), MISSING)
    stated[0, 2] = status
    assert people_3d(xyz=somewhere, status=stated).status[0, 2] == status
    with pytest.raises(ValueError, match='MISSING exactly where'):
        people_3d(xyz=somewhere)
    with pytest.raises(ValueError, match='MISSING exactly where'):
        people_3d(status=stated)


@pytest.mark.parametrize('name, value', [('confidence', np.zeros(K)), ('sigma', np.zeros((1, K, 1))),
                                         ('ids', np.zeros(2)), ('xyz', np.zeros((1, K)))])
def test_wrong_shapes_in_space_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f'{name} of COCO_18'):
        people_3d(**{name: value})

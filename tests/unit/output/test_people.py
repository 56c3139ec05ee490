"""The people types in 2D and 3D refuse inconsistent arrays: later steps need not check them."""
import numpy as np
import pytest

from openpose_ros_pkg.people import People2D
from openpose_ros_pkg.skeletons import COCO_18
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING, People3D

K = len(COCO_18.joints)


def keypoints(joint=(10.5, 20.25, 0.9)):
    """One person with one joint, (1, K, 3)."""
    values = np.full((1, K, 3), (np.nan, np.nan, 0))
    values[:, 0] = joint
    return values


def people_3d(**changes):
    values = {'xyz': np.full((1, K, 3), np.nan), 'confidence': np.zeros((1, K)), 'status': np.zeros((1, K)),
              'sigma': np.full((1, K), np.nan), 'ids': np.zeros(1)}
    return People3D(COCO_18, **{**values, **changes})


def test_people_are_looked_at_unless_said_otherwise():
    people = People2D(COCO_18, keypoints(), [0.5], [7])
    both = people.joined(People2D(COCO_18, keypoints(), [0.5], [8], [False]))
    assert both.looked.tolist() == [True, False] and both.select(np.array([1])).looked.tolist() == [False]


def test_people_are_there_unless_said_otherwise():
    people = People2D(COCO_18, keypoints(), [0.5], [7])
    both = people.joined(People2D(COCO_18, keypoints(), [0.5], [8], existence=[0.75]))
    assert both.existence.dtype == np.float64 and both.existence.tolist() == [1.0, 0.75]
    assert both.select(np.array([1])).existence.tolist() == [0.75]
    assert people_3d().existence.tolist() == [1.0] and people_3d(existence=[0.75]).existence.tolist() == [0.75]


@pytest.mark.parametrize('existence', [[], [0.5, 0.5], [1.25], [-0.25], [np.nan]])
def test_existence_that_is_no_probability_of_each_person_is_refused(existence):
    for people in (lambda: People2D(COCO_18, keypoints(), [0.5], [7], existence=existence),
                   lambda: people_3d(existence=existence)):
        with pytest.raises(ValueError, match='existence: expected'):
            people()


@pytest.mark.parametrize('values, scores, ids, text', [
    (np.zeros((K, 3)), [0.5], [0], r'expected .* got'), (np.zeros((1, K - 1, 3)), [0.5], [0], r'expected .* got'),
    (keypoints(), [], [0], r'expected .* got'), (keypoints(), [0.5], [0, 1], r'expected .* got'),
    *((keypoints(joint), [0.5], [0], 'NaN x, y and score 0') for joint in (
        (np.nan, 20, 0.5), (10, 20, 0), (np.nan, np.nan, 0.5), (10, np.inf, 0.5)))])
def test_wrong_shapes_and_half_missing_joints_are_refused(values, scores, ids, text):
    with pytest.raises(ValueError, match=text):
        People2D(COCO_18, values, scores, ids)


def test_points_of_whole_bodies_stay_with_their_people():
    points = np.random.default_rng(1).random((2, 133, 3))
    both = People2D(COCO_18, np.concatenate([keypoints(), keypoints()]), [0.5, 0.4], [7, 8], points=points)
    without = People2D(COCO_18, keypoints(), [0.5], [9])
    assert without.points is None and without.joined(without).points is None and without.select([0]).points is None
    np.testing.assert_array_equal(both.select(np.array([1])).points, points[1:].astype(np.float32))
    more = both.joined(without).points
    np.testing.assert_array_equal(more[:2], points.astype(np.float32))
    np.testing.assert_array_equal(more[2], np.tile((np.nan, np.nan, 0), (133, 1)))
    assert without.joined(both).points.shape == (3, 133, 3)
    with pytest.raises(ValueError, match='points: expected'):
        People2D(COCO_18, keypoints(), [0.5], [7], points=points)


@pytest.mark.parametrize('status', [MEASURED, INFERRED])
def test_a_position_in_space_needs_a_status_and_a_status_a_position(status):
    somewhere, stated = np.full((1, K, 3), np.nan), np.full((1, K), MISSING)
    somewhere[0, 2], stated[0, 2] = (0.1, 0.2, 3.0), status
    assert people_3d(xyz=somewhere, status=stated).status[0, 2] == status
    for half in ({'xyz': somewhere}, {'status': stated}):
        with pytest.raises(ValueError, match='MISSING exactly where'):
            people_3d(**half)


@pytest.mark.parametrize('name, value', [('confidence', np.zeros(K)), ('sigma', np.zeros((1, K, 1))),
                                         ('ids', np.zeros(2)), ('xyz', np.zeros((1, K)))])
def test_wrong_shapes_in_space_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f'{name}: expected'):
        people_3d(**{name: value})
